"""Joints, motions and primitive constraints between marker i and marker j. Multipliers are forces and moments."""

from __future__ import annotations

from typing import Any, Callable, Sequence, Union

from .expressions import Expression, TimeFunction
from .spec import Formula, Number, Spec, Vector, _Joint, _expressions, _spec, plain
from .tracing import time_function

__all__ = ["Spherical", "Revolute", "Universal", "ConstantVelocity", "Translational", "Cylindrical", "Planar", "Fixed", "Screw", "Gear", "RackAndPinion",
           "Term", "Coupler", "GearMesh", "RackMesh", "InLine", "InPlane", "ParallelAxes", "Perpendicular", "Orientation", "PointDistance",
           "PointOnCurve", "RollingDisc", "RollingSphere", "KnifeEdge", "UserConstraint", "RotationalMotion", "TranslationalMotion"]

# ---- joints; planar scenes: Revolute, Translational, Fixed ----

@_spec
class Spherical(_Joint):
    """Origins coincide."""


@_spec
class Revolute(_Joint):
    """Origins coincide, z axes are parallel."""


@_spec
class Universal(_Joint):
    """Origins coincide, z_i is perpendicular to z_j."""


@_spec
class ConstantVelocity(_Joint):
    """Origins coincide, rotations about z_i and z_j are equal; opposite if they are described more than 90 degrees apart, which stays so in the run."""


@_spec
class Translational(_Joint):
    """Motion along z_j, no rotation."""


@_spec
class Cylindrical(_Joint):
    """Motion along and about z_j."""


@_spec
class Planar(_Joint):
    """xy planes coincide."""


@_spec
class Fixed(_Joint):
    """No relative motion."""


@_spec
class Screw(_Joint):
    """Motion along and about z_j, coupled.

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
    """Couples the angles of two joints: angle_1 + ratio angle_2 keeps its value at the start. Its torques are about the joints' axes; the forces of teeth, which
    bearings feel, are those of `GearMesh`."""
    ratio: Number = 1.


@_spec
class RackAndPinion(_Two):
    """Couples an advance with an angle: advance_2 - radius angle_1 keeps its value at the start. The force of the teeth acts along the axis of the advance, the torque about
    that of the angle; bearings feel those of `RackMesh`."""
    radius: Number = 1.


@_spec
class Term(Spec):
    """A joint's motion in a `Coupler`: angle about z_j, or advance along it, times a factor."""
    i: Any
    j: Any
    rotation: bool = True
    factor: Number = 1.


@_spec
class Coupler(Spec):
    """The sum of two or three terms keeps its value at the start."""
    terms: Sequence[Term]

    def _described(self, scene, who):
        self._check(who)
        return any([t._described(scene, "%s: term %d" % (who, k)) for k, t in enumerate(self.terms)])

    def _fields(self, converted):
        return {"terms": [t._fields({}) for t in self.terms]}


@_spec
class GearMesh(_Two):
    """Teeth between two wheels on one carrier; the marker `mesh` on the carrier is at the pitch point, its z axis (planar scenes: x axis) along the
    force of the teeth. Multiplier: the force on body 1 along it."""
    mesh: Any


@_spec
class RackMesh(_Two):
    """Teeth between wheel 1 and rack 2, which is on a translational joint along z_j2 (planar scenes: x_j2)."""
    mesh: Any


@_spec
class InLine(_Joint):
    """Origin of i on the z axis of j."""


@_spec
class InPlane(_Joint):
    """Origin of i in the xy plane of j."""


@_spec
class ParallelAxes(_Joint):
    """z axes are parallel."""


@_spec
class Perpendicular(_Joint):
    """z axes are perpendicular."""


@_spec
class Orientation(_Joint):
    """All axes are parallel."""


@_spec
class PointDistance(_Joint):
    """Origins at a constant distance.

    length : negative: the distance at the start"""
    length: Number = -1.


@_spec
class PointOnCurve(_Joint):
    """Origin of i on a curve in j's axes, a twice continuously differentiable spline through points.

    points : (n, 3)
    closed : bool; an open curve goes on as a straight line beyond its ends"""
    points: Sequence[Vector]
    closed: bool = False

    def _fields(self, converted):
        return dict(super()._fields(converted), points=[plain(p) for p in self.points])


@_spec
class RollingDisc(_Joint):
    """A disc about z_i rolls on the xy plane of j without slip.

    radius : length"""
    radius: Number = 1.


@_spec
class RollingSphere(_Joint):
    """A sphere about i's origin rolls on the xy plane of j without slip.

    radius : length"""
    radius: Number = 1.


@_spec
class KnifeEdge(_Joint):
    """No velocity of i's origin along y_i."""


@_spec
class UserConstraint(Spec):
    """Formulas that stay zero: of displacements, distances, angles and time, or of velocities too, in which they have to be linear."""
    rows: Sequence[Formula]
    _functions = {"rows": _expressions}


# ---- motions of i relative to j ----

@_spec
class RotationalMotion(Spec):
    """Prescribes the angle of i about z_j.

    function : of time: a number, a `TimeFunction`, a formula of time(), or a Python function of t, which is traced; radians
    of : "displacement", "velocity" or "acceleration": what the function is

    A velocity or acceleration that comes and goes while nothing else moves may lie between two steps, and what it leaves is lost: see `time`."""
    i: Any
    j: Any
    function: Union[float, TimeFunction, Expression, Callable]
    of: str = "displacement"
    _functions = {"function": time_function}


@_spec
class TranslationalMotion(Spec):
    """Prescribes the displacement of i along an axis of j.

    function : of time: a number, a `TimeFunction`, a formula of time(), or a Python function of t, which is traced; length
    of : "displacement", "velocity" or "acceleration": what the function is
    axis : 0, 1 or 2"""
    i: Any
    j: Any
    function: Union[float, TimeFunction, Expression, Callable]
    of: str = "displacement"
    axis: int = 2
    _functions = {"function": time_function}
