/* The same run on all ranks together and on every rank alone */
#include "support.h"

using namespace hhtest;

namespace
{

struct End {
  Array            u, v, a;
  TSHHT3Statistics s;
  double           t;
};

End run(MPI_Comm comm, const Problem &p, const std::string &options, bool setRoles)
{
  Simulation r(p, options, comm, setRoles);
  must(r.solve());
  return {r.u(), r.v(), r.a(), r.statistics(), r.t()};
}

/* The rounding of q enters Phi, and by (9b), divided by beta h^2, lambda and q''. Relative to the accelerations, the
   algebraic unknowns of an index-3 method cannot agree better than this in double precision, however they are computed */
double algebraicFloor(const Problem &p, const End &e)
{
  const double h = (p.t1 - p.t0) / e.s.steps;
  double       q = 0., a = 0.;
  for (PetscInt i = 0; i < p.n; i++)
    if (p.role[i] == TSHHT3_COORDINATE) {
      q = std::max(q, std::abs(e.u[i]));
      a = std::max(a, std::abs(e.a[i]));
    }
  return 100. * PETSC_MACHINE_EPSILON * q / (.25 * h * h * a);
}

void compare(const Problem &p, const std::string &options, bool setRoles = false)
{
  int size, rank;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const End all = run(PETSC_COMM_WORLD, p, options, setRoles), self = run(PETSC_COMM_SELF, p, options, setRoles);
  Array     q[2], v[2], l[2];
  for (PetscInt i = 0; i < p.n; i++)
    for (int k = 0; k < 2; k++) {
      const End &e = k ? self : all;
      (p.role[i] <= TSHHT3_STATE ? q[k] : l[k]).push_back(e.u[i]);
      /* the derivative of a state is as accurate as the accelerations on which it depends */
      (p.role[i] == TSHHT3_COORDINATE ? v[k] : l[k]).push_back(e.v[i]);
    }
  const double dq = relativeDifference(q[0], q[1]), dv = relativeDifference(v[0], v[1]),
               dl = relativeDifference(l[0], l[1]);
  if (rank == 0)
    MEASURED("%-12s %d ranks, %s: differ by %.1e in q, %.1e in q', %.1e in algebraic unknowns (rounding: %.1e); %d steps and %d",
             p.name.c_str(), size, setRoles ? "roles set" : "roles detected", dq, dv, dl, algebraicFloor(p, self),
             (int)all.s.steps, (int)self.s.steps);
  EXPECT_EQ(all.t, p.t1);
  EXPECT_EQ(all.s.steps, self.s.steps);
  EXPECT_LT(dq, 1e-9); /* rates at the start are differences over a short time */
  EXPECT_LT(dv, 1e-9);
  EXPECT_LT(dl, 1e-9 + algebraicFloor(p, self));
}

/* Steps of constant length, so that no decision depends on rounding errors, and corrections solved to rounding */
std::string steps(const Problem &p, int n)
{
  return fixedSteps((p.t1 - p.t0) / n) + "-ts_hhtdae_corrector_tolerance 1e-10 ";
}

} // namespace

TEST(Ranks, Pendulum)
{
  const Pendulum p(-90., 0., 1.);
  compare(p, steps(p, 100));
  compare(p, steps(p, 100), true);
  compare(p, steps(p, 100) + "-ts_hhtdae_form paper ");
}

TEST(Ranks, Andrews)
{
  const Andrews p(.01);
  compare(p, steps(p, 200));
  compare(p, steps(p, 200), true);
}

TEST(Ranks, FourBar)
{
  const FourBar p(3, .6);
  compare(p, steps(p, 100));
}

TEST(Ranks, UserVars)
{
  const UserVars p(1.);
  compare(p, steps(p, 200));
  compare(p, steps(p, 200), true);
  compare(p, steps(p, 200) + "-ts_hhtdae_form paper ");
}

TEST(Ranks, Oscillators)
{
  const Oscillators p({1., 3., 7., 20., 50.}, {0., .1, .02, 0., .5}, true, 3.);
  compare(p, steps(p, 200));
}

TEST(Ranks, Chain)
{
  const Chain p(30, 0., .3);
  compare(p, steps(p, 100));
}

TEST(Ranks, NonholonomicConstraints)
{
  const Sleigh p(1.);
  compare(p, steps(p, 100));
}

/* Under error control the results agree to the tolerance */
TEST(Ranks, ErrorControl)
{
  const Chain p(30, 0., .3);
  const End   all = run(PETSC_COMM_WORLD, p, tolerance(1e-6), false),
            self  = run(PETSC_COMM_SELF, p, tolerance(1e-6), false);
  EXPECT_NEAR((double)all.s.steps, (double)self.s.steps, 3.);
  Array q[2];
  for (PetscInt i = 0; i < p.n; i++)
    if (p.role[i] == TSHHT3_COORDINATE) {
      q[0].push_back(all.u[i]);
      q[1].push_back(self.u[i]);
    }
  EXPECT_LT(relativeDifference(q[0], q[1]), 1e-5);
}

TEST(Ranks, Projection)
{
  struct Displaced : Chain {
    Displaced() : Chain(10, 0., .05) {}
    void initial(double *u, double *v) const override
    {
      Chain::initial(u, v);
      for (PetscInt b = 0; b < bodies; b++) u[5 * b] *= 1.001;
    }
  } p;
  compare(p, steps(p, 20) + "-ts_hhtdae_start project ");
}

/* More ranks than bodies: some ranks have no multiplier, some only a multiplier */
TEST(Ranks, FewerUnknownsThanRanks)
{
  const Oscillators p({2.}, {0.}, false, 1.);
  compare(p, steps(p, 50));
}

/* The error message is the same on all ranks, and no rank is left waiting */
TEST(Ranks, ErrorsReachAllRanks)
{
  struct Spoiled : Pendulum {
    Spoiled() : Pendulum(-60., 1., 1.) {}
    void residual(double t, const double *u, const double *v, const double *a, double *f) const override
    {
      Pendulum::residual(t, u, v, a, f);
      if (t > .2) f[1] = NAN;
    }
  } p;
  Simulation r(p, tolerance(1e-6) + "-ts_error_if_step_fails 0", PETSC_COMM_WORLD);
  must(r.solve());
  EXPECT_LT(r.reason(), 0);
  EXPECT_LT(r.errors().q, 1e-3);
}

TEST(Ranks, Checkpoint)
{
  const Andrews     p(.01);
  const std::string file = testing::TempDir() + "hhtdae-ranks-checkpoint", o = steps(p, 100);
  Simulation        first(p, o, PETSC_COMM_WORLD), second(p, o, PETSC_COMM_WORLD);
  for (int k = 0; k < 40; k++) must(first.step());
  must(TSHHT3CheckpointSave(first.ts, file.c_str()));
  must(TSHHT3CheckpointLoad(second.ts, file.c_str()));
  must(first.solve());
  must(second.solve());
  EXPECT_EQ(first.u(), second.u());
  EXPECT_EQ(first.v(), second.v());
  int rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Barrier(PETSC_COMM_WORLD);
  if (!rank) std::remove(file.c_str());
}

/* Every rank names an unknown of the next rank, which is refused */
TEST(Ranks, IndexOfAnotherRankIsRefused)
{
  const Chain p(10, 0., .1);
  Simulation  r(p, "", PETSC_COMM_WORLD);
  PetscInt    first, end;
  IS          is;
  must(VecGetOwnershipRange(r.U, &first, &end));
  must(ISCreateStride(PETSC_COMM_WORLD, 1, end % p.n + (end == p.n && first == 0 ? p.n : 0), 1, &is));
  must(TSHHT3SetIS(r.ts, TSHHT3_HOLONOMIC, is));
  must(ISDestroy(&is));
  ErrorTrap trap;
  EXPECT_EQ(TSSetUp(r.ts), PETSC_ERR_ARG_OUTOFRANGE);
  EXPECT_TRUE(trap.says("not among the unknowns")) << trap.message;
}

/* Orders above two at fixed steps, and the automatic order under error control */
TEST(Ranks, HigherOrder)
{
  const Pendulum pendulum(-90., 0., 1.);
  const UserVars uservars(1.);
  for (const char *order : {"3", "5"}) {
    compare(pendulum, steps(pendulum, 100) + "-ts_hhtdae_order " + order);
    compare(uservars, steps(uservars, 400) + "-ts_hhtdae_order " + order);
  }
  const std::string options = tolerance(1e-5) + " -ts_hhtdae_order auto ";
  const End         all = run(PETSC_COMM_WORLD, pendulum, options, false), self = run(PETSC_COMM_SELF, pendulum, options, false);
  for (int k = 2; k <= 5; k++) EXPECT_EQ(all.s.of_order[k], self.s.of_order[k]);
  EXPECT_LT(relativeDifference(all.u, self.u), 1e-6);
}
