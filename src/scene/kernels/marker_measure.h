/* Measures of the motion of markers, for doubles and dual numbers. */
#ifndef HHTDAE_SCENE_KERNELS_MARKER_MEASURE_H
#define HHTDAE_SCENE_KERNELS_MARKER_MEASURE_H

#include "angle.h"
#include "hhtdae/functions.h"

namespace hhtdae
{

template <class T> struct MarkerMotion {
  Frame<T> f;
  Twist<T> w;
  Vec3<T>  a, alpha;
};

/* Moves m from the centre of mass of a body, at r, to a marker with the position s relative to it: sets m.f.x and changes
   m.w.v and m.a; space axes */
template <class T> void Attach(const Vec3<T> &r, const Vec3<T> &s, MarkerMotion<T> &m)
{
  const Vec3<T> ws = m.w.w.cross(s), wws = m.w.w.cross(ws), as = m.alpha.cross(s);
  m.f.x = r + s;
  m.w.v += ws;
  m.a += as + wws;
}

/* Component c of x in the axes of `frame`, or in space axes if it is null */
template <class T> T ComponentIn(const MarkerMotion<T> *frame, const Vec3<T> &x, int c)
{
  if (!frame) return x(c);
  const Vec3<T> axis = frame->f.R.col(c);
  return axis.dot(x);
}

template <class T> Vec3<T> Difference(const Vec3<T> &x, const Vec3<T> *y)
{
  if (!y) return x;
  return x - *y;
}

/* The value of a measure of markers. j and frame may be null; remembered: angle at the last accepted step, see UnwoundAngle() */
template <class T>
T MarkerMeasure(Measure::Kind kind, int component, double remembered, const MarkerMotion<T> &i, const MarkerMotion<T> *j,
                const MarkerMotion<T> *frame)
{
  using std::sqrt;
  const Vec3<T> d = Difference<T>(i.f.x, j ? &j->f.x : nullptr);
  switch (kind) {
  case Measure::Displacement:
    return ComponentIn<T>(frame, d, component);
  case Measure::Distance:
    return sqrt(d.dot(d));
  case Measure::Velocity:
    return ComponentIn<T>(frame, Difference<T>(i.w.v, j ? &j->w.v : nullptr), component);
  case Measure::Rate: {
    const Vec3<T> w  = i.w.v - j->w.v;
    const T       dw = d.dot(w), l = sqrt(d.dot(d));
    return l > 0 ? dw / l : T(0);
  }
  case Measure::Acceleration:
    return ComponentIn<T>(frame, Difference<T>(i.a, j ? &j->a : nullptr), component);
  case Measure::Angle:
    return UnwoundAngle<T>(i.f, j->f, remembered);
  case Measure::AngularVelocity:
    return ComponentIn<T>(frame, Difference<T>(i.w.w, j ? &j->w.w : nullptr), component);
  case Measure::AngularAcceleration:
    return ComponentIn<T>(frame, Difference<T>(i.alpha, j ? &j->alpha : nullptr), component);
  default:
    return T(0);
  }
}

} // namespace hhtdae

#endif
