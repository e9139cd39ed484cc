/*
  Joints, motions and primitive constraints between marker i (on the first body) and marker j (on the second). Every constraint is
  formulated so that its multipliers are forces and moments: position constraints in lengths, direction constraints in sines of angles.

  "Rows" in the comment on an element lists its multipliers in the order of Measure::multiplier(), counted from 0. They are forces and
  moments on i's body; the opposite ones act on j's body. "force x y z" means three rows, along the space axes; "moment x_j y_j" means two
  rows, about axes of marker j. Forces act at i's origin unless stated otherwise. A row that was dropped as redundant has the multiplier 0.
  Measure::jointForce() and jointMoment() give the same loads in the axes of any marker; elementForce(), elementMoment() and
  Snapshot::load() give them on either body and about any point.

  Planar scenes have Revolute, Translational and Fixed; Gear, RackAndPinion, Coupler, GearMesh and RackMesh; PointDistance and PointOnCurve;
  RollingDisc; UserConstraint; RotationalMotion and TranslationalMotion. All others are an error there. The z axes of all markers are normal
  to the plane. Rotations are about z_j, as in space; what moves along z_j in space moves along x_j in the plane.
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
/* Origins coincide, rotations about z_i and z_j are equal. If z_i and z_j are described more than 90 degrees apart, the axes count as
   pointing away from each other, and the rotations are opposite; this is decided at the start and does not change however far the shafts
   bend. Rows: force x y z, moment about z_j with the shafts in line. If the shafts are bent by an angle b, the moment is cos(b/2) times the
   multiplier, about the axis halfway between them. */
struct ConstantVelocity { Marker i, j; };
struct Translational { Marker i, j; }; /* along z_j, no rotation. Rows: force x_j y_j, moment x_j y_j z_j (planar scenes: along x_j; force y_j, moment z) */
struct Cylindrical { Marker i, j; };   /* along and about z_j. Rows: force x_j y_j, moment x_j y_j */
struct Planar { Marker i, j; };        /* xy planes coincide. Rows: force z_j, moment x_j y_j */
struct Fixed { Marker i, j; };         /* no relative motion. Rows: force x y z, moment x_j y_j z_j (planar scenes: force x y, moment z) */
/* Cylindrical, with an advance of `pitch` along z_j per turn. Rows: force x_j y_j, moment x_j y_j, force z_j, which comes with a moment about
   z_j of -pitch/(2 pi) times the force. */
struct Screw { Marker i, j; double pitch = 1; };
/*
  Couplers relate the motions of joints. Each joint is given by its two markers; its motion is the angle about z_j (revolute, cylindrical)
  or the advance along z_j (planar scenes: x_j). A coupler exerts only a moment about z_j or a force along the advance; bearings carry no
  tooth forces. GearMesh and RackMesh below act at the pitch point and load the bearings.

  Gear: angle_1 + ratio angle_2 keeps its value at the start. Row: moment on i1's body about z_j1; the moment on i2's body about z_j2 is
  ratio times as large.
*/
struct Gear { Marker i1, j1, i2, j2; double ratio = 1; };
/* advance_2 - radius angle_1 keeps its value at the start. Row: force on i2's body along its advance; the moment on i1's body about z_j1 is
   -radius times this force. */
struct RackAndPinion { Marker i1, j1, i2, j2; double radius = 1; };
/* The sum of factor_k s_k keeps its value at the start, with s_k the angle or advance of term k. Row: factor_k times the multiplier is the
   moment on the body of i of term k about its z_j, or the force along its advance. */
struct Coupler {
  struct Term { Marker i, j; bool rotation = true; double factor = 1; };
  std::vector<Term> terms; /* two or three */
};

/*
  Teeth between two bodies on one carrier. The joints of the bodies on the carrier are given by their markers; j1, j2 and `mesh` are on the
  carrier (or the ground). The origin of `mesh` is the pitch point, its z axis (planar scenes: x axis) the direction of the tooth force. At
  the pitch point both bodies have the same velocity along this direction, and they push each other with a force through it, which their
  bearings carry. Radii, ratio, bevel and pressure angle follow from the positions of the markers; z_mesh along the common tangent of the
  pitch circles means teeth without pressure angle. Row: force on body 1 along z_mesh (planar scenes: x_mesh), at the pitch point; the
  opposite force acts on body 2, none on the carrier.
*/
struct GearMesh { Marker i1, j1, i2, j2, mesh; };  /* wheels on revolute or cylindrical joints, about z_j1 and z_j2 */
struct RackMesh { Marker i1, j1, i2, j2, mesh; };  /* wheel 1, and a rack 2 on a translational joint along z_j2 (planar scenes: x_j2) */

/* ---- primitives ---- */
struct InLine { Marker i, j; };         /* origin of i on the z axis of j. Rows: force x_j y_j */
struct InPlane { Marker i, j; };        /* origin of i in the xy plane of j. Row: force z_j */
struct ParallelAxes { Marker i, j; };   /* z axes are parallel. Rows: moment x_j y_j */
struct Perpendicular { Marker i, j; };  /* z axes are perpendicular. Row: moment about z_j x z_i */
/* Each axis of i is parallel to the same axis of j; two of them may be opposite, and remain so if described so. Axes of i that are parallel
   to another axis of j are an error, as in Fixed and Translational. Rows: moment x_j y_j z_j */
struct Orientation { Marker i, j; };
struct PointDistance { Marker i, j; double length = -1; }; /* negative: the distance at the start, or where a continued run gets it. Row: the tension, which pulls the origins together */
/* Origin of i on the curve (c_x(s), c_y(s), c_z(s)) in j's axes. Rows: force along two normals of the curve, perpendicular to each other,
   which rotate about the tangent as little as possible (planar scenes: force along z x tangent, the tangent in the order of the points) */
struct PointOnCurve {
  Marker i, j;
  std::vector<Vector3> points;          /* interpolated by a twice continuously differentiable cubic spline over chord length */
  bool closed = false;                  /* an open curve continues as a straight line beyond its ends */
};

/* ---- velocity-level (non-holonomic) ---- */
/* A disc about z_i through i's origin rolls on the xy plane of j: its lowest point touches and does not slip. Rows, all at the lowest point:
   force normal to the plane, away from it on the side of the disc; friction x_j y_j (planar scenes: a wheel on the line along x_j; force y_j,
   friction x_j) */
struct RollingDisc {
  Marker i, j;
  double radius = 1;
};
/* A sphere about i's origin rolls on the xy plane of j. Rows: force z_j; friction x_j y_j at the contact */
struct RollingSphere { Marker i, j; double radius = 1; };
struct KnifeEdge { Marker i, j; };      /* i's origin stays in the xy plane of j and has no velocity along y_i. Rows: force z_j, force y_i */

/*
  The user's own constraint: every row is an expression that remains zero. At position level a row reads displacements, distances, angles
  and time. At velocity level it also reads velocities, rates and angular velocities, in which it must be linear, and up to two states or
  variables (of positions, states and time); the factors of velocities may depend on positions and time, but not on states or variables. A
  row may name six markers and read four angles. The load of a row on the bodies is its multiplier times the derivatives of the expression
  by positions (at velocity level: by velocities). If the expression is a displacement less a constant, the multiplier is the force on i's
  body along it. Measure::jointForce() gives the force on the body of the first marker, in the axes of the first marker on another body
  (default: space axes).

    scene.add("cam", UserConstraint{{Expression{{Measure::displacement(follower, 2), Measure::angle(shaft, bearing)},
                                                [=](const Real *m) { return m[0] - lift * (1 - cos(m[1])); }}}});
*/
struct UserConstraint {
  std::vector<Expression> rows;
};

/* ---- motions of i relative to j ---- */
enum class MotionOf { Displacement, Velocity, Acceleration };
struct RotationalMotion { Marker i, j; TimeFunction function; MotionOf of = MotionOf::Displacement; }; /* about z_j. Row: moment of the drive about z_j */
/* Along an axis of j: 0, 1, 2 for x, y, z. In planar scenes 2 is x_j as well, so that the default is always the axis of Translational.
   Row: force of the drive along the axis */
struct TranslationalMotion { Marker i, j; TimeFunction function; MotionOf of = MotionOf::Displacement; int axis = 2; };

} // namespace hhtdae

#endif
