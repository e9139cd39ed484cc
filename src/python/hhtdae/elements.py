"""Joints, motions and forces: what `Scene.add` takes beside bodies.

Marker i is on the body that is acted on, marker j on the one that takes the reaction. Any number may be a `Parameter` or a formula of parameters;
then the element is described anew for every run. `state=True` carries a force's components as unknowns of the equations.
"""

from dataclasses import dataclass, field, fields
from math import inf
from typing import Any, Callable, Optional, Sequence, Tuple, Union

import numpy as np

from .expressions import Expression, TimeFunction
from .measures import description
from .tracing import compile_tape, time_function, trace

Number = Union[float, Expression]
Vector = Sequence[float]
Formula = Union[float, Expression]
Law = Callable[[Expression, Expression], Expression]


def _zero():
    return field(default=(0., 0., 0.))


def has_formula(x):
    """Whether a number, or one of an array, is a formula"""
    if isinstance(x, Expression):
        return True
    if isinstance(x, (tuple, list)):
        return any(has_formula(y) for y in x)
    return isinstance(x, np.ndarray) and x.dtype == object and any(has_formula(y) for y in x.flat)


def plain(x):
    """The same with the present values of formulas"""
    if isinstance(x, Expression):
        return float(x)
    if isinstance(x, (tuple, list)):
        return [plain(y) for y in x]
    if isinstance(x, np.ndarray) and x.dtype == object:
        return [plain(y) for y in x]
    return x


def _law(f, keep):
    return compile_tape([trace(f, 2, "a force law")], {}, keep, 2)


class Spec:
    """What elements share: their fields for the C++ part"""

    _functions = {}  # fields that are functions: how they are converted

    def _convert(self, keep):
        """The functions, once"""
        converted = {}
        for name, how in self._functions.items():
            x = getattr(self, name)
            if x is not None:
                converted[name] = how(x, keep)
        return converted

    def _numbers(self):
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in self._functions}

    def _described(self):
        """Whether it depends on parameters"""
        return any(has_formula(x) or (isinstance(x, Spec) and x._described()) for x in self._numbers().values())

    def _fields(self, converted):
        out = dict(converted)
        for name, x in self._numbers().items():
            out[name] = x._fields({}) if isinstance(x, Spec) else x if hasattr(x, "_id") else plain(x)
        return out


def _expressions(many, keep):
    return [description(x, keep) for x in many]


def _spec(cls):
    return dataclass(eq=False)(cls)


# ---- joints; planar scenes: Revolute, Translational, Fixed ----

@_spec
class _Joint(Spec):
    i: Any
    j: Any


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
    """Origins coincide, rotations about z_i and z_j are equal."""


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
    """Cylindrical, with `pitch` of advance along z_j per turn."""
    pitch: Number = 1.


@_spec
class _Two(Spec):
    i1: Any
    j1: Any
    i2: Any
    j2: Any


@_spec
class Gear(_Two):
    """Couples the angles of two joints: angle_1 + ratio angle_2 keeps its value at the start."""
    ratio: Number = 1.


@_spec
class RackAndPinion(_Two):
    """Couples an advance with an angle: advance_2 - radius angle_1 keeps its value at the start."""
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

    def _described(self):
        return any(t._described() for t in self.terms)

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
    """Origins at a constant distance; negative: the distance at the start."""
    length: Number = -1.


@_spec
class PointOnCurve(_Joint):
    """Origin of i on a curve in j's axes, a twice continuously differentiable spline through `points` (n x 3)."""
    points: Any
    closed: bool = False

    def _fields(self, converted):
        return dict(super()._fields(converted), points=[plain(p) for p in self.points])


@_spec
class RollingDisc(_Joint):
    """A disc about z_i rolls on the xy plane of j without slip."""
    radius: Number = 1.


@_spec
class RollingSphere(_Joint):
    """A sphere about i's origin rolls on the xy plane of j without slip."""
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
    """Angle about z_j (`of="displacement"`), or its first or second derivative ("velocity", "acceleration"), as a function of time."""
    i: Any
    j: Any
    function: Union[float, TimeFunction, Expression, Callable]
    of: str = "displacement"
    _functions = {"function": time_function}


@_spec
class TranslationalMotion(Spec):
    """Displacement along an axis of j, or its first or second derivative, as a function of time."""
    i: Any
    j: Any
    function: Union[float, TimeFunction, Expression, Callable]
    of: str = "displacement"
    axis: int = 2
    _functions = {"function": time_function}


# ---- forces ----

@_spec
class SpringDamper(_Joint):
    """Tension stiffness (l - length) + damping l' + preload along the line of the origins. Component: the tension.

    A negative length is the distance at the start.
    """
    stiffness: Number = 0.
    damping: Number = 0.
    length: Number = -1.
    preload: Number = 0.
    state: bool = False


@_spec
class NonlinearSpring(_Joint):
    """Tension f(l, l') by a Python function of distance and rate, which is traced."""
    tension: Law
    state: bool = False
    _functions = {"tension": _law}


@_spec
class TorsionalSpringDamper(_Joint):
    """Moment preload - stiffness (angle - free angle) - damping angle' on i's body about z_j; full turns count. Component: the moment."""
    stiffness: Number = 0.
    damping: Number = 0.
    angle: Number = 0.
    preload: Number = 0.
    state: bool = False


@_spec
class NonlinearTorsionalSpring(_Joint):
    """Moment f(angle, angle') on i's body about z_j by a Python function, which is traced; a restoring one is negative."""
    moment: Law
    state: bool = False
    _functions = {"moment": _law}


@_spec
class Bushing(_Joint):
    """Six springs and dampers in j's axes. Components: force and moment on i in j's axes."""
    stiffness: Vector = _zero()
    torsional_stiffness: Vector = _zero()
    damping: Vector = _zero()
    torsional_damping: Vector = _zero()
    force: Vector = _zero()
    moment: Vector = _zero()
    state: bool = False


@_spec
class Beam(_Joint):
    """Timoshenko beam without mass from j (x = 0) to i (x = length) along the markers' x axes; linear in its mean frame.

    E, G: Young's and shear modulus; area; Iyy, Izz: second moments of area for bending in the xz and the xy plane; J: torsion constant; shear_y,
    shear_z: shear areas, 0: no shear deformation; damping: of the stiffness, a time. Components: force and moment on i in the mean frame.
    """
    length: Number = -1.
    E: Number = 0.
    G: Number = 0.
    area: Number = 0.
    Iyy: Number = 0.
    Izz: Number = 0.
    J: Number = 0.
    shear_y: Number = 0.
    shear_z: Number = 0.
    damping: Number = 0.
    state: bool = False


@_spec
class UserForce(Spec):
    """Force and moment on i's body, three formulas each, in the axes of `frame` (default: space); j may be None: no reaction."""
    i: Any
    j: Any = None
    frame: Any = None
    force: Optional[Sequence[Formula]] = None
    moment: Optional[Sequence[Formula]] = None
    state: bool = False
    _functions = {"force": _expressions, "moment": _expressions}


@_spec
class UserScalarForce(_Joint):
    """A force along the line from j to i, repulsive when positive, or with `rotational` a moment about z_j on i's body: a formula."""
    value: Formula
    rotational: bool = False
    state: bool = False
    _functions = {"value": description}


@_spec
class ContactLaw(Spec):
    """Smooth penalty stiffness d^exponent (1 + damping d'), never tensile, with regularized Coulomb friction.

    damping: time per length; friction: coefficient; slip_velocity: of the regularization friction tanh(v / slip_velocity).
    """
    stiffness: Number = 1e5
    exponent: Number = 1.5
    damping: Number = 0.
    friction: Number = 0.
    slip_velocity: Number = 1e-3


def _contact_law():
    return field(default_factory=ContactLaw)


@_spec
class SpherePlane(_Joint):
    """Contact of a sphere about i with the xy plane of j, outside z > 0."""
    radius: Number = 1.
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class EllipsoidPlane(_Joint):
    """Contact of an ellipsoid about i in its axes with the xy plane of j."""
    semiaxes: Vector = (1., 1., 1.)
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class TorusPlane(_Joint):
    """Contact of a torus about z_i, a tire, with the xy plane of j."""
    radius: Number = 1.
    tube: Number = 0.1
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class SphereSphere(_Joint):
    """Contact of two spheres."""
    radius_i: Number = 1.
    radius_j: Number = 1.
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class SphereBox(_Joint):
    """Contact of a sphere about i with a box about j in its axes; half: half of its edges."""
    radius: Number = 1.
    half: Vector = (1., 1., 1.)
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class RotationalStop(_Joint):
    """Ends of the travel of the angle of i about z_j, radians over full turns. Component: the moment on i's body."""
    lower: Number = -inf
    upper: Number = inf
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class TranslationalStop(_Joint):
    """Ends of the travel of i along an axis of j. Component: the force on i's body."""
    lower: Number = -inf
    upper: Number = inf
    law: ContactLaw = _contact_law()
    axis: int = 2
    state: bool = False


@_spec
class DistanceStop(_Joint):
    """Ends of the distance of the origins; with upper alone a rope. Component: the tension."""
    lower: Number = 0.
    upper: Number = inf
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class JointFriction(Spec):
    """Friction in a revolute, translational, cylindrical or spherical joint, from its reaction; radius of the pin or ball."""
    joint: Any
    coefficient: Number = 0.
    radius: Number = 0.
    slip_velocity: Number = 1e-3


ELEMENTS: Tuple[str, ...] = tuple(name for name, x in list(globals().items()) if isinstance(x, type) and issubclass(x, Spec)
                                  and not name.startswith("_") and name not in ("Spec", "Term", "ContactLaw"))
__all__ = list(ELEMENTS) + ["ContactLaw", "Term"]
