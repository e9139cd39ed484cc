"""Joints, motions and primitive constraints between marker i and marker j.

Multipliers are forces and moments on the body of marker i, listed by each class in the order of the rows. Forces act at i's origin unless stated
otherwise; the opposite loads act on j's body at the same point. x_j, y_j, z_j are the axes of marker j.

Planar scenes have Revolute, Translational, Fixed, Gear, RackAndPinion, Coupler, GearMesh, RackMesh, PointDistance, PointOnCurve, RollingDisc, UserConstraint and the
motions. There z is normal to the plane: joints and motions that advance along z_j in space advance along x_j, and rows out of the plane are omitted.
"""

from __future__ import annotations

from typing import Any, Callable, Sequence, Union

from .expressions import Expression, TimeFunction
from .spec import Formula, Number, Spec, Vector, _Joint, _expressions, _spec, plain
from .tracing import time_function

__all__ = ["Spherical", "Revolute", "Universal", "ConstantVelocity", "Translational", "Cylindrical", "Planar", "Fixed", "Screw", "Gear", "RackAndPinion",
           "Term", "Coupler", "GearMesh", "RackMesh", "InLine", "InPlane", "ParallelAxes", "Perpendicular", "Orientation", "PointDistance",
           "PointOnCurve", "RollingDisc", "RollingSphere", "KnifeEdge", "UserConstraint", "RotationalMotion", "TranslationalMotion"]

# ---- joints ----

@_spec
class Spherical(_Joint):
    """Origins coincide. Multipliers: force in space axes."""


@_spec
class Revolute(_Joint):
    """Origins coincide, z axes are parallel. Multipliers: force in space axes, then moment about x_j and y_j; planar scenes: force along x and y."""


@_spec
class Universal(_Joint):
    """Origins coincide, z_i is perpendicular to z_j. Multipliers: force in space axes, then moment about z_j x z_i."""


@_spec
class ConstantVelocity(_Joint):
    """Origins coincide, rotations about z_i and z_j are equal, or opposite if the described z axes enclose more than 90 degrees. Multipliers: force
    in space axes, then m. The moment is m cos(b / 2) about the axis halfway between z_i and z_j, with b their angle; if the shafts are in line it
    is m about z_j."""


@_spec
class Translational(_Joint):
    """Motion along z_j (planar scenes: x_j), no rotation. Multipliers: force along x_j and y_j, then moment about x_j, y_j and z_j; planar scenes: force along y_j,
    moment about z."""


@_spec
class Cylindrical(_Joint):
    """Motion along and about z_j. Multipliers: force along x_j and y_j, then moment about them."""


@_spec
class Planar(_Joint):
    """xy planes coincide. Multipliers: force along z_j, then moment about x_j and y_j."""


@_spec
class Fixed(_Joint):
    """No relative motion. Multipliers: force in space axes, then moment about x_j, y_j and z_j; planar scenes: force along x and y, moment about z."""


@_spec
class Screw(_Joint):
    """Motion along and about z_j, coupled. Multipliers: force along x_j and y_j, moment about them, force along z_j.

    pitch : advance per turn, length"""
    pitch: Number = 1.


@_spec
class _Two(Spec):
    i1: Any
    j1: Any
    i2: Any
    j2: Any


@_spec
class Gear(_Two):
    """Couples the angles of two joints: angle_1 + ratio angle_2 keeps its initial value (`Scene.run` says which one where a run continues). Its
    torques are about the joints' axes; for tooth forces, which load the bearings, use `GearMesh`. Multiplier: the moment on the body of i1 about
    z_j1; the moment on the body of i2 is ratio times as large."""
    ratio: Number = 1.


@_spec
class RackAndPinion(_Two):
    """Couples an advance along z_j2 (planar scenes: x_j2) with an angle about z_j1: advance_2 - radius angle_1 keeps its initial value. The force
    acts along the axis of the advance, the torque about the axis of the angle; for tooth forces, which load the bearings, use `RackMesh`.
    Multiplier: the force on the rack, the body of i2; the moment on the pinion, the body of i1, is -radius times it."""
    radius: Number = 1.


@_spec
class Term(Spec):
    """A joint's motion in a `Coupler`: angle about z_j, or advance along it (planar scenes: along x_j), times a factor."""
    i: Any
    j: Any
    rotation: bool = True
    factor: Number = 1.


@_spec
class Coupler(Spec):
    """The sum of two or three terms keeps its initial value. Multiplier: the load on the body of a term's marker i, a moment about z_j or a force
    along the advance, divided by the term's factor."""
    terms: Sequence[Term]

    def _described(self, scene, who):
        self._check(who)
        return any([t._described(scene, "%s: term %d" % (who, k)) for k, t in enumerate(self.terms)])

    def _fields(self, converted):
        return {"terms": [t._fields({}) for t in self.terms]}


@_spec
class GearMesh(_Two):
    """Teeth between two wheels on one carrier. The marker `mesh` on the carrier is at the pitch point, with its z axis (planar scenes: x axis)
    along the tooth force. Multiplier: the force on the body of i1 along this axis."""
    mesh: Any


@_spec
class RackMesh(_Two):
    """Teeth between wheel 1 and rack 2, which moves in a translational joint along z_j2 (planar scenes: x_j2); `mesh` and multiplier as in
    `GearMesh`."""
    mesh: Any


@_spec
class InLine(_Joint):
    """Origin of i on the z axis of j. Multipliers: force along x_j and y_j."""


@_spec
class InPlane(_Joint):
    """Origin of i in the xy plane of j. Multiplier: force along z_j."""


@_spec
class ParallelAxes(_Joint):
    """z axes are parallel. Multipliers: moment about x_j and y_j."""


@_spec
class Perpendicular(_Joint):
    """z axes are perpendicular. Multiplier: moment about z_j x z_i."""


@_spec
class Orientation(_Joint):
    """All axes are parallel. Multipliers: moment about x_j, y_j and z_j."""


@_spec
class PointDistance(_Joint):
    """Origins at a constant distance. Multiplier: the tension.

    length : negative: the distance at the start"""
    length: Number = -1.


@_spec
class PointOnCurve(_Joint):
    """Origin of i on a curve in j's axes, a twice continuously differentiable spline through points. Multipliers: force along the two normals of the curve;
    planar scenes: along z x tangent, the tangent in the direction of the points.

    points : (n, 3)
    closed : bool; an open curve is extended by straight lines beyond its ends"""
    points: Sequence[Vector]
    closed: bool = False

    def _fields(self, converted):
        return dict(super()._fields(converted), points=[plain(p) for p in self.points])


@_spec
class RollingDisc(_Joint):
    """A disc about z_i rolls on the xy plane of j without slip, on the side where it is at the start; planar scenes: on the line along x_j. Multipliers: force at the point of
    contact, along the normal away from the plane, then friction along x_j and y_j; planar scenes: along y_j, then friction along x_j.

    radius : length"""
    radius: Number = 1.


@_spec
class RollingSphere(_Joint):
    """A sphere about i's origin rolls on the xy plane of j without slip, on the side where it is at the start. Multipliers: force at the point of contact, along z_j, then
    friction along x_j and y_j.

    radius : length"""
    radius: Number = 1.


@_spec
class KnifeEdge(_Joint):
    """Origin of i in the xy plane of j, without velocity along y_i. Multipliers: force along z_j, force along y_i."""


@_spec
class UserConstraint(Spec):
    """Formulas that stay zero, of displacements, distances, angles and time, or also of velocities, in which they have to be linear. Multipliers:
    one for each row; the load on the bodies is the multiplier times the derivatives of the formula by positions, at velocity level by velocities.
    A row reads at most six markers and four angles, and, at velocity level, two variables and states, on which no load acts."""
    rows: Sequence[Formula]
    _functions = {"rows": _expressions}


# ---- motions of i relative to j ----

@_spec
class RotationalMotion(Spec):
    """Prescribes the angle of i's x axis about z_j, from j's. Multiplier: moment about z_j. It begins where the function says but for full turns: where `angle`, springs and stops
    of the same markers begin, in (-pi, pi], from where all count full turns.

    function : of time: a number, a `TimeFunction`, a formula of time(), or a Python function of t, which is traced; radians
    of : "displacement", "velocity" or "acceleration": what the function is

    A short pulse of velocity or acceleration while nothing else moves may lie between the ends of two steps and be missed: see `time`."""
    i: Any
    j: Any
    function: Union[float, TimeFunction, Expression, Callable]
    of: str = "displacement"
    _functions = {"function": time_function}


@_spec
class TranslationalMotion(Spec):
    """Prescribes the displacement of i along an axis of j. Multiplier: force along it.

    function : of time: a number, a `TimeFunction`, a formula of time(), or a Python function of t, which is traced; length
    of : "displacement", "velocity" or "acceleration": what the function is
    axis : 0, 1 or 2: x_j, y_j or z_j; in planar scenes the default is x_j, along which `Translational` is there"""
    i: Any
    j: Any
    function: Union[float, TimeFunction, Expression, Callable]
    of: str = "displacement"
    axis: int = 2
    _functions = {"function": time_function}
