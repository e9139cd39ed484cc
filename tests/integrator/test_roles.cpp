/* Roles of unknowns: the detected roles equal the set ones for every example, and impossible roles are refused */
#include "integrator/state.h"
#include "support.h"

using namespace hhtest;

namespace
{

std::vector<int> roles(TS ts, PetscInt n)
{
  std::vector<int> r(n, -1);
  for (int k = 0; k < TSHHT3_NUM_ROLES; k++) {
    IS              is;
    PetscInt        m;
    const PetscInt *index;
    must(TSHHT3GetIS(ts, (TSHHT3Role)k, &is));
    if (!is) continue;
    must(ISGetLocalSize(is, &m));
    must(ISGetIndices(is, &index));
    for (PetscInt i = 0; i < m; i++) {
      EXPECT_EQ(r[index[i]], -1) << "unknown " << index[i] << " has two roles";
      r[index[i]] = k;
    }
    must(ISRestoreIndices(is, &index));
  }
  return r;
}

std::string view(TS ts)
{
  Printed out;
  must(TSView(ts, PETSC_VIEWER_STDOUT_SELF));
  return out.text();
}

void setIS(TS ts, TSHHT3Role role, std::vector<PetscInt> index)
{
  IS is;
  must(ISCreateGeneral(PETSC_COMM_SELF, (PetscInt)index.size(), index.data(), PETSC_COPY_VALUES, &is));
  must(TSHHT3SetIS(ts, role, is));
  must(ISDestroy(&is));
}

} // namespace

/* A force state and a variable differ only in their meaning for the application: both are detected as variables */
TEST(Roles, DetectedEqualSetOnes)
{
  for (const Factory &f : allProblems()) {
    SCOPED_TRACE(f.name);
    const auto p = f.make();
    Simulation detected(*p, "");
    must(TSSetUp(detected.ts));
    const std::vector<int> r = roles(detected.ts, p->n);
    std::vector<int>       expected(p->role.begin(), p->role.end());
    for (int &e : expected)
      if (e == TSHHT3_FORCE) e = TSHHT3_VARIABLE;
    EXPECT_EQ(r, expected);
    Simulation set(*p, "", PETSC_COMM_SELF, true);
    must(TSSetUp(set.ts));
    EXPECT_EQ(roles(set.ts, p->n), std::vector<int>(p->role.begin(), p->role.end()));
  }
}

/* With detected roles a run is the same to the last bit as with set ones */
TEST(Roles, DetectionDoesNotChangeTheRun)
{
  const UserVars p(.3);
  Simulation     detected(p, tolerance(1e-5)), set(p, tolerance(1e-5), PETSC_COMM_SELF, true);
  must(detected.solve());
  must(set.solve());
  EXPECT_EQ(detected.u(), set.u());
  EXPECT_EQ(detected.v(), set.v());
  EXPECT_EQ(detected.statistics().jacobians, set.statistics().jacobians); /* evaluations for the detection are not counted */
}

TEST(Roles, ViewSaysWhatIsLeftOut)
{
  const Pendulum p;
  Simulation     run(p, "");
  must(TSSetUp(run.ts));
  const std::string s = view(run.ts);
  EXPECT_NE(s.find("roles detected"), std::string::npos) << s;
  EXPECT_NE(s.find("2 coordinates 1 holonomic"), std::string::npos) << s;
  EXPECT_NE(s.find("left out: first-order states, velocity-level constraints, user-defined variables, force states"),
            std::string::npos)
      << s;
  const UserVars u;
  Simulation     set(u, "", PETSC_COMM_SELF, true);
  must(TSSetUp(set.ts));
  const std::string w = view(set.ts);
  EXPECT_NE(w.find("roles set by the application"), std::string::npos) << w;
  EXPECT_NE(w.find("left out: velocity-level constraints"), std::string::npos) << w;
}

/* A plain second-order ODE allocates neither roles nor scalings */
TEST(Roles, AnODECarriesNoRoleMachinery)
{
  const Oscillators p({1., 3.}, {0., 0.}, true, 1.);
  Simulation        run(p, "");
  must(run.solve());
  const hht3::Integrator &I = hht3::Get(run.ts);
  EXPECT_TRUE(I.role.empty());
  EXPECT_TRUE(I.moves.empty());
  EXPECT_TRUE(I.states.empty());
  EXPECT_EQ(I.gamma, nullptr);
  EXPECT_EQ(I.work, nullptr);
  EXPECT_EQ(I.constraints(), 0);
}

/* An unknown named with a wrong role is refused if its row contains inertia (a second derivative) or a rate (a first
   derivative) */
TEST(Roles, NamedAgainstTheirRows)
{
  struct Two : Problem {
    bool second;
    explicit Two(bool s) : second(s)
    {
      name = "two";
      n    = 2;
      t1   = 1.;
      role.assign(2, TSHHT3_COORDINATE);
      if (!second) role[1] = TSHHT3_STATE;
    }
    void initial(double *u, double *v) const override { u[0] = u[1] = 1., v[0] = 0., v[1] = second ? 0. : -1.; }
    void residual(double, const double *u, const double *v, const double *a, double *f) const override
    {
      f[0] = a[0] + u[0];
      f[1] = second ? a[1] + 4. * u[1] : v[1] + u[1];
    }
    void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
    {
      J.add(0, 0, sa + 1.);
      J.add(1, 1, second ? sa + 4. : sv + 1.);
    }
  };
  for (const bool second : {true, false})
    for (TSHHT3Role role : {TSHHT3_HOLONOMIC, TSHHT3_NONHOLONOMIC, TSHHT3_VARIABLE, TSHHT3_FORCE, TSHHT3_STATE}) {
      if (!second && role == TSHHT3_STATE) continue;
      const Two  p(second);
      Simulation run(p, tolerance(1e-6));
      ErrorTrap  trap;
      setIS(run.ts, role, {1});
      EXPECT_NE(TSSetUp(run.ts), 0) << second << TSHHT3Roles[role];
      EXPECT_NE(trap.message.find(second ? "second derivative" : "first derivative"), std::string::npos) << trap.message;
    }
}

/* A constraint row that depends on velocities or accelerations but is named holonomic would be scaled by 1/(beta h^2),
   and its multiplier would be wrong without any message */
TEST(Roles, RowsThatAreNotWhatTheyAreNamed)
{
  struct Differentiated : Pendulum {
    int times;
    explicit Differentiated(int n) : times(n) {}
    void residual(double t, const double *u, const double *v, const double *a, double *f) const override
    {
      Pendulum::residual(t, u, v, a, f);
      f[2] = u[0] * v[0] + u[1] * v[1];
      if (times == 2) f[2] = u[0] * a[0] + u[1] * a[1] + v[0] * v[0] + v[1] * v[1];
    }
  };
  for (const auto &[times, says, role] :
       {std::make_tuple(1, "depends on velocities: name its multiplier TSHHT3_NONHOLONOMIC", TSHHT3_HOLONOMIC),
        std::make_tuple(2, "depends on accelerations", TSHHT3_HOLONOMIC),
        std::make_tuple(2, "depends on accelerations", TSHHT3_NONHOLONOMIC)}) {
    const Differentiated p(times);
    Simulation           run(p, "");
    setIS(run.ts, role, {2});
    ErrorTrap trap;
    EXPECT_EQ(TSSetUp(run.ts), PETSC_ERR_ARG_WRONG);
    EXPECT_TRUE(trap.says("Row 2")) << trap.message;
    EXPECT_TRUE(trap.says(says)) << trap.message;
  }
}

/* Residuals whose last digits vary from call to call, as sums by several threads do, do not show a dependence */
TEST(Roles, ResidualsThatRoundDifferentlyAreNoOtherRoles)
{
  struct Noisy : Pendulum {
    mutable int calls = 0;
    void        residual(double t, const double *u, const double *v, const double *a, double *f) const override
    {
      Pendulum::residual(t, u, v, a, f);
      f[2] += 1e-16 * (++calls % 7);
    }
  } p;
  Simulation run(p, "");
  setIS(run.ts, TSHHT3_HOLONOMIC, {2});
  must(TSSetUp(run.ts));
}

/* The same with detected roles and beside a first-order state, whose influence on constraints is tested as well; s' = -s */
TEST(Roles, ResidualsThatRoundDifferentlyNeedNoNamedRoles)
{
  struct Noisy : Pendulum {
    mutable int calls = 0;
    Noisy()
    {
      n = 4;
      role.push_back(TSHHT3_STATE);
    }
    void initial(double *u, double *v) const override
    {
      Pendulum::initial(u, v);
      u[3] = 1.;
      v[3] = -1.;
    }
    void residual(double t, const double *u, const double *v, const double *a, double *f) const override
    {
      Pendulum::residual(t, u, v, a, f);
      f[2] += 1e-16 * (++calls % 7);
      f[3] = v[3] + u[3];
    }
    void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa, Entries &J) const override
    {
      Pendulum::jacobian(t, u, v, a, sv, sa, J);
      J.add(3, 3, sv + 1.);
    }
  } p;
  Simulation run(p, "");
  must(TSSetUp(run.ts));
  EXPECT_EQ(roles(run.ts, 4), (std::vector<int>{TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC, TSHHT3_STATE}));
}

TEST(Roles, OverlapIsRefused)
{
  const Pendulum p;
  Simulation     run(p, "");
  setIS(run.ts, TSHHT3_HOLONOMIC, {2});
  setIS(run.ts, TSHHT3_VARIABLE, {2});
  ErrorTrap trap;
  EXPECT_EQ(TSSetUp(run.ts), PETSC_ERR_ARG_WRONG);
  EXPECT_TRUE(trap.says("Unknown 2 is named twice")) << trap.message;
  EXPECT_TRUE(trap.says("holonomic")) << trap.message;
}

TEST(Roles, IndexOfNoUnknownIsRefused)
{
  const Pendulum p;
  Simulation     run(p, "");
  setIS(run.ts, TSHHT3_HOLONOMIC, {3});
  ErrorTrap trap;
  EXPECT_EQ(TSSetUp(run.ts), PETSC_ERR_ARG_OUTOFRANGE);
  EXPECT_TRUE(trap.says("Index 3")) << trap.message;
  EXPECT_TRUE(trap.says("0..2")) << trap.message;
}

TEST(Roles, UnknownRoleIsRefused)
{
  const Pendulum p;
  Simulation     run(p, "");
  IS             is;
  ErrorTrap      trap;
  EXPECT_EQ(TSHHT3GetIS(run.ts, (TSHHT3Role)17, &is), PETSC_ERR_ARG_OUTOFRANGE);
  EXPECT_TRUE(trap.says("17")) << trap.message;
}

TEST(Roles, AfterSetUpIsRefused)
{
  const Pendulum p;
  Simulation     run(p, "");
  must(TSSetUp(run.ts));
  ErrorTrap trap;
  IS        is;
  must(ISCreateStride(PETSC_COMM_SELF, 1, 2, 1, &is));
  EXPECT_EQ(TSHHT3SetIS(run.ts, TSHHT3_HOLONOMIC, is), PETSC_ERR_ARG_WRONGSTATE);
  must(ISDestroy(&is));
}

/* An unknown whose inertia is in another row violates the rule that row i is the equation of unknown i */
TEST(Roles, RowsInTheWrongOrderAreNamed)
{
  struct Swapped : Pendulum {
    void residual(double t, const double *u, const double *v, const double *a, double *f) const override
    {
      Pendulum::residual(t, u, v, a, f);
      std::swap(f[1], f[2]);
    }
    void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                  Entries &J) const override
    {
      Pendulum::jacobian(t, u, v, a, sv, sa, J);
      for (PetscInt &i : J.row) i = i == 1 ? 2 : i == 2 ? 1 : i;
    }
  } p;
  Simulation run(p, "");
  ErrorTrap  trap;
  EXPECT_EQ(TSSetUp(run.ts), PETSC_ERR_ARG_WRONG);
  EXPECT_TRUE(trap.says("Unknown 1 has inertia")) << trap.message;
}

TEST(Roles, EmptyRowIsNamed)
{
  struct Empty : Pendulum {
    void residual(double t, const double *u, const double *v, const double *a, double *f) const override
    {
      Pendulum::residual(t, u, v, a, f);
      f[2] = 0.;
    }
    void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                  Entries &J) const override
    {
      Pendulum::jacobian(t, u, v, a, sv, sa, J);
      for (size_t k = 0; k < J.row.size(); k++)
        if (J.row[k] == 2) J.value[k] = 0.;
    }
  } p;
  Simulation run(p, "");
  ErrorTrap  trap;
  EXPECT_EQ(TSSetUp(run.ts), PETSC_ERR_ARG_WRONG);
  EXPECT_TRUE(trap.says("Row 2 of the residual depends on no unknown")) << trap.message;
}

/* If only constraints are named, the coordinates are the remaining unknowns, also after TSReset() */
TEST(Roles, CoordinatesAreThoseThatNobodyNames)
{
  const Pendulum p;
  Simulation     run(p, "");
  IS             is;
  PetscInt       n;
  setIS(run.ts, TSHHT3_HOLONOMIC, {2});
  for (int k = 0; k < 2; k++) {
    must(TSHHT3GetIS(run.ts, TSHHT3_COORDINATE, &is));
    EXPECT_EQ(is, nullptr);
    must(TSSetUp(run.ts));
    must(TSHHT3GetIS(run.ts, TSHHT3_COORDINATE, &is));
    ASSERT_NE(is, nullptr);
    must(ISGetSize(is, &n));
    EXPECT_EQ(n, 2);
    must(TSReset(run.ts));
    must(TS2SetSolution(run.ts, run.U, run.V));
  }
}

/* After all index sets are removed the roles are detected */
TEST(Roles, SetsTakenBack)
{
  const Pendulum p(-90., 0., .1);
  Simulation     run(p, tolerance(1e-5), PETSC_COMM_SELF, true);
  ErrorTrap      trap;
  for (int role = 0; role < TSHHT3_NUM_ROLES; role++) EXPECT_EQ(TSHHT3SetIS(run.ts, (TSHHT3Role)role, nullptr), 0) << trap.message;
  EXPECT_FALSE(hht3::Get(run.ts).is_set);
  must(TSSetUp(run.ts));
  EXPECT_EQ(hht3::Get(run.ts).count[TSHHT3_HOLONOMIC], 1);
}
