"""Bodies, moments of inertia, axes, shapes."""

from dataclasses import dataclass, field
from typing import Any, Optional, Sequence, Tuple, Union

import numpy as np

from . import _core
from .spec import Number, Spec, Vector

__all__ = ["FlexibleBody", "PointMass", "RigidBody", "Shape", "axes_along", "composed", "inertia", "rotation"]


def _identity():
    return field(default_factory=lambda: np.eye(3))


@dataclass(eq=False)
class RigidBody(Spec):
    """A rigid body at the start.

    Parameters
    ----------
    mass : float
    inertia : (3, 3)
        About the centre of mass, in body axes; three numbers are its diagonal. Planar scenes use element [2, 2] only.
    position : (3,)
        Of the body's origin, space axes.
    rotation : (3, 3)
        Body axes as columns.
    velocity, angular_velocity : (3,)
        Of the centre of mass, space axes; radians per unit of time.
    center : (3,)
        Centre of mass relative to the body's origin, in body axes.
    fixed_start : bool
        The assembly phase leaves pose and velocities as given.
    """
    mass: Number = 1.
    inertia: Any = _identity()
    position: Vector = (0., 0., 0.)
    rotation: Any = _identity()
    velocity: Vector = (0., 0., 0.)
    angular_velocity: Vector = (0., 0., 0.)
    center: Vector = (0., 0., 0.)
    fixed_start: bool = False

    def _fields(self, converted):
        out = super()._fields(converted)
        if np.ndim(out["inertia"]) == 1:
            out["inertia"] = np.diag(out["inertia"])
        return out


@dataclass(eq=False)
class PointMass(Spec):
    """A point mass at the start: three coordinates (planar scenes: two), no rotation."""
    mass: Number = 1.
    position: Vector = (0., 0., 0.)
    velocity: Vector = (0., 0., 0.)
    fixed_start: bool = False


@dataclass(eq=False)
class FlexibleBody(Spec):
    """A body in modal coordinates, with the pose and velocity of its floating frame at the start; joints and forces act on its attachments.

    Parameters
    ----------
    model : ModalBody or ReducedBody
        The result of `reduce` or ``load_modal_body(file)`` of `hhtdae.flexible`.
    position, rotation : (3,), (3, 3)
        Of the origin and axes (columns) of the FE model, space axes.
    velocity, angular_velocity : (3,)
        Velocity of the undeformed centre of mass, space axes; that of a `hhtdae.flexible.FullBody` is of the origin of its FE model.
    mass : str
        "full", "partial" (without the terms quadratic in the modes) or "constant" (of the undeformed body).
    damping : float or sequence of (frequency, ratio)
        Damping ratio (of critical) of all modes, or of bands up to a frequency in cycles per unit of time; the last ratio also applies above the
        last band. The modes are those of `model`, which are modes of the free body. A supported body vibrates more slowly, in other modes with
        smaller ratios: the ratio of a cantilever's first mode is a fourteenth of the given one.
    ratios : (modes,), optional
        Damping ratio of each mode, instead of `damping`.
    deformation, deformation_rate : (modes,), optional
        Modal coordinates at the start.
    """
    model: Any
    position: Vector = (0., 0., 0.)
    rotation: Any = _identity()
    velocity: Vector = (0., 0., 0.)
    angular_velocity: Vector = (0., 0., 0.)
    mass: str = "full"
    damping: Any = ()
    ratios: Optional[Sequence[float]] = None
    deformation: Optional[Sequence[float]] = None
    deformation_rate: Optional[Sequence[float]] = None
    fixed_start: bool = False

    def _fields(self, converted):
        if self.mass not in ("full", "partial", "constant"):
            raise ValueError("mass is %r, must be 'full', 'partial' or 'constant'" % (self.mass,))
        out = super()._fields(converted)
        if hasattr(self.model, "modal"):
            out["model"] = self.model.modal()
        if not isinstance(out["model"], _core.ModalBody):
            raise TypeError("the model of a flexible body is %r, must be one of hhtdae.flexible" % (self.model,))
        if isinstance(out["damping"], (bool, np.bool_)):
            raise TypeError("damping is %r, must be a ratio of critical damping, or a list of (frequency, ratio)" % (self.damping,))
        if np.ndim(out["damping"]) == 0:
            out["damping"] = [(np.inf, float(out["damping"]))] if out["damping"] else []
        elif len(out["damping"]) and np.shape(out["damping"])[1:] != (2,):
            raise ValueError("damping is %r, must be a ratio, or a list of (frequency, ratio)" % (self.damping,))
        if self.ratios is not None and len(out["damping"]):
            raise ValueError("damping and ratios are both given: the one is for all modes or by bands of frequency, the other mode by mode; give one of them")
        return out


@dataclass(eq=False)
class Shape:
    """The shape of a body in animations and pages, made by `Shape.box`, `Shape.cylinder` or `Shape.sphere`.

    colour : in the page, a number 0xRRGGBB or "#rrggbb"; default: a different colour for each body
    """
    kind: str
    size: Tuple[float, float, float]
    position: Vector = (0., 0., 0.)
    axes: Any = _identity()
    colour: Union[int, str, None] = None

    @classmethod
    def box(cls, half, position=(0., 0., 0.), axes=None, colour=None):
        """A box, given by its half edges."""
        return cls("box", tuple(half), position, np.eye(3) if axes is None else axes, colour)

    @classmethod
    def cylinder(cls, radius, length, position=(0., 0., 0.), axes=None, colour=None):
        """A cylinder along z."""
        return cls("cylinder", (radius, radius, 0.5 * length), position, np.eye(3) if axes is None else axes, colour)

    @classmethod
    def sphere(cls, radius, position=(0., 0., 0.), colour=None):
        """A sphere."""
        return cls("sphere", (radius, radius, radius), position, colour=colour)

    def _rgb(self):
        if self.colour is None:
            return -1
        if isinstance(self.colour, str) and len(self.colour) == 7 and self.colour[0] == "#":
            try:
                return int(self.colour[1:], 16)
            except ValueError:
                pass
        elif isinstance(self.colour, int) and 0 <= self.colour <= 0xffffff:
            return self.colour
        raise ValueError("colour is %r, must be a number 0xRRGGBB or '#rrggbb'" % (self.colour,))


def _direction(x, of):
    """x as a unit vector."""
    try:
        d = np.asarray(x, dtype=float)
        length = np.linalg.norm(d)
    except ValueError:  # x is not numeric, for example a string
        length = 0.
    if not (0 < length < np.inf and d.shape == (3,)):
        raise ValueError(f"{of} must be a direction, three numbers that are not all zero, not {x.tolist() if isinstance(x, np.ndarray) else x!r}")
    return d / length


def axes_along(z, x=None):
    """Right-handed orthonormal axes, as columns: the z axis is along the vector `z` of any length, the x axis as near to `x` as possible."""
    z = _direction(z, "axes_along: z")
    given = np.zeros(3) if x is None else np.asarray(x, dtype=float)
    p = given - z.dot(given) * z
    if not np.linalg.norm(p) > 1e-8 * np.linalg.norm(given):
        p = np.zeros(3)
        p[np.argmin(np.abs(z))] = 1.
        p -= z.dot(p) * z
    p /= np.linalg.norm(p)
    return np.column_stack([p, np.cross(z, p), z])


def _numbers(x):
    """x as an array of floats, or, if it contains formulas of parameters, as an array of objects."""
    a = np.asarray(x)
    return a if a.dtype == object else np.asarray(x, dtype=float)


def _matrix(J):
    """Moments of inertia as a 3 x 3 matrix; J: the matrix or its diagonal."""
    J = _numbers(J)
    return np.diag(J) if J.ndim == 1 else J


def rotation(axis, angle):
    """The matrix of a rotation about an axis of any length, by an angle in radians."""
    a = _direction(axis, "rotation: the axis")
    K = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


class inertia:
    """Moments of inertia of homogeneous bodies about their centre of mass, in their own axes: 3 x 3 matrices. Masses and lengths may be parameters of
    a scene, and formulas of them."""

    @staticmethod
    def box(mass, edges):
        """Full edges along x, y, z."""
        s = np.square(_numbers(edges))
        return mass / 12 * np.diag([s[1] + s[2], s[2] + s[0], s[0] + s[1]])

    @staticmethod
    def tube(mass, outer, inner, length):
        """About z, hollow from radius `inner` to `outer`."""
        r2 = outer * outer + inner * inner
        side = mass * (r2 / 4 + length * length / 12)
        return np.diag([side, side, mass * r2 / 2])

    @staticmethod
    def cylinder(mass, radius, length):
        """About z."""
        return inertia.tube(mass, radius, 0., length)

    @staticmethod
    def rod(mass, length):
        """A thin rod along z. Its moment about z is zero, which a body in space must not have unless joints hold it there: `cylinder` has one."""
        return inertia.tube(mass, 0., 0., length)

    @staticmethod
    def disc(mass, radius):
        """A thin disc about z."""
        return inertia.tube(mass, radius, 0., 0.)

    @staticmethod
    def ellipsoid(mass, radii):
        """Radii along x, y, z."""
        s = np.square(_numbers(radii))
        return mass / 5 * np.diag([s[1] + s[2], s[2] + s[0], s[0] + s[1]])

    @staticmethod
    def sphere(mass, radius):
        """A solid sphere."""
        return inertia.ellipsoid(mass, (radius, radius, radius))

    @staticmethod
    def about(J, mass, d):
        """The moments of inertia about the point at d from the centre of mass, by the parallel axis theorem; J: about the centre of mass."""
        d = _numbers(d)
        return np.asarray(J) + mass * (d.dot(d) * np.eye(3) - np.outer(d, d))

    @staticmethod
    def turned(J, R):
        """J, given in the axes of a part, transformed to the axes in which R is given; the columns of R are the axes of the part."""
        return np.asarray(R) @ np.asarray(J) @ np.asarray(R).T


def composed(parts):
    """A `RigidBody` composed of several ones; its origin and axes are those in which positions and rotations of the parts are given."""
    parts = list(parts)
    mass = sum(p.mass for p in parts)
    centers = [_numbers(p.position) + _numbers(p.rotation) @ _numbers(p.center) for p in parts]
    center = sum(p.mass * c for p, c in zip(parts, centers)) / mass
    J = sum(inertia.about(inertia.turned(_matrix(p.inertia), _numbers(p.rotation)), p.mass, c - center) for p, c in zip(parts, centers))
    return RigidBody(mass=mass, inertia=J, center=center)
