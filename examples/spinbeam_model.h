/*
  The beam on a hub of Simo and Vu-Quoc ("On the dynamics of flexible beams under large overall motions", 1986), spun up to 6 rad/s
  in 15 s, for a beam of any kind (beam_bodies.h).
*/
#ifndef HHTEX_SPINBEAM_MODEL_H
#define HHTEX_SPINBEAM_MODEL_H

#include "beam_bodies.h"

#include <cmath>
#include <string>

namespace hhtex
{

/* A square section with EA = 2.8e7, EI = 1.4e4 and mass 1.2 per length. nu = 0, because a clamped end would hinder lateral contraction; then
   G A_s is 1.17e7 instead of 1e7 as in the source, which changes the tip's deflection by 1e-5 of its value. */
inline SolidBeam SpinningArm()
{
  SolidBeam b;
  b.length = 10;
  b.depth = b.width  = std::sqrt(12 * 1.4e4 / 2.8e7);
  b.material.young   = 2.8e7 / b.area();
  b.material.density = 1.2 / b.area();
  b.n[0]             = 20;
  return b;
}

constexpr double spin_speed = 6, spin_ramp = 15; /* rad/s, s */

inline hhtdae::TimeFunction::Value SpinAngle(double t)
{
  const double w = 2 * PETSC_PI / spin_ramp;
  if (t > spin_ramp) return {spin_speed * (t - spin_ramp / 2), spin_speed, 0};
  return {spin_speed / spin_ramp * (t * t / 2 + (std::cos(w * t) - 1) / (w * w)),
          spin_speed / spin_ramp * (t - std::sin(w * t) / w), spin_speed / spin_ramp * (1 - std::cos(w * t))};
}

/* Adds the rotating hub, to which the root is fixed; channels x, y: position of the tip relative to the hub */
inline void SpinUp(hhtdae::Scene &scene, const BeamEnds &ends)
{
  using namespace hhtdae;
  const Body   hub  = scene.add("hub", RigidBody{});
  const Marker axis = scene.marker(hub), ground = scene.marker(scene.ground()), tip = scene.marker(ends.tip);
  scene.add("bearing", Revolute{axis, ground});
  scene.add("drive", RotationalMotion{axis, ground, TimeFunction::values(SpinAngle)});
  scene.add("clamp", Fixed{scene.marker(ends.root), axis});
  for (int k = 0; k < 2; k++) scene.channel(std::string(1, "xy"[k]), Measure::displacement(tip, k, axis, axis), "m");
}

} // namespace hhtex

#endif
