/* Mechanisms whose motions are all given: what is asked for are the forces that it takes */
#include "support.h"

using namespace hhtest;

namespace
{

/* A planar body of 2 kg and 0.1 kg m^2 that is led along x, x(t) = sin(3 t), on a guide through the origin that it must not turn about: the force
   of the guide, which holds a varying load, has the lever arm x */
struct Carriage : Problem {
  const double m = 2., I = 0.1;
  Carriage()
  {
    name = "carriage";
    n    = 6;
    t1   = 2.;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC, TSHHT3_HOLONOMIC, TSHHT3_HOLONOMIC};
  }
  void initial(double *u, double *v) const override
  {
    std::fill_n(u, 6, 0.);
    std::fill_n(v, 6, 0.);
    v[0] = 3.;
  }
  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    f[0] = m * a[0] + u[3] - u[2] * u[4];
    f[1] = m * a[1] + u[4] - 20. * std::sin(7. * t);
    f[2] = I * a[2] - u[0] * u[4] + u[5];
    f[3] = u[0] - std::sin(3. * t);
    f[4] = u[1] - u[0] * u[2];
    f[5] = u[2];
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
  }
};

} // namespace

/* Where no motion is free corrections of the positions are rounding, and say nothing of those of the multipliers: one correction with the matrix
   of an earlier step left 4e-3 of the loads. */
TEST(Driven, ForcesOfGivenMotions)
{
  const Carriage p;
  for (const char *options : {"", "-ts_hhtdae_corrector_tolerance 1e-9", "-ts_adapt_type none -ts_dt 1e-2"}) {
    Simulation run(p, tolerance(1e-4) + options);
    double     unsolved = 0., loads = 0.;
    run.watch           = [&](Simulation &r, PetscInt step, double t) {
      if (!step) return;
      const Array u = r.u(), v = r.v(), a = r.a();
      Array       f(u.size());
      p.residual(t, u.data(), v.data(), a.data(), f.data());
      for (int k = 0; k < 3; k++) widen(unsolved, std::abs(f[(size_t)k])), widen(loads, std::abs(u[(size_t)k + 3]));
    };
    must(run.solve());
    const TSHHT3Statistics s = run.statistics();
    MEASURED("carriage %s: %.1e of the loads unsolved; %d steps, %d iterations, %d factorizations", options, unsolved / loads, (int)s.steps,
             (int)s.newton, (int)s.factorizations);
    EXPECT_LT(unsolved, 1e-9 * loads);
  }
}
