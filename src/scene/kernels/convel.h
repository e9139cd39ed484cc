/*
  Equal rotations of two shafts about their z axes, the fourth row of a constant-velocity joint after three of coincidence. The rotation of i relative
  to j has no component along z_j, as in a coupling that is symmetric to the plane halfway between the shafts. For R =
  (axes of j)^T (axes of i), a rotation by b about the unit axis n, R - R^T = 2 sin(b) [n], so that

    (R_01 - R_10)/2 = (y_i . x_j - x_i . y_j)/2 = -sin(b) n_z = 0

  holds at all angles if two shafts bent by b rotate by the same angle: R = Rz(-phi) B Rz(phi), with B a rotation about an axis normal to
  z. If the z axes point away from each other (Opposite = true), the axes of i are first rotated by half a turn about x_i, which changes the sign of
  y_i.

  Multiplier: moment on i's body about z_j when the shafts are in line. If they are bent by b, the moment is lambda cos(b/2) about
  the axis halfway between z_i and z_j. The row is also satisfied with the shafts rotated by half a turn relative to each other; a joint stays on the
  branch on which it starts.
*/
#ifndef HHTDAE_SCENE_CONVEL_H
#define HHTDAE_SCENE_CONVEL_H

#include "primitives_axes.h"

namespace hhtdae
{

template <bool Opposite> struct EqualRotation : AxisProducts<EqualRotation<Opposite>, 1> {
  static constexpr const char *name       = "equal rotations";
  static constexpr AxisProduct products[] = {{0, 1, 0, Opposite ? -.5 : .5}, {0, 0, 1, -.5}};
};

} // namespace hhtdae

#endif
