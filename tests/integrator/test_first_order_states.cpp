/* First-order states at the start, after restarts and at every spectral radius: their errors follow the tolerance. */
#include "support.h"
#include <algorithm>
#include <cmath>

using namespace hhtest;

namespace
{

/* A state that follows cos(3 t/T) with the time constant T */
struct Follower : Problem {
  const double T;
  explicit Follower(double unit) : T(unit)
  {
    name = "follower";
    n    = 1;
    t1   = 5. * unit;
    role = {TSHHT3_STATE};
  }
  void   initial(double *u, double *v) const override { u[0] = v[0] = 0.; }
  void   residual(double t, const double *u, const double *v, const double *, double *f) const override { f[0] = v[0] - (std::cos(3. * t / T) - u[0]) / T; }
  void   jacobian(double, const double *, const double *, const double *, double sv, double, Entries &J) const override { J.add(0, 0, sv + 1. / T); }
  double exact(double t) const
  {
    const double x = t / T;
    return (std::cos(3. * x) + 3. * std::sin(3. * x) - std::exp(-x)) / 10.;
  }
};

double errorOfFollower(const Follower &p, const std::string &options, int every, PetscInt *steps, double *first)
{
  Simulation run(p, options);
  double     error = 0.;
  run.watch        = [&](Simulation &r, PetscInt step, double t) {
    if (step == 1) *first = t / p.T;
    widen(error, std::abs(r.u()[0] - p.exact(t)));
    if (every && step % every == every - 1) must(TSRestartStep(r.ts));
  };
  must(run.solve());
  *steps = run.statistics().steps;
  return error;
}

} // namespace

TEST(FirstStep, StatesInAnyUnitOfTime)
{
  PetscInt     steps[2];
  double       first[2];
  const double error = errorOfFollower(Follower(1.), tolerance(1e-6), 0, &steps[0], &first[0]);
  for (double unit : {1e-6, 1e3, 1e9}) {
    EXPECT_NEAR(errorOfFollower(Follower(unit), tolerance(1e-6), 0, &steps[1], &first[1]), error, 0.02 * error) << unit;
    EXPECT_NEAR((double)steps[1], (double)steps[0], 2.) << unit;
    EXPECT_NEAR(first[1], first[0], 0.01 * first[0]) << unit;
  }
}

namespace
{

/* A first-order lag of 2 ms whose input jumps from 0 to 10 at `jump`, where the integration restarts; beside a mass at
   rest and, if `guided`, a second mass held by a constraint */
struct SwitchedLag : Problem {
  const bool     guided;
  const double   lag = 2e-3, jump;
  mutable double input, since = 0.;
  SwitchedLag(bool g, double at) : guided(g), jump(at), input(at > 0 ? 0. : 10.)
  {
    name = "switched lag";
    n    = g ? 4 : 2;
    t1   = 0.05;
    role = {TSHHT3_COORDINATE, TSHHT3_STATE};
    if (g) role.insert(role.end(), {TSHHT3_COORDINATE, TSHHT3_HOLONOMIC});
  }
  void initial(double *u, double *v) const override { std::fill_n(u, n, 0.), std::fill_n(v, n, 0.); }
  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    f[0] = a[0];
    f[1] = v[1] - (input - u[1]) / lag;
    if (!guided) return;
    f[2] = a[2] + u[3];
    f[3] = u[2];
  }
  void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    J.add(0, 0, sa);
    J.add(1, 1, sv + 1. / lag);
    if (!guided) return;
    J.add(2, 2, sa);
    J.add(2, 3, 1.);
    J.add(3, 2, 1.);
  }
};

double errorOfSwitchedLag(const SwitchedLag &p, const std::string &options)
{
  Simulation run(p, options);
  double     error = 0.;
  run.watch        = [&](Simulation &r, PetscInt, double t) {
    widen(error, std::abs(r.u()[1] - p.input * -std::expm1(-(t - p.since) / p.lag)));
    if (p.input > 0. || t < p.jump) return;
    p.input = 10.;
    p.since = t;
    must(TSRestartStep(r.ts));
  };
  must(run.solve());
  return error;
}

} // namespace

/* Steps have become long while the system was at rest; the length of the first step after the restart must follow from
   the states */
TEST(FirstStep, StatesAfterARestart)
{
  for (bool guided : {false, true})
    for (double eps : {1e-3, 1e-4, 1e-6, 1e-8}) {
      const double error = errorOfSwitchedLag(SwitchedLag(guided, 1e-3), tolerance(eps));
      MEASURED("%s, %g: %.1e of 10", guided ? "guided" : "free", eps, error);
      EXPECT_LT(error, 8. * std::pow(eps, 2. / 3.)) << guided << " " << eps;
    }
}

/* Beside a mechanism at rest, whose accelerations are all rounding errors, steps are not treated as too short for the
   corrector: states must not be extrapolated by Taylor's series */
TEST(FirstStep, StatesBesideAMechanismAtRest)
{
  for (double eps : {1e-6, 1e-8, 1e-10}) {
    const double error = errorOfSwitchedLag(SwitchedLag(true, 0.), tolerance(eps));
    MEASURED("%g: %.1e of 10", eps, error);
    EXPECT_LT(error, 8. * std::pow(eps, 2. / 3.)) << eps;
  }
}

/* The error of states is about the same for every spectral radius */
TEST(FirstStep, StatesOfEveryRadius)
{
  PetscInt steps;
  double   first, least = 1., most = 0.;
  for (const char *radius : {"0", "0.10102", "0.3", "0.54", "0.8", "1"}) {
    const double error = errorOfFollower(Follower(1.), tolerance(1e-6) + "-ts_hhtdae_radius " + radius, 0, &steps, &first);
    MEASURED("radius %s: error %.1e in %d steps", radius, error, (int)steps);
    least = std::min(least, error);
    most  = std::max(most, error);
  }
  EXPECT_LT(most, 4. * least);
}

/* Steps after a restart are of second order, although s' changes the state by far more than the tolerance within one step */
TEST(BetweenRuns, RestartsOfStates)
{
  PetscInt steps;
  double   first;
  for (double eps : {1e-4, 1e-5, 1e-6, 1e-7}) {
    const double once = errorOfFollower(Follower(1.), tolerance(eps), 0, &steps, &first), often = errorOfFollower(Follower(1.), tolerance(eps), 10, &steps, &first);
    MEASURED("%g: error %.1e, with restarts %.1e", eps, once, often);
    EXPECT_LT(often, 1.5 * once) << eps;
  }
}
