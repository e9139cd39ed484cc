/*
  Joints, motions and primitive constraints between marker i (on the first body) and marker j (on the second). Every constraint is
  written so that its multipliers are forces and moments: lengths for positions, sines of angles for directions.

  "Rows" at an element are its multipliers in the order of Measure::multiplier(), from 0 on: forces and moments on i's body, whose opposites act
  on j's. "force x y z" are three rows, along the axes of space, "moment x_j y_j" two, about axes of marker j. Forces act at i's origin
  where nothing else is said. A row that was dropped as redundant has the multiplier 0. The same loads in the axes of any marker are
  Measure::jointForce() and jointMoment(), on either body and about any point elementForce(), elementMoment() and Snapshot::load().

  Planar scenes have Revolute, Translational and Fixed; Gear, RackAndPinion, Coupler, GearMesh and RackMesh; PointDistance and PointOnCurve;
  RollingDisc; UserConstraint; RotationalMotion and TranslationalMotion. All others are an error there. The z axes of all markers are normal to
  the plane: what turns about z_j in space does so in the plane, what moves along z_j in space moves along x_j.
*/
#ifndef HHTDAE_JOINTS_H
#define HHTDAE_JOINTS_H

#include "hhtdae/functions.h"
#include "hhtdae/types.h"

namespace hhtdae
{

/* ---- joints ---- */
struct Spherical { Marker i, j; };     /* origins coincide. Rows: force x y z */
struct Revolute { Marker i, j; };      /* and z axes are parallel. Rows: force x y z, moment x_j y_j (planar scenes: force x y) */
struct Universal { Marker i, j; };     /* origins coincide, z_i perpendicular to z_j. Rows: force x y z, moment about z_j x z_i */
/* Origins coincide, rotations about z_i and z_j are equal. Described with z_i and z_j more than 90 degrees apart, the axes are taken to point away from
   each other, and the rotations are opposite; which of the two it is stays so in the run, however far the shafts bend. Rows: force x y z, moment about z_j
   with the shafts in line; where they are bent by an angle b, the moment is cos(b/2) times the multiplier, about the axis halfway between them. */
struct ConstantVelocity { Marker i, j; };
struct Translational { Marker i, j; }; /* along z_j, no rotation. Rows: force x_j y_j, moment x_j y_j z_j (planar scenes: along x_j; force y_j, moment z) */
struct Cylindrical { Marker i, j; };   /* along and about z_j. Rows: force x_j y_j, moment x_j y_j */
struct Planar { Marker i, j; };        /* xy planes coincide. Rows: force z_j, moment x_j y_j */
struct Fixed { Marker i, j; };         /* no relative motion. Rows: force x y z, moment x_j y_j z_j (planar scenes: force x y, moment z) */
/* Cylindrical, pitch of advance along z_j per turn. Rows: force x_j y_j, moment x_j y_j, force z_j with a moment of -pitch/(2 pi) times that about z_j. */
struct Screw { Marker i, j; double pitch = 1; };
/*
  Couplers of joint motions, each given by its two markers: angle about z_j (revolute, cylindrical) or advance along z_j (planar
  scenes: x_j). They load the joints' own freedoms, a moment about z_j and a force along the advance, and nothing else: no bearing carries
  the force of teeth. The gears and racks after them act at the pitch point.

  Gear: angle_1 + ratio angle_2 = its value at the start. Row: moment on i1's body about z_j1; that on i2's body about z_j2 is ratio times it.
*/
struct Gear { Marker i1, j1, i2, j2; double ratio = 1; };
/* advance_2 - radius angle_1 = its value at the start. Row: force on i2's body along its advance; the moment on i1's body about z_j1 is -radius times it. */
struct RackAndPinion { Marker i1, j1, i2, j2; double radius = 1; };
/* sum of c_k s_k = its value at the start, c_k the factors. Row: c_k times the multiplier is the moment on the body of the k-th i about its z_j, or the force on
   it along its advance. */
struct Coupler {
  struct Term { Marker i, j; bool rotation = true; double factor = 1; };
  std::vector<Term> terms; /* two or three */
};

/*
  Teeth between two bodies on one carrier. The joints of the bodies on the carrier are given by their markers, j1 and j2 being on the
  carrier (or the ground) as `mesh` is: its origin is the pitch point, its z axis (planar scenes: x axis) the direction of the force
  of the teeth. Both bodies move alike there, along that direction, and push each other with a force through the pitch point, which
  their bearings carry. Radii, ratio, bevel and pressure angle follow from where the markers are; z_mesh along the common tangent of
  the pitch circles means teeth without pressure angle. Row: force on body 1 along z_mesh (planar scenes: x_mesh), at the pitch point; body 2 takes the
  opposite, the carrier nothing.
*/
struct GearMesh { Marker i1, j1, i2, j2, mesh; };  /* wheels on revolute or cylindrical joints, about z_j1 and z_j2 */
struct RackMesh { Marker i1, j1, i2, j2, mesh; };  /* wheel 1, and a rack 2 on a translational joint along z_j2 (planar scenes: x_j2) */

/* ---- primitives ---- */
struct InLine { Marker i, j; };         /* origin of i on the z axis of j. Rows: force x_j y_j */
struct InPlane { Marker i, j; };        /* origin of i in the xy plane of j. Row: force z_j */
struct ParallelAxes { Marker i, j; };   /* z axes. Rows: moment x_j y_j */
struct Perpendicular { Marker i, j; };  /* z axes. Row: moment about z_j x z_i */
/* All axes parallel, or two of them opposite; as described they stay. Axes that have changed places are an error, as those of Fixed and Translational are.
   Rows: moment x_j y_j z_j */
struct Orientation { Marker i, j; };
struct PointDistance { Marker i, j; double length = -1; }; /* negative: the distance at the start. Row: the tension, which pulls the origins together */
/* Origin of i on the curve (c_x(s), c_y(s), c_z(s)) in j's axes. Rows: force along two normals of the curve, perpendicular to each other, which turn about its
   tangent as little as can be (planar scenes: force along z x tangent, the tangent in the order of the points) */
struct PointOnCurve {
  Marker i, j;
  std::vector<Vector3> points;          /* interpolated by a twice continuously differentiable cubic spline over chord length */
  bool closed = false;                  /* an open curve goes on as a straight line beyond its ends */
};

/* ---- velocity-level (non-holonomic) ---- */
/* A disc about z_i through i's origin on the xy plane of j: its lowest point touches and does not slip. Rows: force normal to the plane, away from it
   on the side of the disc; friction x_j y_j; all at the lowest point (planar scenes: a wheel on the line along x_j; force y_j, friction x_j) */
struct RollingDisc {
  Marker i, j;
  double radius = 1;
};
struct RollingSphere { Marker i, j; double radius = 1; }; /* about i's origin on the xy plane of j. Rows: force z_j; friction x_j y_j where it touches */
struct KnifeEdge { Marker i, j; };      /* no velocity of i's origin along y_i; in the xy plane of j. Rows: force z_j, force y_i */

/*
  The user's own constraint: expressions that stay zero. A row reads displacements, distances, angles and time; or, at velocity level,
  velocities, rates and angular velocities as well, which it has to be linear in, and up to two states, or variables of positions, states
  and time; the factors of velocities may depend on positions and time, but not on states or variables. It may name six markers and read four
  angles. The load of a row on the bodies is its multiplier times the derivatives of the expression by positions (at velocity level, by velocities): where the
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
struct RotationalMotion { Marker i, j; TimeFunction function; MotionOf of = MotionOf::Displacement; }; /* about z_j. Row: moment of the drive about z_j */
/* Along an axis of j: 0, 1, 2 for x, y, z; 2 is that of Translational (planar scenes: 2 is x_j as well). Row: force of the drive along it */
struct TranslationalMotion { Marker i, j; TimeFunction function; MotionOf of = MotionOf::Displacement; int axis = 2; };

} // namespace hhtdae

#endif
