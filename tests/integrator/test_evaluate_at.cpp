/* Accelerations, multipliers, variables and force states between the ends of a step, TSHHT3EvaluateAt() */
#include "matrix_types.h"

#include <array>

using namespace hhtest;

namespace
{

struct Sample {
  Vec U, V, A;
  explicit Sample(Vec like)
  {
    for (Vec *x : {&U, &V, &A}) must(VecDuplicate(like, x));
  }
  ~Sample()
  {
    for (Vec *x : {&U, &V, &A}) VecDestroy(x);
  }
  std::array<Array, 3> values() const { return {whole(U), whole(V), whole(A)}; }
};

struct SampleErrors {
  double a = 0., other = 0.; /* errors of q'' (a), and of multipliers, variables and force states (other) */
  void   take(const Problem &p, const std::array<Array, 3> &e)
  {
    for (PetscInt i = 0; i < p.n; i++) {
      if (p.role[i] == TSHHT3_COORDINATE) widen(a, std::abs(e[2][i]));
      else if (p.role[i] != TSHHT3_STATE) widen(other, std::abs(e[0][i]));
    }
  }
};

/* Errors at the ends of steps, of samples between them, and of linear interpolation at the same times; fixed steps to
   t = 1/2, evaluated in the second half */
struct Compared {
  SampleErrors ends, samples, linear;
  Compared(const Problem &p, double h, const std::string &options)
  {
    Simulation run(p, fixedSteps(h) + options);
    Sample     x(run.U);
    auto       errorsAt = [&](double t, bool interpolated) {
      std::array<Array, 3> e = {Array(p.n), Array(p.n), Array(p.n)};
      must((interpolated ? TSHHT3Interpolate : TSHHT3EvaluateAt)(run.ts, t, x.U, x.V, x.A));
      p.reference(t, e[0].data(), e[1].data(), e[2].data());
      const auto y = x.values();
      for (int k = 0; k < 3; k++)
        for (PetscInt i = 0; i < p.n; i++) e[k][i] = y[k][i] - e[k][i];
      return e;
    };
    double last = 0.;
    while (run.t() < .5) {
      must(run.step());
      const double t = run.t();
      if (t > .25) {
        ends.take(p, errorsAt(t, false));
        for (double theta : {.01, .2, .5, .7, .99}) {
          samples.take(p, errorsAt(last + theta * (t - last), false));
          linear.take(p, errorsAt(last + theta * (t - last), true));
        }
      }
      last = t;
    }
  }
};

/* The error of samples is of second order and about as large as that of the steps */
void expectOrder(const Problem &p, double h, const std::string &options = "")
{
  const Compared c(p, h, options), f(p, h / 2., options);
  MEASURED("%-14s %-24s h %.3g: q'' error %.1e, order %.2f, at the steps %.1e, linear %.1e; lambda, V, F %.1e, %.2f, at the steps "
           "%.1e, linear %.1e",
           p.name.c_str(), options.c_str(), h / 2., f.samples.a, order(c.samples.a, f.samples.a), f.ends.a, f.linear.a, f.samples.other,
           order(c.samples.other, f.samples.other), f.ends.other, f.linear.other);
  EXPECT_GE(order(c.samples.a, f.samples.a), 1.9);
  EXPECT_LT(f.samples.a, 1.2 * f.ends.a);
  if (f.samples.other > 0.) {
    EXPECT_GE(order(c.samples.other, f.samples.other), 1.9);
    EXPECT_LT(f.samples.other, 2. * f.ends.other);
  }
}

/* Largest residual of the equations of motion, states and definitions, relative to the largest multiplier or force in them */
double imbalance(Simulation &run, const Sample &x, double t)
{
  Vec F;
  must(VecDuplicate(x.U, &F));
  must(TSComputeI2Function(run.ts, t, x.U, x.V, x.A, F));
  const Array f = whole(F), u = whole(x.U), a = whole(x.A);
  double      worst = 0., scale = 1.;
  for (size_t i = 0; i < f.size(); i++) {
    const PetscInt r = run.problem.role[i];
    scale            = std::max({scale, std::abs(u[i]), std::abs(a[i])});
    if (r != TSHHT3_HOLONOMIC && r != TSHHT3_NONHOLONOMIC) widen(worst, std::abs(f[i]));
  }
  must(VecDestroy(&F));
  return worst / scale;
}

} // namespace

TEST(EvaluateAt, OrderBetweenSteps)
{
  for (const char *options : {"", "-ts_hhtdae_radius 0.5"}) {
    expectOrder(DoublePendulum(1.), .01, options);
    expectOrder(Pendulum(-60., 1., 1.), .02, options);
    expectOrder(UserVars(1.), .004, options);
    expectOrder(Oscillators({1., 3.}, {0., .1}, true, 1.), .02, options);
  }
}

/* Within a step far shorter than the time scale of the motion, differences of the constraints over the step would be
   dominated by rounding */
TEST(EvaluateAt, WithinAShortStep)
{
  const Pendulum p(-60., 1., 1.);
  Simulation     run(p, fixedSteps(1e-7));
  Sample         x(run.U);
  Array          e[3] = {Array(p.n), Array(p.n), Array(p.n)};
  double         worst = 0.;
  for (int k = 0; k < 5; k++) must(run.step());
  must(TSHHT3EvaluateAt(run.ts, run.t() - 0.5e-7, x.U, x.V, x.A));
  p.reference(run.t() - 0.5e-7, e[0].data(), e[1].data(), e[2].data());
  const auto y = x.values();
  for (PetscInt i = 0; i < p.n; i++) widen(worst, p.role[i] == TSHHT3_COORDINATE ? std::abs(y[2][i] - e[2][i]) : std::abs(y[0][i] - e[0][i]));
  MEASURED("largest error of accelerations and multipliers %.1e", worst);
  EXPECT_LT(worst, 1e-4);
}

/* For every problem, samples satisfy the equations of motion, states and definitions, and samples at the ends of a step
   have the values of the step */
TEST(EvaluateAt, EquationsHold)
{
  for (const Factory &f : allProblems())
    for (const char *form : {"", "-ts_hhtdae_form paper"}) {
      const auto p = f.make();
      Simulation run(*p, tolerance(1e-5) + form);
      Sample     x(run.U);
      double     worst = 0., last = p->t0;
      for (int step = 0; step < 30 && run.t() < p->t1; step++) {
        must(run.step());
        for (double theta : {.1, .5, .8}) {
          const double t = last + theta * (run.t() - last);
          must(TSHHT3EvaluateAt(run.ts, t, x.U, x.V, x.A));
          widen(worst, imbalance(run, x, t));
        }
        must(TSHHT3EvaluateAt(run.ts, run.t(), x.U, x.V, x.A));
        EXPECT_EQ(whole(x.U), run.u());
        EXPECT_EQ(whole(x.V), run.v());
        EXPECT_EQ(whole(x.A), run.a());
        const auto own = x.values();
        last           = run.t();
        if (step % 7 == 3 && run.t() < p->t1) {
          must(run.step());
          must(TSHHT3EvaluateAt(run.ts, last, x.U, x.V, x.A));
          EXPECT_EQ(x.values(), own);
          last = run.t();
        }
      }
      MEASURED("%-14s %-24s largest residual of samples, relative: %.1e", f.name, form, worst);
      EXPECT_LT(worst, 1e-8) << f.name << " " << form;
    }
}

/* A run with samples has the same digits and counters as the run without */
TEST(EvaluateAt, LeavesTheRunAlone)
{
  for (const Factory &f : allProblems())
    for (const char *options : {"", "-ts_hhtdae_form paper"}) {
      const auto         p = f.make();
      Array              u[2], v[2], a[2];
      TSHHT3Statistics   s[2];
      for (int sampled = 0; sampled < 2; sampled++) {
        Simulation run(*p, tolerance(1e-5) + options);
        Sample     x(run.U);
        double     last = p->t0;
        run.watch       = [&](Simulation &r, PetscInt step, double t) {
          if (sampled && step)
            for (double theta : {.3, .9}) must(TSHHT3EvaluateAt(r.ts, last + theta * (t - last), x.U, x.V, x.A));
          last = t;
        };
        must(run.solve());
        u[sampled] = run.u();
        v[sampled] = run.v();
        a[sampled] = run.a();
        s[sampled] = run.statistics();
      }
      EXPECT_EQ(u[0], u[1]) << f.name << " " << options;
      EXPECT_EQ(v[0], v[1]) << f.name << " " << options;
      EXPECT_EQ(a[0], a[1]) << f.name << " " << options;
      EXPECT_EQ(s[0].residuals, s[1].residuals);
      EXPECT_EQ(s[0].jacobians, s[1].jacobians);
      EXPECT_EQ(s[0].factorizations, s[1].factorizations);
      EXPECT_EQ(s[0].newton, s[1].newton);
    }
}

/* Checkpoints written or read between samples do not change the samples: those of a resumed run equal those of the
   uninterrupted one */
TEST(EvaluateAt, SamplesOfAResumedRun)
{
  for (const Factory &f : allProblems()) {
    const auto                        p    = f.make();
    const std::string                 file = testing::TempDir() + "samples_" + f.name + ".checkpoint";
    std::vector<std::array<Array, 3>> values[3]; /* of the uninterrupted run, the run that writes, the run that resumes */
    const auto                        samples = [&](Simulation &run, int first, int last, std::vector<std::array<Array, 3>> &to) {
      Sample x(run.U);
      double begin = run.t();
      for (int step = first; step < last && run.t() < p->t1; step++) {
        must(run.step());
        for (double theta : {.3, .8}) {
          must(TSHHT3EvaluateAt(run.ts, begin + theta * (run.t() - begin), x.U, x.V, x.A));
          to.push_back(x.values());
        }
        begin = run.t();
      }
    };
    Simulation plain(*p, tolerance(1e-5)), writing(*p, tolerance(1e-5)), resumed(*p, tolerance(1e-5));
    samples(plain, 0, 30, values[0]);
    samples(writing, 0, 12, values[1]);
    must(TSHHT3CheckpointSave(writing.ts, file.c_str()));
    const std::size_t read = values[1].size();
    samples(writing, 12, 30, values[1]);
    must(TSHHT3CheckpointLoad(resumed.ts, file.c_str()));
    must(TSSetUp(resumed.ts));
    samples(resumed, 12, 30, values[2]);
    EXPECT_EQ(values[0], values[1]) << f.name;
    ASSERT_GT(values[1].size(), read + 4) << f.name;
    EXPECT_TRUE(std::equal(values[1].begin() + read, values[1].end(), values[2].begin(), values[2].end())) << f.name;
  }
}

/* Times of a grid on which steps end, except for rounding, take the values at the end of the step and solve nothing */
TEST(EvaluateAt, OnAGridOfSteps)
{
  const DoublePendulum p(1.);
  Simulation           run(p, tolerance(1e-5));
  Sample               solved(run.U), interpolated(run.U);
  for (int k = 0; k < 5; k++) must(run.step());
  const double begin = run.t();
  must(run.step());
  const double h = run.t() - begin;
  for (double x : {1e-9, 0.5, 1 - 1e-9}) {
    must(TSHHT3EvaluateAt(run.ts, begin + x * h, solved.U, solved.V, solved.A));
    must(TSHHT3Interpolate(run.ts, begin + x * h, interpolated.U, interpolated.V, interpolated.A));
    EXPECT_EQ(solved.values() == interpolated.values(), x != 0.5) << x;
  }
}

/* With other linear solvers chosen by the user */
TEST(EvaluateAt, OtherSolvers)
{
  const DoublePendulum p(1.);
  for (const char *options : {"", "-ksp_type gmres -pc_type lu", "-pc_type lu -pc_factor_mat_solver_type mumps"}) {
    Simulation run(p, tolerance(1e-6) + options);
    Sample     x(run.U);
    for (int k = 0; k < 5; k++) must(run.step());
    const double t = run.t() - 1e-3;
    must(TSHHT3EvaluateAt(run.ts, t, x.U, x.V, x.A));
    EXPECT_LT(imbalance(run, x, t), 1e-9) << options;
    must(TSHHT3EvaluateAt(run.ts, t, nullptr, nullptr, x.A)); /* any of the output vectors may be absent */
    EXPECT_EQ(whole(x.A), x.values()[2]);
  }
}

TEST(EvaluateAt, RefusesOtherTimes)
{
  const Pendulum p(-90., 0., 1.);
  Simulation     run(p, tolerance(1e-5));
  Sample         x(run.U);
  ErrorTrap      trap;
  must(TSSetUp(run.ts));
  EXPECT_NE(TSHHT3EvaluateAt(run.ts, 0., x.U, nullptr, nullptr), 0);
  EXPECT_TRUE(trap.says("no step")) << trap.message;
  must(run.step());
  EXPECT_NE(TSHHT3EvaluateAt(run.ts, 2. * run.t() + 1., x.U, x.V, x.A), 0);
  EXPECT_TRUE(trap.says("not in the last step")) << trap.message;
}

namespace
{

/* A Jacobian function that finds its data through the context of the operator J */
PetscErrorCode byItsContext(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P, void *)
{
  OperatorData *d = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(J, &d));
  PetscCall(OperatorData::jacobian(ts, t, U, V, A, sv, sa, J, P, d));
  PetscFunctionReturn(0);
}

} // namespace

/* An operator that is a MATSHELL of the application cannot be duplicated for the evaluation of a sample; accelerations
   are then interpolated linearly */
TEST(EvaluateAt, BesideAProductOfTheApplication)
{
  const DoublePendulum p(1.);
  Simulation           run(p, tolerance(1e-6) + "-ksp_type gmres -ksp_rtol 1e-12");
  Sample               x(run.U), linear(run.U);
  OperatorData         data;
  Mat                  J, P;
  must(TSGetI2Jacobian(run.ts, nullptr, &P, &data.f, &data.ctx));
  must(MatCreateShell(PETSC_COMM_SELF, p.n, p.n, p.n, p.n, &data, &J));
  must(MatShellSetOperation(J, MATOP_MULT, (void (*)(void))OperatorData::product));
  data.J         = J;
  data.assembles = true;
  must(TSSetI2Jacobian(run.ts, J, P, byItsContext, nullptr));
  for (int k = 0; k < 5; k++) must(run.step());
  ErrorTrap trap;
  EXPECT_EQ(TSHHT3EvaluateAt(run.ts, run.t() - 1e-4, x.U, x.V, x.A), 0) << trap.message;
  must(TSHHT3Interpolate(run.ts, run.t() - 1e-4, linear.U, linear.V, linear.A));
  EXPECT_EQ(x.values(), linear.values());
  EXPECT_EQ(data.other, 0);
  must(MatDestroy(&J));
  must(MatDestroy(&data.values));
}

/* The same holds for a preconditioner whose parts the program has supplied */
TEST(EvaluateAt, PreconditionersWithParts)
{
  const DoublePendulum p(1.);
  const std::pair<PCType, const char *> types[] = {{PCCOMPOSITE, ""}, {PCFIELDSPLIT, ""}, {PCCOMPOSITE, " -pc_type composite"}, {PCFIELDSPLIT, " -pc_type fieldsplit"}};
  for (const auto &[type, named] : types) {
    const auto options = tolerance(1e-6) + "-ksp_type gmres -ksp_rtol 1e-12 -fieldsplit_all_pc_type svd" + named;
    Simulation run(p, options);
    Sample     x(run.U);
    SNES       snes;
    KSP        ksp;
    PC         pc;
    must(TSGetSNES(run.ts, &snes));
    must(SNESGetKSP(snes, &ksp));
    must(KSPGetPC(ksp, &pc));
    must(PCSetType(pc, type));
    if (std::string(type) == PCCOMPOSITE) must(PCCompositeAddPCType(pc, PCSVD));
    else {
      IS all;
      must(ISCreateStride(PETSC_COMM_SELF, p.n, 0, 1, &all));
      must(PCFieldSplitSetIS(pc, "all", all));
      must(ISDestroy(&all));
    }
    Options in(options);
    must(TSSetFromOptions(run.ts));
    for (int k = 0; k < 5; k++) must(run.step());
    ErrorTrap trap;
    const double t = run.t() - 1e-4;
    EXPECT_EQ(TSHHT3EvaluateAt(run.ts, t, x.U, x.V, x.A), 0) << trap.message;
    EXPECT_LT(imbalance(run, x, t), 1e-9);
  }
}
