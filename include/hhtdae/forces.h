/*
  Forces. Marker i is on the body that is acted on, marker j on the one that takes the reaction.
  `state = true` carries a force's components as force states F of the equations (7b) instead of eliminating them.
*/
#ifndef HHTDAE_FORCES_H
#define HHTDAE_FORCES_H

#include "hhtdae/functions.h"
#include "hhtdae/types.h"
#include <limits>

namespace hhtdae
{

/* ---- springs and dampers: tension k (l - length) + c l' + preload along the line between the origins ---- */
struct SpringDamper {
  Marker i, j;
  double stiffness = 0, damping = 0;
  double length  = -1; /* free length; negative: the distance at the start */
  double preload = 0;
  bool   state   = false;
};
/* tension f(l, l') given by the user's function of two numbers */
struct NonlinearSpring {
  Marker i, j;
  std::function<Real(const Real &length, const Real &rate)> tension;
  bool state = false;
};
/* moment -k (angle - free angle) - c angle' on i's body about z_j; the angle counts full turns */
struct TorsionalSpringDamper {
  Marker i, j;
  double stiffness = 0, damping = 0, angle = 0, preload = 0;
  bool   state = false;
};
struct NonlinearTorsionalSpring {
  Marker i, j;
  std::function<Real(const Real &angle, const Real &rate)> moment; /* on i's body, about z_j */
  bool state = false;
};
/* six components in j's axes from displacement and small rotation (3-2-1-free vector of rotation) of i in j: f = f0 - K u - C u' */
struct Bushing {
  Marker i, j;
  Vector3 stiffness = Vector3::Zero(), torsional_stiffness = Vector3::Zero();
  Vector3 damping = Vector3::Zero(), torsional_damping = Vector3::Zero();
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero(); /* preload */
  bool    state = false;
};
/* Timoshenko beam from j (at x = 0) to i (at x = length) along the x axes of the markers */
struct Beam {
  Marker i, j;
  double length = -1; /* negative: the distance at the start */
  double E = 0, G = 0, area = 0, Iyy = 0, Izz = 0, J = 0;
  double shear_y = 0, shear_z = 0; /* shear areas; 0: Euler-Bernoulli */
  double damping = 0;              /* of the stiffness: C = damping K */
  bool   state = false;
};

/* ---- the user's own: components as functions of the state, in the axes of `frame` (default: i's body stays, space axes) ---- */
struct UserForce {
  Marker i, j, frame;                /* j may be none: no reaction */
  std::vector<Expression> force, moment; /* none or three each */
  bool state = false;
};
/* a force along the line from j to i (repulsive when positive), or a moment about z_j on i's body */
struct UserScalarForce {
  Marker i, j;
  Expression value;
  bool rotational = false;
  bool state = false;
};

/* ---- contact: smooth penalty k d^exponent (1 + damping d'), never tensile, regularized Coulomb friction ---- */
struct ContactLaw {
  double stiffness = 1e5, exponent = 1.5;
  double damping = 0;              /* s/m, of the rate of penetration; force never pulls */
  double friction = 0, slip_velocity = 1e-3; /* Coulomb coefficient, velocity of the regularization mu tanh(v/v_s) */
};
struct SpherePlane { Marker i, j; double radius = 1; ContactLaw law; bool state = false; };       /* sphere at i, plane: xy of j, outside z > 0 */
struct EllipsoidPlane { Marker i, j; Vector3 semiaxes = Vector3::Ones(); ContactLaw law; bool state = false; };
struct TorusPlane { Marker i, j; double radius = 1, tube = 0.1; ContactLaw law; bool state = false; }; /* tire: torus about z_i */
struct SphereSphere { Marker i, j; double radius_i = 1, radius_j = 1; ContactLaw law; bool state = false; };
struct SphereBox { Marker i, j; double radius = 1; Vector3 half = Vector3::Ones(); ContactLaw law; bool state = false; }; /* box at j */

/* friction in a revolute, translational, cylindrical or spherical joint, from its reaction: moment mu r N or force mu N against the
   relative motion, regularized */
struct JointFriction {
  Element joint;
  double coefficient = 0;
  double radius      = 0; /* of the pin or ball; not used along a translation */
  double slip_velocity = 1e-3;
};

} // namespace hhtdae

#endif
