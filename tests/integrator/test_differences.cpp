/* Jacobians by differences where the application gives none, and the Newton matrix against differences of the
   integrator's residual */
#include "support.h"

#include <algorithm>
#include <cstdio>
#include <petscdmda.h>
#include <unistd.h>

using namespace hhtest;

namespace
{

/* State at the end of a run */
struct End {
  Array            u, v;
  TSHHT3Statistics statistics;
};

/* A TS with the residual of the problem and no Jacobian */
struct WithoutJacobian {
  TS  source, ts;
  Vec U, V, F;

  explicit WithoutJacobian(const Problem &p)
  {
    TSI2Function function;
    void        *ctx;
    must(ProblemCreateTS(PETSC_COMM_SELF, p, &source, &U, &V));
    must(TSGetI2Function(source, nullptr, &function, &ctx));
    must(VecDuplicate(U, &F));
    must(TSCreate(PETSC_COMM_SELF, &ts));
    must(TSSetType(ts, TSHHT3));
    must(TSSetI2Function(ts, F, function, ctx));
    must(TS2SetSolution(ts, U, V));
    must(TSSetMaxTime(ts, p.t1));
  }
  ~WithoutJacobian()
  {
    must(TSDestroy(&ts));
    must(TSDestroy(&source));
    for (Vec *x : {&U, &V, &F}) must(VecDestroy(x));
  }
};

End withoutJacobian(const Problem &p, const std::string &options)
{
  const Options         in(options);
  const WithoutJacobian run(p);
  TS                    ts = run.ts;
  must(TSSetTimeStep(ts, 1e-3 * (p.t1 - p.t0)));
  must(TSSetMaxSteps(ts, 1000000));
  must(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
  must(TSSetFromOptions(ts));
  must(TSSolve(ts, nullptr));
  End end = {whole(run.U), whole(run.V), {}};
  must(TSHHT3GetStatistics(ts, &end.statistics));
  return end;
}

/* The relative differences that -snes_test_jacobian prints */
std::vector<double> printedDifferences(const std::string &out)
{
  const std::string   key = "||J - Jfd||_F/||J||_F = ";
  std::vector<double> found;
  for (size_t at = out.find(key); at != std::string::npos; at = out.find(key, at + 1))
    found.push_back(std::atof(out.c_str() + at + key.size()));
  return found;
}

} // namespace

TEST(Differences, GiveTheSameAnswer)
{
  for (const Factory &f : allProblems()) {
    SCOPED_TRACE(f.name);
    const auto        p = f.make();
    const std::string o =
        fixedSteps((p->t1 - p->t0) / (p->name == "caraxis" ? 3000 : 500)) + "-ts_hhtdae_corrector_tolerance 1e-6 ";
    Simulation run(*p, o);
    must(run.solve());
    const End             end = withoutJacobian(*p, o);
    std::vector<PetscInt> q;
    Array                 a, b, va, vb;
    const Array           u = run.u(), v = run.v();
    for (PetscInt i = 0; i < p->n; i++)
      if (p->role[i] <= TSHHT3_STATE) {
        a.push_back(end.u[i]);
        b.push_back(u[i]);
        va.push_back(end.v[i]);
        vb.push_back(v[i]);
      }
    const double du = relativeDifference(a, b), dv = relativeDifference(va, vb);
    MEASURED("%-15s without a Jacobian: differs by %.1e in q, %.1e in q'; %d residuals in place of %d, %d steps, %d",
             f.name, du, dv, (int)end.statistics.residuals, (int)run.statistics().residuals, (int)end.statistics.steps,
             (int)run.statistics().steps);
    EXPECT_LT(du, 1e-5); /* the rates at the start are computed to four digits */
    EXPECT_LT(dv, 1e-5);
  }
}

/* Masses on springs, one of which also feels another one: a diagonal matrix has no place for that, and its unknowns are all of one color, so that the row changes with its own
   unknown in any case. Of 40 such places half may hide where colors are halved only once, and a sixteenth does. */
TEST(Differences, PlacesThatColorsHide)
{
  struct Masses : Problem {
    PetscInt felt = 1;
    Masses()
    {
      n    = 41;
      role = std::vector<TSHHT3Role>(n, TSHHT3_COORDINATE);
    }
    void initial(double *u, double *v) const override { std::fill_n(u, n, 0.1), std::fill_n(v, n, 0.); }
    void residual(double, const double *u, const double *, const double *a, double *f) const override
    {
      for (PetscInt i = 0; i < n; i++) f[i] = a[i] + u[i];
      f[0] += u[felt];
    }
    void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
    {
      for (PetscInt i = 0; i < n; i++) J.add(i, i, sa + 1);
    }
  } p;
  int found = 0;
  for (p.felt = 1; p.felt < p.n; p.felt++) {
    const WithoutJacobian run(p);
    SNES                  snes;
    Mat                   P;
    must(MatCreateSeqAIJ(PETSC_COMM_SELF, p.n, p.n, 1, nullptr, &P));
    for (PetscInt i = 0; i < p.n; i++) must(MatSetValue(P, i, i, 0, INSERT_VALUES));
    must(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
    must(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
    must(TSGetSNES(run.ts, &snes));
    must(SNESSetJacobian(snes, P, P, SNESComputeJacobianDefaultColor, nullptr));
    ErrorTrap trap;
    if (TSSetUp(run.ts)) {
      found++;
      EXPECT_TRUE(trap.says("no place for derivatives of row 0")) << trap.message;
    }
    must(MatDestroy(&P));
  }
  MEASURED("%d of %d hidden places are found", found, (int)p.n - 1);
  EXPECT_GE(found, 36);
}

/* A pendulum whose matrix for colored differences lacks the entries of the constraint, or has all entries */
TEST(Differences, MatricesWithoutPlaces)
{
  for (bool roles : {false, true})
    for (bool all : {false, true}) {
      const Pendulum p(-30., 0., .1);
      TS             source, ts;
      SNES           snes;
      Vec            U, V;
      Mat            P;
      TSI2Function   function;
      void          *ctx;
      must(ProblemCreateTS(PETSC_COMM_SELF, p, &source, &U, &V));
      must(TSGetI2Function(source, nullptr, &function, &ctx));
      must(MatCreateSeqAIJ(PETSC_COMM_SELF, 3, 3, 3, nullptr, &P));
      for (PetscInt i = 0; i < 3; i++)
        for (PetscInt j = 0; j < 3; j++)
          if (all || i == j) must(MatSetValue(P, i, j, 0, INSERT_VALUES));
      must(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
      must(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
      must(TSCreate(PETSC_COMM_SELF, &ts));
      must(TSSetType(ts, TSHHT3));
      must(TSSetI2Function(ts, nullptr, function, ctx));
      must(TS2SetSolution(ts, U, V));
      must(TSGetSNES(ts, &snes));
      must(SNESSetJacobian(snes, P, P, SNESComputeJacobianDefaultColor, nullptr));
      if (roles) {
        IS             is;
        const PetscInt constraint = 2;
        must(ISCreateGeneral(PETSC_COMM_SELF, 1, &constraint, PETSC_COPY_VALUES, &is));
        must(TSHHT3SetIS(ts, TSHHT3_HOLONOMIC, is));
        must(ISDestroy(&is));
      }
      Printed   out;
      ErrorTrap trap;
      const PetscErrorCode error = TSSetUp(ts);
      EXPECT_EQ(error != 0, !all && !roles) << trap.message;
      if (error) {
        EXPECT_TRUE(trap.says("no place for derivatives of row")) << trap.message;
      }
      EXPECT_EQ(out.text().find("an approximation") != std::string::npos, !all && roles) << out.text();
      must(TSDestroy(&ts));
      must(TSDestroy(&source));
      for (Vec *x : {&U, &V}) must(VecDestroy(x));
      must(MatDestroy(&P));
    }
}

TEST(Differences, AMatrixThatWasNeverAssembled)
{
  const Pendulum p(-30., 0., .1);
  TS             source, ts;
  SNES           snes;
  Vec            U, V;
  Mat            P;
  TSI2Function   function;
  void          *ctx;
  must(ProblemCreateTS(PETSC_COMM_SELF, p, &source, &U, &V));
  must(TSGetI2Function(source, nullptr, &function, &ctx));
  must(MatCreateSeqAIJ(PETSC_COMM_SELF, 3, 3, 3, nullptr, &P));
  must(MatSetUp(P));
  must(TSCreate(PETSC_COMM_SELF, &ts));
  must(TSSetType(ts, TSHHT3));
  must(TSSetI2Function(ts, nullptr, function, ctx));
  must(TS2SetSolution(ts, U, V));
  must(TSGetSNES(ts, &snes));
  must(SNESSetJacobian(snes, P, P, SNESComputeJacobianDefaultColor, nullptr));
  {
    ErrorTrap trap;
    EXPECT_EQ(TSSetUp(ts), PETSC_ERR_ORDER);
    EXPECT_TRUE(trap.says("never been assembled")) << trap.message;
  }
  must(TSDestroy(&ts));
  must(TSDestroy(&source));
  for (Vec *x : {&U, &V}) must(VecDestroy(x));
  must(MatDestroy(&P));
}

/* The matrix D_r J D_c of the steps against PETSc's differences of the scaled residual. PETSc's increments for
   vanishing unknowns are too small compared with rounding, above all in the first step; the median of all checks is
   insensitive to these */
TEST(Differences, SnesTestJacobian)
{
  for (const Factory &f : allProblems()) {
    SCOPED_TRACE(f.name);
    const auto p = f.make();
    for (const char *form : {"second_order", "paper"}) {
      std::vector<double> d;
      {
        Simulation run(*p, fixedSteps((p->t1 - p->t0) / 40.) +
                               "-snes_test_jacobian -ts_max_steps 20 -snes_lag_jacobian 1 " + "-ts_hhtdae_form " +
                               form);
        Printed    out;
        must(run.solve());
        d = printedDifferences(out.text());
      }
      ASSERT_GE((int)d.size(), 20);
      std::sort(d.begin(), d.end());
      MEASURED("%-15s %-12s matrix against differences: median %.1e, worst %.1e of %d", f.name, form, d[d.size() / 2],
               d.back(), (int)d.size());
      /* andrews: for h < 1e-3 PETSc's increments change the positions too little */
      EXPECT_LT(d[d.size() / 2], p->name == "andrews" ? 5e-3 : 2e-4);
      EXPECT_LT(d.back(), 1e-2);
    }
  }
}

/* Starting from U = 0, where x + d - d differs from x by rounding, the detected nonzero pattern still has only the
   three entries per row of the springs */
TEST(Differences, NoPlaceThatNobodyFollows)
{
  struct Springs : Problem {
    Springs()
    {
      name = "springs";
      n    = 60;
      t1   = 1e-3;
      role.assign(n, TSHHT3_COORDINATE);
    }
    void initial(double *u, double *v) const override
    {
      std::fill(u, u + n, 0.);
      std::fill(v, v + n, 0.);
      v[0] = 1.;
    }
    void residual(double, const double *u, const double *, const double *a, double *f) const override
    {
      for (PetscInt i = 0; i < n; i++) f[i] = a[i] + 2. * u[i] - (i ? u[i - 1] : 0.) - (i + 1 < n ? u[i + 1] : 0.);
    }
    void jacobian(double, const double *, const double *, const double *, double, double, Entries &) const override {}
  } springs;
  const WithoutJacobian run(springs);
  SNES                  snes;
  Mat                   P;
  MatInfo               info;
  must(TSSetUp(run.ts));
  must(TSGetSNES(run.ts, &snes));
  must(SNESGetJacobian(snes, nullptr, &P, nullptr, nullptr));
  must(MatGetInfo(P, MAT_GLOBAL_SUM, &info));
  EXPECT_EQ(info.nz_used, 3. * springs.n - 2.);
}

/* PETSc's options for the differences hold */
TEST(Differences, StepsOfTheUser)
{
  const Pendulum p(-30., 0., .1);
  const Array    u = withoutJacobian(p, tolerance(1e-5)).u;
  EXPECT_EQ(withoutJacobian(p, tolerance(1e-5) + "-mat_fd_coloring_umin 2").u, u); /* has an effect with type ds only */
  EXPECT_NE(withoutJacobian(p, tolerance(1e-5) + "-mat_fd_coloring_err 1e-4").u, u);
  EXPECT_NE(withoutJacobian(p, tolerance(1e-5) + "-mat_fd_type ds -mat_fd_coloring_umin 1e-3").u, withoutJacobian(p, tolerance(1e-5) + "-mat_fd_type ds").u);
}

/* An inertia of 1 that is lost in the rounding of a force of 1e13 would let its coordinate be taken for a variable;
   the same holds for an inertia of 1e-6 beside one of 1 */
TEST(Differences, InertiaBesideStiffSprings)
{
  struct Springs : Problem {
    double m, k, q;
    Springs(double mass, double stiffness, double at) : m(mass), k(stiffness), q(at)
    {
      name = "springs";
      n    = 2;
      t1   = 10. / std::sqrt(k / m);
      role.assign(2, TSHHT3_COORDINATE);
    }
    void initial(double *u, double *v) const override { u[0] = q, u[1] = 1., v[0] = v[1] = 0.; }
    void residual(double, const double *u, const double *, const double *a, double *f) const override { f[0] = m * a[0] + k * u[0], f[1] = a[1] + u[1]; }
    void jacobian(double, const double *, const double *, const double *, double, double sa, Entries &J) const override
    {
      J.add(0, 0, m * sa + k);
      J.add(1, 1, sa + 1.);
    }
  };
  for (const Springs &p : {Springs(1., 9e12, 1.), Springs(1., 1e14, 1.), Springs(1., 1e18, 1.), Springs(1e-6, 1e9, 1e-2)}) {
    const End end = withoutJacobian(p, "-ts_rtol 1e-6 -ts_atol 1e-12");
    EXPECT_NEAR(end.u[0] / p.q, std::cos(10.), 1e-2) << p.k;
    EXPECT_NEAR(end.u[1], std::cos(p.t1), 1e-6) << p.k;
    EXPECT_GT(end.statistics.steps, 20) << p.k;
  }
}

namespace
{

/* A point mass on a rod of length L in Cartesian coordinates, released from the horizontal, in arbitrary units of
   length and of time: L and T = sqrt(L/g) */
struct Released : Problem {
  double L, g;
  Released(double length, double gravity) : L(length), g(gravity)
  {
    name = "released";
    n    = 3;
    t1   = 4. * std::sqrt(L / g);
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    u[0] = L, u[1] = u[2] = 0.;
    v[0] = v[1] = v[2] = 0.;
  }
  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = a[0] + 2. * u[0] * u[2];
    f[1] = a[1] + 2. * u[1] * u[2] + g;
    f[2] = u[0] * u[0] + u[1] * u[1] - L * L;
  }
  void jacobian(double, const double *, const double *, const double *, double, double, Entries &) const override {}
};

/* Number of steps, and final position over L */
std::pair<PetscInt, double> fall(double L, double g)
{
  const Released p(L, g);
  const End      end = withoutJacobian(p, text("-ts_rtol 1e-6 -ts_atol %g -ts_max_steps 3000 ", 1e-6 * L));
  return {end.statistics.steps, end.u[0] / L};
}

} // namespace

/* Multipliers as small as the probing increments make products with coordinates that are lost in the rounding of large
   forces */
TEST(Differences, MultipliersBesideLargeForces)
{
  const auto one = fall(1., 9.81);
  for (double scale : {1e6, 1e8, 1e10, 1e14}) {
    const auto other = fall(1., 9.81 * scale);
    EXPECT_NEAR((double)other.first, (double)one.first, 0.02 * (double)one.first) << scale;
    EXPECT_NEAR(other.second, one.second, 1e-4) << scale;
  }
}

/* The squares of large positions hide small changes of positions that begin at zero */
TEST(Differences, LargePositions)
{
  const auto one = fall(1., 9.81);
  for (double scale : {1e4, 1e6, 1e9}) {
    const auto other = fall(scale, 9.81 * scale);
    EXPECT_NEAR((double)other.first, (double)one.first, 0.1 * (double)one.first) << scale;
    EXPECT_NEAR(other.second, one.second, 1e-4) << scale;
  }
}

namespace
{

/* A pendulum whose functions and matrix are attached to a DM; the matrix has all entries if `places` is set, otherwise
   only the diagonal */
class PendulumOfADM
{
public:
  PendulumOfADM(bool places, bool jacobian, const std::string &options) : options_(options)
  {
    TSI2Function f;
    TSI2Jacobian j;
    void        *of_f, *of_j;
    DM           dm;
    must(ProblemCreateTS(PETSC_COMM_SELF, pendulum_, &source_, &U, &V));
    must(TSGetI2Function(source_, nullptr, &f, &of_f));
    must(TSGetI2Jacobian(source_, nullptr, nullptr, &j, &of_j));
    must(DMDACreate1d(PETSC_COMM_SELF, DM_BOUNDARY_NONE, 3, 1, places ? 2 : 0, nullptr, &dm));
    must(DMSetUp(dm));
    must(DMTSSetI2Function(dm, f, of_f));
    if (jacobian) must(DMTSSetI2Jacobian(dm, j, of_j));
    must(TSCreate(PETSC_COMM_SELF, &ts));
    must(TSSetType(ts, TSHHT3));
    must(TSSetDM(ts, dm));
    must(DMDestroy(&dm));
    must(TS2SetSolution(ts, U, V));
    must(TSSetMaxTime(ts, pendulum_.t1));
    must(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
    Options in(options_);
    must(TSSetFromOptions(ts));
  }
  ~PendulumOfADM()
  {
    TSDestroy(&ts);
    TSDestroy(&source_);
    VecDestroy(&U);
    VecDestroy(&V);
  }
  PetscErrorCode solve()
  {
    Options in(options_);
    return TSSolve(ts, nullptr);
  }
  TSHHT3Statistics statistics() const
  {
    TSHHT3Statistics s;
    must(TSHHT3GetStatistics(ts, &s));
    return s;
  }
  TS  ts = nullptr;
  Vec U = nullptr, V = nullptr;

private:
  const Pendulum    pendulum_{-90., 0., 2.};
  const std::string options_;
  TS                source_ = nullptr;
};

} // namespace

/* The DM's matrix has no entries for derivatives of constraints: -snes_fd finds the complete nonzero pattern, with and
   without a Jacobian of the application */
TEST(Differences, AllPlacesOfADM)
{
  PendulumOfADM given(true, true, tolerance(1e-5)), found(false, false, tolerance(1e-5) + "-snes_fd");
  must(given.solve());
  must(found.solve());
  EXPECT_LT(relativeDifference(whole(found.U), whole(given.U)), 1e-6);
}

/* A run resumed from a checkpoint calls the Jacobian of the DM, as the uninterrupted run does */
TEST(Checkpoint, JacobianOfADM)
{
  const std::string file = testing::TempDir() + "hhtdae-jacobian-of-a-dm-" + std::to_string((long)getpid()), reuse = tolerance(1e-5) + "-ts_hhtdae_reuse 1,0,1 ";
  PendulumOfADM     all(true, true, reuse), first(true, true, reuse + "-ts_max_steps 20 -ts_hhtdae_checkpoint " + file), rest(true, true, reuse + "-ts_hhtdae_resume " + file);
  must(all.solve());
  must(first.solve());
  must(rest.solve());
  for (const char *part : {"", ".info"}) std::remove((file + part).c_str());
  EXPECT_EQ(whole(rest.U), whole(all.U));
  EXPECT_EQ(whole(rest.V), whole(all.V));
  EXPECT_EQ(rest.statistics().residuals, all.statistics().residuals);
  EXPECT_EQ(rest.statistics().jacobians, all.statistics().jacobians);
}
