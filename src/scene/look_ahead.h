/*
  Contacts within the next step. The error estimate sees forces at the ends of steps only: in free flight and uniform rotation it is zero, and a step would end
  behind a contact. So a step ends no later than in the part of a foreseen contact in which the bodies still approach, where the force then shows.

  Foreseen is what the accelerations at the beginning of the step lead to: bodies' centres move along parabolas and turn about a fixed axis. The time of
  touch is found by conservative advancement (Mirtich, Impulse-based Dynamic Simulation of Rigid Body Systems, thesis, Berkeley 1996): with a bound A of the
  second derivative of the gap g there is no contact before the root of g + g' t - A t^2/2.
*/
#ifndef HHTDAE_SCENE_LOOK_AHEAD_H
#define HHTDAE_SCENE_LOOK_AHEAD_H

#include "frames.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace hhtdae
{

/* The foreseen motion of a marker */
struct MarkerForecast {
  Frame<double> now;
  Vector3       arm;                            /* of the marker's origin from the body's centre */
  Vector3       center, velocity, acceleration; /* of the body's centre */
  Vector3       w, alpha;                       /* angular velocity and acceleration of the body */

  bool turns() const { return w.squaredNorm() > 0 || alpha.squaredNorm() > 0; }
  Frame<double> at(double t) const
  {
    Frame<double> f = now;
    f.x             = center + t * (velocity + 0.5 * t * acceleration) + arm;
    if (!turns()) return f;
    const Vector3 turn  = t * (w + 0.5 * t * alpha);
    const double  angle = turn.norm();
    if (!(angle > 0)) return f;
    const Matrix3 Q = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    f.x += Q * arm - arm;
    f.R = Q * now.R;
    return f;
  }
};

/* Bounds of a gap's rate at the beginning and of its second derivative; second = infinity: there is none, and the rate is a bound over the whole step */
struct GapBounds {
  double rate = 0, second = 0;
  double change(double t) const { return t * (std::isfinite(second) ? rate + 0.5 * second * t : rate); }
};

/* Of the distance between a surface of i, within `extent` of i's origin, and a surface of j, which turns with j if `with_axes` */
inline GapBounds BoundsOfDistance(const MarkerForecast &i, const MarkerForecast &j, double extent, bool with_axes, double horizon)
{
  const double  wi = i.w.norm() + horizon * i.alpha.norm(), wj = j.w.norm() + horizon * j.alpha.norm(), ai = wi * wi + i.alpha.norm(), aj = wj * wj + j.alpha.norm();
  const Vector3 approach = i.velocity + i.w.cross(i.arm) - j.velocity - j.w.cross(j.arm), pressing = i.acceleration - j.acceleration;
  const double  apart = with_axes ? (i.now.x - j.now.x).norm() : 0;
  GapBounds     b;
  b.rate   = approach.norm() + wi * extent + wj * apart;
  b.second = pressing.norm() + ai * (i.arm.norm() + extent) + aj * (j.arm.norm() + apart) + (with_axes ? 2 * wj * b.rate : 0);
  return b;
}

/* The step that is about to be taken, s, and a distance that does not count: a contact that turns the bodies back by less until the end of the step is passed over */
struct Horizon {
  double time, negligible;
};

/* The longest step, at most the horizon, for a gap as a function of the time since its beginning; the gap is negative where the bodies touch. deepest: largest
   penetration at its end */
template <class Gap> double LongestBeforeContact(const Gap &gap, const GapBounds &most, double deepest, const Horizon &h)
{
  constexpr int    advances  = 40;   /* after that many, as of a finger that turns fast close to a surface, the step ends */
  constexpr double close     = 1e-3; /* part of the first gap that counts as touch */
  constexpr double no_deeper = 1.5;  /* bodies in contact that get deeper by less than this factor rest on each other or vibrate */
  constexpr double shortest  = 1e-6; /* part of the horizon */
  const double     horizon   = h.time, begin = gap(0.), difference = 1e-6 * horizon;
  const auto       rate = [&](double at) { return (gap(at + difference) - gap(at)) / difference; };
  double           t = 0, g = begin;
  if (!std::isfinite(begin) || most.change(horizon) < (begin > 0 ? begin : (1 - no_deeper) * begin)) return horizon;
  for (int n = 0; g > close * begin && g > 0; n++) {
    const double r = rate(t), root = std::sqrt(r * r + 2 * most.second * g);
    t += !std::isfinite(most.second) ? g / most.rate : r < 0 ? 2 * g / (root - r) : most.second > 0 ? (r + root) / most.second : horizon;
    if (t >= horizon) return horizon;
    if (n == advances) return t;
    g = gap(t);
  }
  const double at_touch = rate(t);
  if (-2 * at_touch * (horizon - t) <= h.negligible) return horizon;
  if (begin < 0 && -at_touch * horizon + 0.5 * most.second * horizon * horizon < (1 - no_deeper) * begin) return horizon;
  double       depth = -g, reached = t;
  const double first = shortest * (horizon - t);
  for (double s = first;; s *= 2) {
    const double at = std::min(t + s, horizon), now = -gap(at);
    if (now < depth || now > deepest) return begin > 0 || depth > -no_deeper * begin ? std::max(reached, t + first) : horizon;
    if (at == horizon) return horizon;
    depth   = now;
    reached = at;
  }
}

} // namespace hhtdae

#endif
