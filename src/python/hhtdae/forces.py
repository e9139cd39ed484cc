"""Forces: springs, bushings, beams, the user's own, contact, stops, friction.

In planar scenes the plane of a contact is the line along x_j, outside y_j > 0; spheres, ellipsoids and boxes are discs, ellipses and rectangles there, and there is no
`TorusPlane`.
"""

from __future__ import annotations

from dataclasses import field
from math import inf
from typing import Any, Optional, Sequence

from .measures import description
from .spec import Formula, Law, Number, Spec, Vector, _Joint, _expressions, _law, _spec, _zero

__all__ = ["SpringDamper", "NonlinearSpring", "TorsionalSpringDamper", "NonlinearTorsionalSpring", "Bushing", "Beam", "UserForce", "UserScalarForce",
           "ModalLoad", "NodeContact", "ContactLaw", "SpherePlane", "EllipsoidPlane", "TorusPlane", "SphereSphere", "SphereBox", "RotationalStop", "TranslationalStop",
           "DistanceStop", "JointFriction"]


@_spec
class SpringDamper(_Joint):
    """Tension stiffness (l - length) + damping l' + preload along the line of the origins, l their distance. Component: the tension.

    stiffness : force per length, not negative
    damping : force per velocity, not negative
    length : free length; negative: the distance in the description, before assembly
    preload : tension at the free length"""
    stiffness: Number = 0.
    damping: Number = 0.
    length: Number = -1.
    preload: Number = 0.
    state: bool = False


@_spec
class NonlinearSpring(_Joint):
    """Tension f(l, l') by a Python function of distance and rate, which is traced. Component: the tension.

    tension : function of two formulas, ``lambda l, v: 100 * (l - 1)**3 + 2 * v``"""
    tension: Law
    state: bool = False
    _functions = {"tension": _law}


@_spec
class TorsionalSpringDamper(_Joint):
    """Moment preload - stiffness (a - angle) - damping a' on i's body about z_j, a the angle of i's x axis from j's. Component: the moment. The angle is in
    (-pi, pi] at the start, also where a motion prescribes more, and counts full turns from there. Fixed steps that turn it by more than half a turn lose turns.

    stiffness : moment per radian, not negative
    damping : moment per angular velocity, not negative
    angle : free angle, radians, with full turns
    preload : moment at the free angle"""
    stiffness: Number = 0.
    damping: Number = 0.
    angle: Number = 0.
    preload: Number = 0.
    state: bool = False


@_spec
class NonlinearTorsionalSpring(_Joint):
    """Moment f(a, a') on i's body about z_j by a Python function of angle and rate, which is traced. Component: the moment.

    moment : function of two formulas; a restoring one is negative, ``lambda a, w: -30 * hhtdae.sin(a)``"""
    moment: Law
    state: bool = False
    _functions = {"moment": _law}


@_spec
class Bushing(_Joint):
    """Six springs and dampers in j's axes: force f_0 - K d - C v, moment m_0 - K_t phi - C_t w on i's body about i's origin, for displacements d and
    small rotations phi of i relative to j; in general m_0 - K_t phi is multiplied by 1 + [phi]/2 + ..., which makes the bushing conservative.
    Rotations must stay below half a turn: beyond it the moment has the wrong sign, also in planar scenes (a TorsionalSpringDamper counts turns).
    Components: force and moment on i in j's axes.

    stiffness, torsional_stiffness : (3,), force per length, moment per radian, not negative
    damping, torsional_damping : (3,), force per velocity, moment per angular velocity, not negative
    force, moment : (3,), preload f_0, m_0"""
    stiffness: Vector = _zero()
    torsional_stiffness: Vector = _zero()
    damping: Vector = _zero()
    torsional_damping: Vector = _zero()
    force: Vector = _zero()
    moment: Vector = _zero()
    state: bool = False


@_spec
class Beam(_Joint):
    """Massless Timoshenko beam from j (x = 0) to i (x = length) along the markers' x axes; linear in its mean frame, for rotations of i
    relative to j below half a turn: beyond it the torque has the wrong sign. Components: force and moment on i in the mean frame. Planar scenes
    need E, area and Izz only.

    length : negative: the distance at the start
    E, G : Young's modulus, shear modulus
    area : of the cross section
    Iyy, Izz : second moments of area, for bending in the xz and in the xy plane
    J : torsion constant
    shear_y, shear_z : shear areas; 0: no shear deformation
    damping : of the stiffness, a time: C = damping K in the mean frame"""
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
    """Force and moment on i's body, formulas in the axes of a marker. Components: force, then moment. Forces are evaluated at the ends of steps:
    one that acts only on a short part of the path, as where() of a position does, requires steps shorter than that part,
    options={"ts_adapt_dt_max": ...}.

    force, moment : three formulas each, or None
    frame : Marker, default: space axes
    j : None if there is no reaction"""
    i: Any
    j: Any = None
    frame: Any = None
    force: Optional[Sequence[Formula]] = None
    moment: Optional[Sequence[Formula]] = None
    state: bool = False
    _functions = {"force": _expressions, "moment": _expressions}


@_spec
class UserScalarForce(_Joint):
    """A force along the line from j to i, repulsive when positive, or a moment about z_j on i's body. Component: its value.

    value : formula
    rotational : bool, whether it is a moment"""
    value: Formula
    rotational: bool = False
    state: bool = False
    _functions = {"value": description}


@_spec
class ModalLoad(Spec):
    """A load case of a flexible body times a formula, in the axes of the body. Component: the scale.

    Deflections converge with the number of modes. If the static deflection has to be exact, make an attachment of the loaded nodes, see
    `hhtdae.flexible.reduce`.

    body : flexible Body
    load : name of the load case
    scale : formula
    state : bool, whether the scale is an unknown of the equations, a force state"""
    body: Any
    load: str
    scale: Formula
    state: bool = False
    _functions = {"scale": description}


@_spec
class ContactLaw(Spec):
    """Smooth penalty stiffness d^exponent (1 + damping d'), never tensile, with regularized Coulomb friction.

    stiffness : force per length^exponent; of stops of angles moment per radian^exponent
    exponent : of the penetration d
    damping : time per length
    friction : Coulomb's coefficient
    slip_velocity : of the regularization friction tanh(v / slip_velocity)

    The default values are for metres, newtons and seconds. Steps end within contacts and stops that velocities and accelerations foresee, so that none is passed over that
    changes positions by more than the tolerance; `NodeContact`, formulas and steps of fixed length have no such look-ahead: ``options={"ts_adapt_dt_max": ...}``. Within a
    contact only the error of positions chooses the steps: the speed after an elastic impact is right to 5 % if the tolerance is a hundredth of the penetration, and
    to some 50 % if it is a third. A tolerance near the penetration or above it lets impacts gain energy."""
    stiffness: Number = 1e5
    exponent: Number = 1.5
    damping: Number = 0.
    friction: Number = 0.
    slip_velocity: Number = 1e-3


def _contact_law():
    return field(default_factory=ContactLaw)


@_spec
class SpherePlane(_Joint):
    """Contact of a sphere about i with the xy plane of j, outside z_j > 0; planar scenes: with the line along x_j, outside y_j > 0. Components: the force on i's body at
    the point of contact, in j's axes.

    radius : length"""
    radius: Number = 1.
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class NodeContact(Spec):
    """Kept nodes of a flexible body as balls against the xy plane of j, outside z_j > 0, or a sphere about j. Components: the resultant on the body, in space axes.

    body : flexible Body
    nodes : labels; default: all kept nodes
    radius : of the balls; may be zero with a plane
    radius_j : of the sphere; 0: the other shape is a plane"""
    body: Any
    j: Any
    nodes: Optional[Sequence[int]] = None
    radius: Number = 0.
    radius_j: Number = 0.
    law: ContactLaw = _contact_law()


@_spec
class EllipsoidPlane(_Joint):
    """Contact of an ellipsoid about i in its axes with the xy plane of j, outside z_j > 0; planar scenes: with the line along x_j, outside y_j > 0. Components: the force on
    i's body at the point of contact, in j's axes.

    semiaxes : (3,), lengths"""
    semiaxes: Vector = (1., 1., 1.)
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class TorusPlane(_Joint):
    """Contact of a torus about z_i, a tire, with the xy plane of j, outside z_j > 0. Components: the force on i's body at the point of contact, in j's axes.

    radius : of the circle of centres
    tube : radius of the tube"""
    radius: Number = 1.
    tube: Number = 0.1
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class SphereSphere(_Joint):
    """Contact of two spheres. Components: the force on i's body at the point of contact, in space axes.

    radius_i, radius_j : lengths"""
    radius_i: Number = 1.
    radius_j: Number = 1.
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class SphereBox(_Joint):
    """Contact of a sphere about i with a box about j in its axes. Components: the force on i's body at the point of contact, in j's axes.

    radius : of the sphere
    half : (3,), half of the box's edges"""
    radius: Number = 1.
    half: Vector = (1., 1., 1.)
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class RotationalStop(_Joint):
    """Limits of the angle of i's x axis about z_j, from j's. Component: the moment on i's body.

    lower, upper : radians, over full turns; the angle is in (-pi, pi] at the start, also where a motion prescribes more, and counts full turns from there
    law : in moment and radians, without friction"""
    lower: Number = -inf
    upper: Number = inf
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class TranslationalStop(_Joint):
    """Limits of the displacement of i along an axis of j. Component: the force on i's body.

    lower, upper : lengths
    axis : 0, 1 or 2: x_j, y_j or z_j; in planar scenes the default is x_j, along which `Translational` is there
    law : without friction"""
    lower: Number = -inf
    upper: Number = inf
    law: ContactLaw = _contact_law()
    axis: int = 2
    state: bool = False


@_spec
class DistanceStop(_Joint):
    """Limits of the distance of the origins; with `upper` only, a rope. Component: the tension.

    lower, upper : lengths
    law : without friction"""
    lower: Number = 0.
    upper: Number = inf
    law: ContactLaw = _contact_law()
    state: bool = False


@_spec
class JointFriction(Spec):
    """Friction in a joint (Revolute, Translational, Cylindrical, Spherical) from its reaction force N: moment mu r N or force mu N, regularized.
    Reaction moments add nothing. Components, on the body of the joint's marker i: Revolute, the moment about z_j; Translational, the force along z_j (planar scenes: x_j);
    Cylindrical, the force along and the moment about z_j; Spherical, the moment in space axes.

    joint : Element
    coefficient : mu
    radius : r of the pin or ball; not used along a translation
    slip_velocity : of the regularization"""
    joint: Any
    coefficient: Number = 0.
    radius: Number = 0.
    slip_velocity: Number = 1e-3
