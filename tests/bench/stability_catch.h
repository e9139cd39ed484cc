/* Brakes that engage: friction F0 tanh(v/v0), steep near zero velocity and flat on both sides, so that Newton's method
   jumps between the two sides where a body comes to rest within a step */
#ifndef HHTDAE_BENCH_STABILITY_CATCH_H
#define HHTDAE_BENCH_STABILITY_CATCH_H

#include "stability_models.h"

namespace hhtstab
{

/* Blocks of 1 kg on vertical guides (x, y and a multiplier for x = 0 each). Brakes engage at t = 0.5: the first block
   is falling, the second one is moving up, has twice the force, and comes to rest at another time, so that one slides
   while the other is at rest */
struct Caught : hhtex::Problem {
  static constexpr double g = 9.81;
  const int               blocks;
  const double            force[2], slope; /* F0, F0/v0 */
  const double            speed[2] = {0, 9}, grip[2] = {0.5, 0.55};

  Caught(int count, double F0, double s) : blocks(count), force{F0, 2 * F0}, slope(s)
  {
    name = "caught";
    n    = 3 * blocks;
    t1   = 1;
    for (int b = 0; b < blocks; b++) role.insert(role.end(), {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC});
  }
  double slip(int b) const { return force[b] / slope; }
  void   initial(double *u, double *v) const override
  {
    std::fill_n(u, n, 0.);
    std::fill_n(v, n, 0.);
    for (int b = 0; b < blocks; b++) v[3 * b + 1] = speed[b];
  }
  void residual(double t, const double *u, const double *v, const double *a, double *r) const override
  {
    for (int b = 0; b < blocks; b++) {
      const int i = 3 * b;
      r[i]        = a[i] + u[i + 2];
      r[i + 1]    = a[i + 1] + g + (t > grip[b] ? force[b] * std::tanh(v[i + 1] / slip(b)) : 0);
      r[i + 2]    = u[i];
    }
  }
  void jacobian(double t, const double *, const double *v, const double *, double sv, double sa, hhtex::Entries &J) const override
  {
    for (int b = 0; b < blocks; b++) {
      const int    i = 3 * b;
      const double T = std::tanh(v[i + 1] / slip(b));
      J.add(i, i, sa);
      J.add(i, i + 2, 1);
      J.add(i + 1, i + 1, sa + (t > grip[b] ? slope * (1 - T * T) * sv : 0));
      J.add(i + 2, i, 1);
    }
  }
  /* free flight, constant deceleration, rest; creep and the smooth part of tanh change the height by some v0 */
  double height(int b, double t) const
  {
    const double before = std::min(t, grip[b]), y = speed[b] * before - g * before * before / 2, v = speed[b] - g * before;
    if (t <= grip[b]) return y;
    const double brake = force[b] + (v > 0 ? g : -g), d = std::min(t - grip[b], std::abs(v) / brake);
    return y + (v > 0 ? 1 : -1) * (std::abs(v) * d - brake * d * d / 2);
  }
};

inline PetscErrorCode CaughtCase(Run &run, const Caught &p, double eps, double h)
{
  ProblemRun r(p);
  PetscFunctionBegin;
  PetscCall(r.create(run, eps, h));
  r.look = [&](double t, const double *u, const double *) {
    for (int b = 0; b < p.blocks; b++) run.judge(u[3 * b + 1] - p.height(b, t));
  };
  PetscCall(run.solve(r.ts));
  PetscFunctionReturn(0);
}

inline void AddCatches(Cases &cases)
{
  /* accept: a step over the engagement misses a velocity of up to F0 h, but at most the whole velocity: an error of
     5 m/s h. It depends on where in the step the engagement is: with `grip` from 0.1 earlier to 0.16 later the worst
     errors are 0.165 and 5.4e-3 */
  const struct {
    const char *name;
    double      eps, h, accept;
  } steps[] = {{"1e-3", 1e-3, 0, 0.17}, {"1e-6", 1e-6, 0, 6e-3}, {"1e-5, h=1e-3", 1e-5, 1e-3, 1e-2}};
  for (int blocks : {1, 2})
    for (double force : {2e1, 1e3, 1e6})
      for (double slope : {1e4, 1e6, 1e8, 1e10, 1e12})
        for (const auto &step : steps) {
          if (force / slope > 0.011) continue; /* the block creeps too fast */
          Case &c = Add(cases, "catches", Name("%.0e N, ", force) + Name("%.0e N s/m, ", slope) + step.name + (blocks > 1 ? ", two" : ""), "height, exact",
                        step.accept + 2 * force / slope, [=](Run &r) { return CaughtCase(r, Caught(blocks, force, slope), step.eps, step.h); });
          if (slope > 1e9 && blocks > 1) c.test();
        }
}

} // namespace hhtstab

#endif
