/*
  Forces. Marker i is on the body that is acted on, marker j on the one that takes the reaction.
  `state = true` carries a force's components as force states F of the equations (7b) instead of eliminating them.

  "Components" at an element are what Measure::force() has of it, in that order, from 0 on. The same loads in the axes of any marker, about
  any point and on either body are Measure::elementForce(), elementMoment() and Snapshot::load().

  Planar scenes have all of them but TorusPlane, NodeContact and ModalLoad; the latter two are of flexible bodies. The z axes of all markers
  are normal to the plane there: what turns about z_j in space does so in the plane, translations are along x_j, the plane of a contact is the line
  along x_j, outside y > 0, and spheres, ellipsoids and boxes are discs, ellipses and rectangles. Components are as many as in space; those out of
  the plane act on nothing.
*/
#ifndef HHTDAE_FORCES_H
#define HHTDAE_FORCES_H

#include "hhtdae/functions.h"
#include "hhtdae/types.h"
#include <limits>

namespace hhtdae
{

/*
  Tension k (l - length) + c l' + preload along the line between the origins, positive when it pulls them together; l is
  their distance. Component: the tension. Free length zero is allowed: a force -k (x_i - x_j) in any direction. Without
  damping the element evaluates no velocities and its matrix is symmetric.
*/
struct SpringDamper {
  Marker i, j;
  double stiffness = 0;  /* k, force per length; not negative */
  double damping   = 0;  /* c, force per velocity; not negative */
  double length    = -1; /* free length; negative: the distance where bodies are described, before they are assembled */
  double preload   = 0;  /* tension at the free length */
  bool   state     = false;
};

/* Tension f(l, l'), the component, given by the user's function, differentiated automatically:
     [](const Real &l, const Real &v) { return 100 * pow(l - 1, 3) + 2 * v; } */
struct NonlinearSpring {
  Marker   i, j;
  ForceLaw tension; /* of length and rate */
  bool     state = false;
};

/*
  Moment preload - k (angle - free angle) - c angle' on i's body, about z_j, and its opposite on j's. The angle is that
  of i's x axis about z_j from j's x axis; it counts full turns, from the one in (-pi, pi] at the start. Steps of variable length are kept
  short enough for that; a step of fixed length (-ts_adapt_type none) that turns it by more than half a turn loses turns. Component: the
  moment. Meant for bodies that a joint holds together, with parallel z axes; where they are not parallel, the moment is
  about the gradient of the angle.
*/
struct TorsionalSpringDamper {
  Marker i, j;
  double stiffness = 0; /* k, moment per radian; not negative */
  double damping   = 0; /* c; not negative */
  double angle     = 0; /* free angle, rad; full turns count */
  double preload   = 0; /* moment on i's body at the free angle */
  bool   state     = false;
};

/* As above with a moment given by the user's function. Component: the moment. */
struct NonlinearTorsionalSpring {
  Marker   i, j;
  ForceLaw moment; /* of angle and rate, on i's body, about z_j; a restoring one is negative */
  bool     state = false;
};

/*
  Six springs and dampers in j's axes: for displacement d of i from j, rotation vector phi of i in j, and the relative
  velocity v and angular velocity w that an observer on j sees,

    force = f_0 - K d - C v,  moment = m_0 - K_t phi - C_t w    on i's body, about i's origin

  for small rotations; in general m_0 - K_t phi is multiplied by 1 + [phi]/2 + O(phi^2), which makes the bushing conservative: it has the potential
  d^T K d/2 - f_0 . d + phi^T K_t phi/2 - m_0 . phi. Along the axis of a rotation about one axis this changes nothing; a preload across it turns with phi.
  Rotations stay below half a turn. The reaction on j's body balances both. Components: force and moment on i in j's
  axes (planar scenes: x and y of forces, z of moments count).
*/
struct Bushing {
  Marker  i, j;
  Vector3 stiffness = Vector3::Zero(), torsional_stiffness = Vector3::Zero(); /* not negative */
  Vector3 damping = Vector3::Zero(), torsional_damping = Vector3::Zero();     /* not negative */
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero();                  /* preload f_0, m_0 */
  bool    state = false;
};

/*
  Timoshenko beam from j (at x = 0) to i (at x = length) along the x axes of the markers, without mass. It is linear in
  the mean frame of the two markers, which goes along with any motion of the whole; several in a row, with bodies
  between, bend far. Rotations of i against j stay below half a turn, beyond it the torque has the wrong sign.
  Free of force when both markers have the same axes and i is at (length, 0, 0) of j. Components:
  force and moment on i in the mean frame. Planar scenes need E, area and Izz alone.
*/
struct Beam {
  Marker i, j;
  double length = -1;              /* negative: the distance at the start */
  double E = 0, G = 0;             /* Young's modulus, shear modulus */
  double area = 0;                 /* of the cross section */
  double Iyy = 0, Izz = 0;         /* second moments of area: Iyy for bending in the xz plane, Izz in the xy plane */
  double J       = 0;              /* torsion constant */
  double shear_y = 0, shear_z = 0; /* shear areas along y and z; 0: no shear deformation (Euler and Bernoulli) */
  double damping = 0;              /* of the stiffness, a time: C = damping K in the mean frame */
  bool   state   = false;
};

/* The user's own: components as functions of the state, in the axes of `frame` (default: space axes); force and moment on i's body, at and about i's
   origin. Components: the three of the force, then the three of the moment, as far as they are given. */
struct UserForce {
  Marker                  i, j, frame;   /* j may be none: no reaction */
  std::vector<Expression> force, moment; /* none or three each */
  bool                    state = false;
};
/* a force along the line from j to i (repulsive when positive), or a moment about z_j on i's body. Component: its value */
struct UserScalarForce {
  Marker     i, j;
  Expression value;
  bool       rotational = false;
  bool       state      = false;
};

/* A load case of a flexible body (ModalBody::loads: pressure on a surface, nodal forces), times `scale`, in the axes of the
   body. Component: the scale. The resultant acts on the floating frame, the rest on the modes. */
struct ModalLoad {
  Body        body;
  std::string load;  /* its name */
  Expression  scale; /* of time or of the state */
  bool        state = false;
};

/*
  ---- contact: smooth penalty k d^exponent (1 + damping d'), never tensile, regularized Coulomb friction ----

  The factor s = 1 + damping d' ends smoothly: it is s for s >= 1/4, 0 for s <= -1/4, and in between u^3 (1 - u/2)/2 with u = 2 s + 1/2.

  Components: the force on i's body, normal force and friction together, in j's axes; of SphereSphere in space axes. It acts where the bodies touch.
*/
struct ContactLaw {
  double stiffness = 1e5, exponent = 1.5;
  double damping  = 0;                       /* s/m, of the rate of penetration; force never pulls */
  double friction = 0, slip_velocity = 1e-3; /* Coulomb coefficient, velocity of the regularization mu tanh(v/v_s) */
};
/* sphere about i, plane: xy of j, outside z > 0 (planar scenes: a disc on the line along x_j, outside y > 0) */
struct SpherePlane {
  Marker     i, j;
  double     radius = 1;
  ContactLaw law    = {};
  bool       state  = false;
};
/* ellipsoid about i in its axes, plane as above (planar scenes: an ellipse) */
struct EllipsoidPlane {
  Marker     i, j;
  Vector3    semiaxes = Vector3::Ones();
  ContactLaw law      = {};
  bool       state    = false;
};
/* tire: torus about z_i, plane as above (planar scenes: none; a wheel is a SpherePlane of the outer radius). A torus that lies flat has no lowest point: tilted
   by less than 1e-3 rad it presses as if it were lower, by 3.75e-4 of `radius` where it is not tilted at all. */
struct TorusPlane {
  Marker     i, j;
  double     radius = 1, tube = 0.1;
  ContactLaw law   = {};
  bool       state = false;
};
/* spheres about i and j; components in space axes (planar scenes: discs) */
struct SphereSphere {
  Marker     i, j;
  double     radius_i = 1, radius_j = 1;
  ContactLaw law   = {};
  bool       state = false;
};
/* sphere about i, box about j in its axes (planar scenes: disc and rectangle, half's z does not count) */
struct SphereBox {
  Marker     i, j;
  double     radius = 1;
  Vector3    half   = Vector3::Ones(); /* half of its edges */
  ContactLaw law   = {};
  bool       state = false;
};

/*
  Kept nodes of a flexible body (Scene::node()) as balls against one shape of another body: what one SpherePlane or SphereSphere for each node
  would do, but with a cost in proportion to the nodes that touch. The balls turn with the body's floating frame. Components: the
  resultant force on the flexible body in space axes.
*/
struct NodeContact {
  Body                  body;         /* the flexible one */
  std::vector<PetscInt> nodes  = {};  /* their numbers in the FE model; empty: all that are kept */
  double                radius = 0;   /* of the balls; with a plane it may be zero */
  Marker                j;            /* plane: xy of j, outside z > 0; or the centre of a sphere */
  double                radius_j = 0; /* of the sphere; 0: a plane */
  ContactLaw            law      = {};
};

/*
  Stops, the ends of a travel: nothing acts while the coordinate is between lower and upper, beyond them a force or moment of the
  contact law, which never pulls; its friction must be zero. Component: the force or moment on i's body along the growing coordinate;
  of a DistanceStop the tension.
*/
struct RotationalStop { /* of the angle of i's x axis about z_j, counted over full turns; law in moment and radians */
  Marker     i, j;
  double     lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  ContactLaw law   = {};
  bool       state = false;
};
struct TranslationalStop { /* of the displacement of i from j along an axis of j */
  Marker     i, j;
  double     lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  ContactLaw law   = {};
  int        axis  = 2; /* 0, 1, 2 for x, y, z; 2 is that of Translational (planar scenes: 2 is x_j as well) */
  bool       state = false;
};
struct DistanceStop { /* of the distance of the origins; with upper alone a rope */
  Marker     i, j;
  double     lower = 0, upper = std::numeric_limits<double>::infinity();
  ContactLaw law   = {};
  bool       state = false;
};

/* friction in a revolute, translational, cylindrical or spherical joint, from its reaction: moment mu r N or force mu N
   against the relative motion, regularized. Components, on i's body: revolute, the moment about z_j; translational, the force along z_j (planar scenes: x_j);
   cylindrical, both, the force first; spherical, the moment in space axes. Where redundant constraints are dropped, anywhere in the mechanism,
   reactions are one choice of many, which depends on how the mechanism is turned in space, and so does the friction: use joints that leave more freedom. */
struct JointFriction {
  Element joint;
  double  coefficient   = 0;
  double  radius        = 0; /* of the pin or ball; not used along a translation */
  double  slip_velocity = 1e-3;
};

} // namespace hhtdae

#endif
