/* Mechanisms whose motion is prescribed, wholly or in part: the forces that drive them must be accurate */
#include "support.h"

using namespace hhtest;

namespace
{

/* A planar body of 2 kg and 0.1 kg m^2 whose position x(t) = sin(3 t) is prescribed, on a guide through the origin
   that also prevents its rotation. The guide carries a varying load with the lever arm x. Optionally a pendulum of 1
   kg and 1 m swings beside it */
struct Carriage : Problem {
  const double m = 2., I = 0.1;
  explicit Carriage(bool pendulum)
  {
    name = pendulum ? "carriage and pendulum" : "carriage";
    n    = pendulum ? 9 : 6;
    t1   = 2.;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC, TSHHT3_HOLONOMIC, TSHHT3_HOLONOMIC};
    if (pendulum) role.insert(role.end(), {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC});
  }
  void initial(double *u, double *v) const override
  {
    std::fill_n(u, n, 0.);
    std::fill_n(v, n, 0.);
    v[0] = 3.;
    if (n > 6) u[6] = 1.;
  }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = m * a[0] + u[3] - u[2] * u[4];
    f[1] = m * a[1] + u[4] - 20. * std::sin(7. * t);
    f[2] = I * a[2] - u[0] * u[4] + u[5];
    f[3] = u[0] - std::sin(3. * t);
    f[4] = u[1] - u[0] * u[2];
    f[5] = u[2];
    if (n == 6) return;
    f[6] = a[6] + 2. * u[6] * u[8];
    f[7] = a[7] + 2. * u[7] * u[8] + 9.81;
    f[8] = u[6] * u[6] + u[7] * u[7] - 1.;
  }
  void jacobian(double, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    J.add(0, 0, m * sa);
    J.add(0, 2, -u[4]);
    J.add(0, 3, 1.);
    J.add(0, 4, -u[2]);
    J.add(1, 1, m * sa);
    J.add(1, 4, 1.);
    J.add(2, 0, -u[4]);
    J.add(2, 2, I * sa);
    J.add(2, 4, -u[0]);
    J.add(2, 5, 1.);
    J.add(3, 0, 1.);
    J.add(4, 0, -u[2]);
    J.add(4, 1, 1.);
    J.add(4, 2, -u[0]);
    J.add(5, 2, 1.);
    if (n == 6) return;
    for (int k = 6; k < 8; k++) {
      J.add(k, k, sa + 2. * u[8]);
      J.add(k, 8, 2. * u[k]);
      J.add(8, k, 2. * u[k]);
    }
  }
};

} // namespace

/* Corrections of prescribed positions are rounding errors and say nothing about the multipliers: after one correction
   with the matrix of an earlier step 4e-3 of the loads were not balanced. The multipliers must be as accurate as the
   accelerations of free coordinates */
TEST(Driven, ForcesOfGivenMotions)
{
  for (bool pendulum : {false, true})
    for (const char *options : {"", "-ts_hhtdae_corrector_tolerance 1e-9", "-ts_adapt_type none -ts_dt 1e-2", "-snes_lag_jacobian 1", "-snes_linesearch_type basic"}) {
      const Carriage p(pendulum);
      Simulation     run(p, tolerance(1e-4) + options);
      double         unsolved = 0., loads = 0.;
      run.watch               = [&](Simulation &r, PetscInt step, double t) {
        if (!step) return;
        const Array u = r.u(), v = r.v(), a = r.a();
        Array       f(u.size());
        p.residual(t, u.data(), v.data(), a.data(), f.data());
        for (int k = 0; k < 3; k++) widen(unsolved, std::abs(f[(size_t)k])), widen(loads, std::abs(u[(size_t)k + 3]));
      };
      must(run.solve());
      Printed out;
      must(TSView(run.ts, PETSC_VIEWER_STDOUT_SELF));
      EXPECT_TRUE(out.says("forces of 3 coordinates whose motion is given")) << out.text();
      const TSHHT3Statistics s = run.statistics();
      MEASURED("%s %s: %.1e of the loads unsolved; %d steps, %d iterations, %d factorizations", p.name.c_str(), options, unsolved / loads, (int)s.steps,
               (int)s.newton, (int)s.factorizations);
      EXPECT_LT(unsolved, 1e-9 * loads) << p.name << " " << options;
    }
}

/* While a pendulum hangs straight down, its rod seems to prescribe one coordinate. Once the pendulum has turned, no
   residuals are spent on this coordinate any more */
TEST(Driven, FreeAfterAll)
{
  const Pendulum down(-90., 2., 2.), aside(-80., 2., 2.);
  Simulation     hanging(down, tolerance(1e-6)), leaning(aside, tolerance(1e-6));
  must(hanging.solve());
  must(leaning.solve());
  const TSHHT3Statistics h = hanging.statistics(), l = leaning.statistics();
  MEASURED("hanging: %d residuals, %d iterations; leaning: %d, %d", (int)h.residuals, (int)h.newton, (int)l.residuals, (int)l.newton);
  EXPECT_LE(h.residuals - h.newton, l.residuals - l.newton + 20);
}
