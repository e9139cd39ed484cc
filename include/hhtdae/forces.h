/*
  Forces. Marker i is on the body that the force acts on, marker j on the body that the reaction acts on.
  `state = true` keeps a force's components as unknowns, force states F of the equations (7b), instead of eliminating them.

  "Components" in the comment on an element lists what Measure::force() returns, in this order, counted from 0. Measure::elementForce(),
  elementMoment() and Snapshot::load() give the same loads in the axes of any marker, about any point and on either body.

  Planar scenes have all of these forces except TorusPlane, NodeContact and ModalLoad; the latter two are of flexible bodies. The z axes of
  all markers are normal to the plane there. Rotations are about z_j, as in space; translations are along x_j. The plane of a contact is the
  line along x_j, with y > 0 outside, and spheres, ellipsoids and boxes are discs, ellipses and rectangles. There are as many components as
  in space; those out of the plane have no effect.
*/
#ifndef HHTDAE_FORCES_H
#define HHTDAE_FORCES_H

#include "hhtdae/functions.h"
#include "hhtdae/types.h"
#include <limits>

namespace hhtdae
{

/*
  Tension k (l - length) + c l' + preload along the line between the origins, with l their distance; a positive tension pulls them
  together. Component: the tension. A free length of zero is allowed: the force is -k (x_i - x_j) in any direction. Without damping the
  element evaluates no velocities, and its matrix is symmetric.
*/
struct SpringDamper {
  Marker i, j;
  double stiffness = 0;  /* k, force per length; not negative */
  double damping   = 0;  /* c, force per velocity; not negative */
  double length    = -1; /* free length; negative: the distance of the markers as described, before the assembly */
  double preload   = 0;  /* tension at the free length */
  bool   state     = false;
};

/* Tension f(l, l') given by the user's function, which is differentiated automatically. Component: the tension.
     [](const Real &l, const Real &v) { return 100 * pow(l - 1, 3) + 2 * v; } */
struct NonlinearSpring {
  Marker   i, j;
  ForceLaw tension; /* of length and rate */
  bool     state = false;
};

/*
  Moment preload - k (angle - free angle) - c angle' on i's body, about z_j, and its opposite on j's. The angle is that of i's x axis about
  z_j from j's x axis; it is in (-pi, pi] at the start and counts full turns from there. Adaptive steps are kept short enough for this count;
  a step of fixed length (-ts_adapt_type none) in which the angle changes by more than half a turn loses turns. Component: the moment.
  The element is meant for bodies that a joint holds together with parallel z axes; where the z axes are not parallel, the moment is about
  the gradient of the angle.
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
  Six springs and dampers in j's axes: for displacement d of i from j, rotation vector phi of i in j, and the velocity v and angular
  velocity w of i relative to j that an observer on j sees,

    force = f_0 - K d - C v,  moment = m_0 - K_t phi - C_t w    on i's body, about i's origin

  for small rotations. In general m_0 - K_t phi is multiplied by 1 + [phi]/2 + O(phi^2), which makes the bushing conservative, with the
  potential d^T K d/2 - f_0 . d + phi^T K_t phi/2 - m_0 . phi. For a rotation about one axis, the factor does not change moments about
  this axis; a preload perpendicular to it rotates with phi. Rotations must remain below half a turn. The reaction on j's body balances
  both. Components: force and moment on i in j's axes (planar scenes: only x and y of the force and z of the moment have an effect).
*/
struct Bushing {
  Marker  i, j;
  Vector3 stiffness = Vector3::Zero(), torsional_stiffness = Vector3::Zero(); /* not negative */
  Vector3 damping = Vector3::Zero(), torsional_damping = Vector3::Zero();     /* not negative */
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero();                  /* preload f_0, m_0 */
  bool    state = false;
};

/*
  Massless Timoshenko beam from j (at x = 0) to i (at x = length) along the x axes of the markers. It is linear in the mean frame of the two
  markers, which follows any rigid motion; large deflections need several beams in a row, with bodies between them. Rotations of i relative
  to j must remain below half a turn; beyond it the torque has the wrong sign. The beam is free of force when both markers have the same
  axes and i is at (length, 0, 0) of j. Components: force and moment on i in the mean frame. Planar scenes need only E, area and Izz.
*/
struct Beam {
  Marker i, j;
  double length = -1;              /* negative: the distance at the start */
  double E = 0, G = 0;             /* Young's modulus, shear modulus */
  double area = 0;                 /* of the cross section */
  double Iyy = 0, Izz = 0;         /* second moments of area: Iyy for bending in the xz plane, Izz in the xy plane */
  double J       = 0;              /* torsion constant */
  double shear_y = 0, shear_z = 0; /* shear areas along y and z; 0: no shear deformation (Euler and Bernoulli) */
  double damping = 0;              /* stiffness-proportional, in units of time: C = damping K in the mean frame */
  bool   state   = false;
};

/* The user's own force and moment on i's body, at and about i's origin: components as functions of the state, in the axes of `frame`
   (default: space axes). Components: the three of the force, then the three of the moment, as far as they are given. */
struct UserForce {
  Marker                  i, j, frame;   /* j may be none: no reaction */
  std::vector<Expression> force, moment; /* none or three each */
  bool                    state = false;
};
/* A force along the line from j to i (repulsive when positive) or, if `rotational`, a moment about z_j, on i's body. Component: its value */
struct UserScalarForce {
  Marker     i, j;
  Expression value;
  bool       rotational = false;
  bool       state      = false;
};

/* A load case of a flexible body (ModalBody::loads: pressure on a surface, nodal forces), multiplied by `scale`, in the axes of the body.
   Component: the scale. The resultant acts on the floating frame, the modal forces on the modes. */
struct ModalLoad {
  Body        body;
  std::string load;  /* name of the load case */
  Expression  scale; /* of time or of the state */
  bool        state = false;
};

/*
  ---- contact: smooth penalty k d^exponent (1 + damping d'), never tensile, regularized Coulomb friction ----

  The factor s = 1 + damping d' is cut off smoothly: it is s for s >= 1/4, 0 for s <= -1/4, and in between u^3 (1 - u/2)/2 with u = 2 s + 1/2.

  Adaptive steps end within contacts and stops that velocities and accelerations foresee, so that none is passed over that changes positions by
  more than the tolerance. NodeContact, user's forces and steps of fixed length have no such look-ahead: -ts_adapt_dt_max keeps their steps
  short. Within a contact only the error of positions chooses the steps: the speed after an elastic impact is right to 5 % if the tolerance is a
  hundredth of the penetration, and to some 50 % if it is a third (LookAhead.ElasticImpactsByTolerance). A tolerance near the penetration or above it lets impacts gain energy.

  Components: the force on i's body, normal force and friction together, in j's axes (SphereSphere: in space axes). It acts at the point of
  contact.
*/
struct ContactLaw {
  double stiffness = 1e5, exponent = 1.5;
  double damping  = 0;                       /* factor of the rate of penetration d', s/m */
  double friction = 0, slip_velocity = 1e-3; /* Coulomb coefficient mu, and v_s of the regularization mu tanh(v/v_s) */
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
/* tire: torus about z_i, plane as above (not in planar scenes; a wheel there is a SpherePlane of the outer radius). A torus that lies flat
   has no unique lowest point, so tilts below 1e-3 rad are regularized: the torus acts as if it were lower, by 3.75e-4 `radius` when flat. */
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
/* sphere about i, box about j in its axes (planar scenes: disc and rectangle, the z component of `half` is ignored) */
struct SphereBox {
  Marker     i, j;
  double     radius = 1;
  Vector3    half   = Vector3::Ones(); /* half edges of the box */
  ContactLaw law   = {};
  bool       state = false;
};

/*
  Contact of kept nodes of a flexible body (Scene::node()), as balls, with one shape of another body. The effect is that of one SpherePlane
  or SphereSphere for each node, but the cost is proportional to the number of nodes that touch. The balls rotate with the body's floating
  frame. Components: the resultant force on the flexible body in space axes.
*/
struct NodeContact {
  Body                  body;         /* the flexible one */
  std::vector<PetscInt> nodes  = {};  /* labels of the nodes in the FE model; empty: all kept nodes */
  double                radius = 0;   /* of the balls; with a plane it may be zero */
  Marker                j;            /* plane: xy of j, outside z > 0; or sphere about the origin of j */
  double                radius_j = 0; /* of the sphere; 0: a plane */
  ContactLaw            law      = {};
};

/*
  Stops limit a travel. No force acts while the coordinate is between `lower` and `upper`; beyond them the contact law gives a force or
  moment, which never pulls. The law's friction must be zero. Component: the force or moment on i's body in the direction of increasing
  coordinate; for a DistanceStop the tension.
*/
struct RotationalStop { /* of the angle of i's x axis about z_j, counted over full turns; the contact law is in moments and radians */
  Marker     i, j;
  double     lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  ContactLaw law   = {};
  bool       state = false;
};
struct TranslationalStop { /* of the displacement of i from j along an axis of j */
  Marker     i, j;
  double     lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
  ContactLaw law   = {};
  int        axis  = 2; /* 0, 1, 2 for x, y, z; in planar scenes 2 is x_j as well, the axis of Translational there */
  bool       state = false;
};
struct DistanceStop { /* of the distance of the origins; with `upper` only: a rope */
  Marker     i, j;
  double     lower = 0, upper = std::numeric_limits<double>::infinity();
  ContactLaw law   = {};
  bool       state = false;
};

/* Friction in a revolute, translational, cylindrical or spherical joint, from its reaction N: moment mu r N or force mu N against the
   relative motion, regularized. Components, on i's body: revolute, the moment about z_j; translational, the force along z_j (planar scenes:
   x_j); cylindrical, both, the force first; spherical, the moment in space axes. If redundant constraints are dropped anywhere in the
   mechanism, reactions are not unique: which ones are found depends on the orientation of the mechanism in space, and so does the friction.
   Use joints with more degrees of freedom there. */
struct JointFriction {
  Element joint;
  double  coefficient   = 0;
  double  radius        = 0; /* of the pin or ball; not used along a translation */
  double  slip_velocity = 1e-3;
};

} // namespace hhtdae

#endif
