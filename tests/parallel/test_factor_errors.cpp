/* If a factorization fails on one rank, all ranks know it: none waits, and the message is the same */
#include "support.h"

using namespace hhtest;

namespace
{

/* Independent oscillators of which the last loses its inertia and its spring for some time: only the block on the last
   rank is singular */
struct Fading : Oscillators {
  const double from, to;
  Fading(double begin, double end) : Oscillators({1., 2., 1.5, 3.}, {.1, .1, .1, .1}, false, 1.), from(begin), to(end) {}
  bool gone(double t) const { return t > from && t < to; }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Oscillators::residual(t, u, v, a, f);
    if (gone(t)) f[n - 1] = 0.;
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa, Entries &J) const override
  {
    Oscillators::jacobian(t, u, v, a, sv, sa, J);
    if (gone(t))
      for (size_t k = 0; k < J.value.size(); k++)
        if (J.row[k] == n - 1) J.value[k] = 0.;
  }
};

constexpr char blocks[] = "-ksp_type gmres -pc_type bjacobi -sub_pc_type lu -snes_lag_jacobian 1 -ts_max_reject 8 ";

} // namespace

TEST(ParallelFactorErrors, ABlockOfOneRank)
{
  const Fading p(.5, 2.);
  Simulation   run(p, tolerance(1e-5) + blocks, PETSC_COMM_WORLD);
  ErrorTrap    trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED);
  EXPECT_TRUE(trap.says("preconditioner bjacobi cannot treat this matrix")) << trap.message;
  EXPECT_LE(run.t(), .5);
}

TEST(ParallelFactorErrors, ABlockOfOneRankAtTheStart)
{
  const Fading p(-1., 2.);
  Simulation   run(p, tolerance(1e-5) + blocks, PETSC_COMM_WORLD, true);
  ErrorTrap    trap;
  EXPECT_EQ(run.solve(), PETSC_ERR_NOT_CONVERGED);
  EXPECT_TRUE(trap.says("No consistent accelerations")) << trap.message;
}

/* One matrix over all ranks, whose singularity each of our packages reports on all ranks */
TEST(ParallelFactorErrors, OneMatrixOverAllRanks)
{
  for (const char *package : {"", "-pc_factor_mat_solver_type mumps ", "-pc_factor_mat_solver_type kluparts ", "-pc_factor_mat_solver_type mumpsnd ",
                              "-pc_factor_mat_solver_type smumpsnd ", "-pc_factor_mat_solver_type mumpsmixed "}) {
    const Fading p(.5, 2.);
    Simulation   run(p, tolerance(1e-5) + "-snes_lag_jacobian 1 -ts_max_reject 8 " + package, PETSC_COMM_WORLD);
    ErrorTrap    trap;
    EXPECT_NE(run.solve(), 0) << package;
    EXPECT_TRUE(trap.says("singular")) << package << trap.message;
    EXPECT_LE(run.t(), .5);
  }
}
