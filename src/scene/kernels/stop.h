/*
  Stops of an angle, an advance or a distance s. Beyond the limits of s the force is that of contact_law.h, without friction,
  with the penetration lower - s or s - upper. The component is the moment or force in the direction of increasing s, for a
  distance the tension. Within the limits it is zero, and only s is evaluated, with plain numbers.
*/
#ifndef HHTDAE_SCENE_KERNELS_STOP_H
#define HHTDAE_SCENE_KERNELS_STOP_H

#include "contact_law.h"
#include "scene/look_ahead.h"
#include "spring_torsion.h"

namespace hhtdae
{

struct StopData {
  double         memory[1]; /* the angle at the last accepted step; unused for an advance or a distance */
  double         lower, upper;
  ContactLaw     law;
  int            axis;

  bool   free(double s) const { return s >= lower && s <= upper; }
  double depth(double s) const { return s < lower ? lower - s : s - upper; }
  double gap(double s) const { return std::min(s - lower, upper - s); }
};

/* Force or moment in the direction of increasing s */
template <class T> T StopForce(const StopData &d, const T &s, const T &rate)
{
  if (d.free(Plain(s))) return T(0);
  const bool low     = Plain(s) < d.lower;
  const T    depth   = low ? T(d.lower) - s : s - T(d.upper);
  const T    damping = SmoothRamp<T>(low ? T(1) - T(d.law.damping) * rate : T(1) + T(d.law.damping) * rate);
  const T    force   = ElasticForce<T>(d.law, depth) * damping;
  return low ? force : T(0) - force;
}

inline double StopEnergy(const StopData &d, double s) { return d.free(s) ? 0 : ElasticEnergy(d.law, d.depth(s)); }

/* The force, with derivatives by s and its rate */
inline Dual<2> StopDerivatives(const StopData &d, double s, double rate) { return StopForce<Dual<2>>(d, Dual<2>(s, 0), Dual<2>(rate, 1)); }

template <int Z> void NoForce(Wrench<double> *on, ForceJacobian<2, Z> &J)
{
  J.frames.setZero();
  J.twists.setZero();
  for (int k = 0; k < 2; k++) on[k] = {Vec3<double>::Zero(), Vec3<double>::Zero()};
}

struct TurnStop : TurnForce<TurnStop> {
  static constexpr const char *name = "rotational stop";
  using Data                        = StopData;

  template <class T> static void components(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    c[0] = StopForce<T>(d, UnwoundAngle<T>(f[0], f[1], d.memory[0]), AngleRate<T>(f[0], f[1], w[0], w[1]));
  }
  /* Look-ahead, batch.h; TurnForce::longestStep() keeps a step below half a turn */
  static double    gap(const Data &d, const Frame<double> *f) { return d.gap(UnwoundAngle<double>(f[0], f[1], d.memory[0])); }
  static GapBounds gapBounds(const Data &, const MarkerForecast *m, double)
  {
    return {(m[0].w - m[1].w).norm(), m[0].alpha.norm() + m[1].alpha.norm() + m[0].w.cross(m[1].w).norm()};
  }
  static double deepest(const Data &) { return std::numeric_limits<double>::infinity(); }
  static double energy(const Data &d, const Frame<double> *f) { return StopEnergy(d, UnwoundAngle<double>(f[0], f[1], d.memory[0])); }

  template <int Z>
  static void jacobian(const Data &d, const Frame<double> *f, const Twist<double> *w, double, const double *, Wrench<double> *on,
                       ForceJacobian<2, Z> &J)
  {
    const double angle = UnwoundAngle<double>(f[0], f[1], d.memory[0]);
    if (d.free(angle)) return NoForce(on, J);
    const Dual<2> M     = StopDerivatives(d, angle, AngleRate<double>(f[0], f[1], w[0], w[1]));
    const double  value = M.value();
    apply<double>(d, f, &value, on);
    spread(value, M.derivatives()(0), M.derivatives()(1), f, w, J.frames, J.twists);
  }
};

/* Stop of an advance. The reaction acts on j's body at i's origin. */
struct AdvanceStop : Force<AdvanceStop, 2, 1> {
  static constexpr const char *name    = "translational stop";
  using Base                           = Force<AdvanceStop, 2, 1>;
  using Data                           = StopData;
  static constexpr unsigned    depends = Position(0) | Position(1) | Rotation(1), acts = depends;

  template <class T> static void components(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    c[0] = StopForce<T>(d, Advance<T>(f[0], f[1], d.axis), AdvanceRate<T>(f[0], f[1], w[0], w[1], d.axis));
  }
  static double    gap(const Data &d, const Frame<double> *f) { return d.gap(Advance<double>(f[0], f[1], d.axis)); }
  static GapBounds gapBounds(const Data &, const MarkerForecast *m, double horizon) { return BoundsOfDistance(m[0], m[1], 0, true, horizon); }
  static double    deepest(const Data &) { return std::numeric_limits<double>::infinity(); }
  template <class T> static void apply(const Data &d, const Frame<T> *f, const T *c, Wrench<T> *on)
  {
    const Vec3<T> force = f[1].R.col(d.axis) * c[0], arm = f[0].x - f[1].x;
    on[0] = {force, Vec3<T>(T(0), T(0), T(0))};
    on[1] = {-force, force.cross(arm)};
  }
  static double energy(const Data &d, const Frame<double> *f) { return StopEnergy(d, Advance<double>(f[0], f[1], d.axis)); }

  template <int Z>
  static void jacobian(const Data &d, const Frame<double> *f, const Twist<double> *w, double t, const double *z, Wrench<double> *on,
                       ForceJacobian<2, Z> &J)
  {
    if (d.free(Advance<double>(f[0], f[1], d.axis))) return NoForce(on, J);
    Base::jacobian(d, f, w, t, z, on, J);
  }
};

struct LengthStop : LineForce<LengthStop> {
  static constexpr const char *name = "distance stop";
  using Base                        = Force<LengthStop, 2, 1>;
  using Data                        = StopData;

  template <class T> static void components(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &, const T *, T *c)
  {
    const Line<T> line(f);
    c[0] = T(0) - StopForce<T>(d, line.length, line.rate(w));
  }
  /* The second derivative of a distance has no bound where it is short */
  static double    gap(const Data &d, const Frame<double> *f) { return d.gap(Line<double>(f).length); }
  static GapBounds gapBounds(const Data &, const MarkerForecast *m, double horizon)
  {
    const GapBounds b = BoundsOfDistance(m[0], m[1], 0, false, horizon);
    return {b.rate + horizon * b.second, std::numeric_limits<double>::infinity()};
  }
  static double deepest(const Data &) { return std::numeric_limits<double>::infinity(); }
  static double energy(const Data &d, const Frame<double> *f) { return StopEnergy(d, Line<double>(f).length); }

  /* A lower limit of a distance acts like two balls, which must not pass through each other in a step (Stops.NothingFliesThroughALeastDistance). */
  static double longestStep(const Data &d, const Frame<double> *f, const Twist<double> *w, double acceleration, double)
  {
    const Line<double> line(f);
    return d.lower > 0 ? LongestApproach(0.25 * d.lower, d.lower - line.length, -line.rate(w), acceleration) : std::numeric_limits<double>::infinity();
  }

  template <int Z>
  static void jacobian(const Data &d, const Frame<double> *f, const Twist<double> *w, double t, const double *z, Wrench<double> *on,
                       ForceJacobian<2, Z> &J)
  {
    if (d.free(Line<double>(f).length)) return NoForce(on, J);
    Base::jacobian(d, f, w, t, z, on, J);
  }
};

} // namespace hhtdae

#endif
