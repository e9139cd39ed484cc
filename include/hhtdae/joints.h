/*
  Joints, motions and primitive constraints between marker i (on the first body) and marker j (on the second). Every constraint is
  written so that its multipliers are forces and moments: lengths for positions, sines of angles for directions.
*/
#ifndef HHTDAE_JOINTS_H
#define HHTDAE_JOINTS_H

#include "hhtdae/functions.h"
#include "hhtdae/types.h"

namespace hhtdae
{

/* ---- joints; planar scenes: revolute, translational, fixed ---- */
struct Spherical { Marker i, j; };      /* origins coincide */
struct Revolute { Marker i, j; };       /* and z axes are parallel */
struct Universal { Marker i, j; };      /* origins coincide, z_i perpendicular to z_j */
/* Origins coincide, rotations about z_i and z_j are equal. Described with z_i and z_j more than 90 degrees apart, the axes are taken to point away from
   each other, and the rotations are opposite; which of the two it is stays so in the run, however far the shafts bend. */
struct ConstantVelocity { Marker i, j; };
struct Translational { Marker i, j; };  /* along z_j, no rotation */
struct Cylindrical { Marker i, j; };    /* along and about z_j */
struct Planar { Marker i, j; };         /* xy planes coincide */
struct Fixed { Marker i, j; };
struct Screw { Marker i, j; double pitch = 1; }; /* cylindrical, pitch of advance along z_j per turn */
/*
  Couplers of joint motions, each given by its two markers: angle about z_j (revolute, cylindrical) or advance along z_j. They load
  the joints' own freedoms, a moment about z_j and a force along it, and nothing else: no bearing carries the force of teeth. The
  gears and racks after them act at the pitch point.
*/
struct Gear { Marker i1, j1, i2, j2; double ratio = 1; };          /* angle_1 + ratio angle_2 = its value at the start */
struct RackAndPinion { Marker i1, j1, i2, j2; double radius = 1; }; /* advance_2 - radius angle_1 = its value at the start */
struct Coupler {                                                   /* sum of c_k s_k = its value at the start */
  struct Term { Marker i, j; bool rotation = true; double factor = 1; };
  std::vector<Term> terms; /* two or three */
};

/*
  Teeth between two bodies on one carrier. The joints of the bodies on the carrier are given by their markers, j1 and j2 being on the
  carrier (or the ground) as `mesh` is: its origin is the pitch point, its z axis (planar scenes: x axis) the direction of the force
  of the teeth. Both bodies move alike there, along that direction, and push each other with a force through the pitch point, which
  their bearings carry. Radii, ratio, bevel and pressure angle follow from where the markers are; z_mesh along the common tangent of
  the pitch circles means teeth without pressure angle. Multiplier: force on body 1 along z_mesh.
*/
struct GearMesh { Marker i1, j1, i2, j2, mesh; };  /* wheels on revolute or cylindrical joints, about z_j1 and z_j2 */
struct RackMesh { Marker i1, j1, i2, j2, mesh; };  /* wheel 1, and a rack 2 on a translational joint along z_j2 (planar: x_j2) */

/* ---- primitives ---- */
struct InLine { Marker i, j; };         /* origin of i on the z axis of j */
struct InPlane { Marker i, j; };        /* origin of i in the xy plane of j */
struct ParallelAxes { Marker i, j; };   /* z axes */
struct Perpendicular { Marker i, j; };  /* z axes */
struct Orientation { Marker i, j; };    /* all axes parallel */
struct PointDistance { Marker i, j; double length = -1; }; /* negative: the distance at the start */
struct PointOnCurve {                   /* origin of i on the curve (c_x(s), c_y(s), c_z(s)) in j's axes */
  Marker i, j;
  std::vector<Vector3> points;          /* interpolated by a twice continuously differentiable cubic spline over chord length */
  bool closed = false;                  /* an open curve goes on as a straight line beyond its ends */
};

/* ---- velocity-level (non-holonomic) ---- */
struct RollingDisc { /* a disc about z_i through i's origin on the xy plane of j: its lowest point touches and does not slip */
  Marker i, j;
  double radius = 1;
};
struct RollingSphere { Marker i, j; double radius = 1; }; /* about i's origin on the xy plane of j */
struct KnifeEdge { Marker i, j; };      /* no velocity of i's origin along y_i; in the xy plane of j */

/*
  The user's own constraint: expressions that stay zero. A row reads displacements, distances, angles and time; or, at velocity level,
  velocities, rates and angular velocities as well, which it has to be linear in, and up to two states, or variables of positions, states
  and time; the factors of velocities may depend on positions and time, but not on states or variables. It may name six markers. The load of a
  row on the bodies is its multiplier times the derivatives of the expression by positions (at velocity level, by velocities): where the
  expression is a displacement less a constant, the force on i's body along it. Joint forces as measures are those on the body of the first
  marker, in the axes of the first marker on another body (default: space axes).

    scene.add("cam", UserConstraint{{Expression{{Measure::displacement(follower, 2), Measure::angle(shaft, bearing)},
                                                [=](const Real *m) { return m[0] - lift * (1 - cos(m[1])); }}}});
*/
struct UserConstraint {
  std::vector<Expression> rows;
};

/* ---- motions of i relative to j ---- */
enum class MotionOf { Displacement, Velocity, Acceleration };
struct RotationalMotion { Marker i, j; TimeFunction function; MotionOf of = MotionOf::Displacement; }; /* about z_j */
struct TranslationalMotion { Marker i, j; TimeFunction function; MotionOf of = MotionOf::Displacement; int axis = 2; }; /* along an axis of j */

} // namespace hhtdae

#endif
