"""Measures, scalars that are computed from the state: arguments of formulas, channels, and values of a snapshot.

Components are 0, 1, 2 or "x", "y", "z" in the axes of the marker `frame`, or without it in space axes.
"""

import numpy as np

from .expressions import Expression

__all__ = ["Measure", "acceleration", "angle", "angular_acceleration", "angular_velocity", "displacement", "distance", "element_force", "element_moment",
           "force", "joint_force", "joint_moment", "kinetic_energy", "modal", "multiplier", "potential_energy", "rate", "time", "value", "velocity"]


class Measure(Expression):
    """A scalar that is computed from the state of a scene."""

    __slots__ = ()

    def __init__(self, kind, i=None, j=None, frame=None, component=0, target=None):
        super().__init__("measure", (), (kind, i, j, frame, component, target))

    def key(self):
        return tuple((x._number, x._id) if hasattr(x, "_id") else x for x in self.value)

    def __repr__(self):
        return "<measure %s>" % self.value[0]


def _target(x, *kinds):
    if getattr(x, "_kind", None) not in kinds:
        raise TypeError("%r is no %s of a scene" % (x, " and no ".join(kinds)))
    return x


def _component(c):
    for k, name in enumerate("xyz"):
        if isinstance(c, (int, np.integer, str)) and c in (k, name):
            return k
    raise ValueError("component is %r, must be 0, 1, 2 or 'x', 'y', 'z'" % (c,))


def _row(k, name):
    if isinstance(k, str) and k in ("x", "y", "z"):
        return "xyz".index(k)
    if not isinstance(k, (int, np.integer)) or not 0 <= k < 2**31:
        raise ValueError("%s is %r, must be a whole number from 0 on" % (name, k))
    return int(k)


def time():
    """Time.

    Loads are evaluated at the ends of steps: a pulse while nothing moves may lie between two of them if it is shorter than a fortieth of the run.
    ``options={"ts_adapt_dt_max": 0.1}`` limits the step, which should be a part of the pulse's duration, see `Scene.run`. A load that jumps at a
    time, as by `where`, causes an error of velocities of the order of the square root of the tolerance, even if a step ends at the jump, since
    both adjacent steps evaluate the load on the same side of the jump. With a parameter that the action of `Run.event` sets, each step has the
    right side.
    """
    return Measure("time")


def displacement(i, component, j=None, frame=None):
    """Component of the position of marker i relative to marker j (default: the origin of space), length."""
    return Measure("displacement", i, j, frame, _component(component))


def distance(i, j):
    """Distance of the origins of two markers, length."""
    return Measure("distance", i, j)


def velocity(i, component, j=None, frame=None):
    """Component of the velocity of marker i relative to j, the time derivative taken in space."""
    return Measure("velocity", i, j, frame, _component(component))


def rate(i, j):
    """Time derivative of the distance of two markers; 0 if they coincide, where the distance has no derivative."""
    return Measure("rate", i, j)


def acceleration(i, component, j=None, frame=None):
    """Component of the acceleration of marker i relative to j."""
    return Measure("acceleration", i, j, frame, _component(component))


def angle(i, j):
    """Angle of i's x axis about j's z axis from j's x axis, radians; in (-pi, pi] at the start, from where full turns are counted.

    In spatial scenes this holds if an element, a variable, a state or a channel reads the angle. If only snapshots or events read it, the first
    value is in (-pi, pi], and full turns are counted from then on. Make a channel of an angle that is read later. It is in (-pi, pi] at the start
    also where a motion prescribes more. Fixed steps (``ts_adapt_type`` none) that turn it by more than half a turn lose turns, which the run reports.
    """
    return Measure("angle", i, j)


def angular_velocity(i, component, j=None, frame=None):
    """Component of the angular velocity of marker i relative to j, radians per unit of time."""
    return Measure("angular_velocity", i, j, frame, _component(component))


def angular_acceleration(i, component, j=None, frame=None):
    """Component of the angular acceleration of marker i relative to j."""
    return Measure("angular_acceleration", i, j, frame, _component(component))


def multiplier(joint, row):
    """Multiplier of a row, from 0 on, of a joint or motion: a force or a moment on the body of its marker i; the class of the joint states the
    axes of each row."""
    return Measure("multiplier", component=_row(row, "row"), target=_target(joint, "element"))


def joint_force(joint, component, frame=None):
    """Force of a joint or motion on the body of its marker i, in `frame` (default: its marker j)."""
    return Measure("joint_force", frame=frame, component=_component(component), target=_target(joint, "element"))


def joint_moment(joint, component, frame=None):
    """Moment of a joint or motion on the body of its marker i, about that marker's origin, in `frame` (default: its marker j)."""
    return Measure("joint_moment", frame=frame, component=_component(component), target=_target(joint, "element"))


def force(element, component=0):
    """Component of a force element; its class states the components: tension, moment, force in some axes."""
    return Measure("force", component=_row(component, "component"), target=_target(element, "element"))


def element_force(element, on, component, frame=None):
    """Force of any element on the body of the marker `on` (default of frame: space axes); only for channels and snapshots. An `Error` if the
    element does not act on that body, in which case `Snapshot.load` is zero."""
    return Measure("element_force", on, None, frame, _component(component), _target(element, "element"))


def element_moment(element, on, component, frame=None):
    """Moment of any element on the body of the marker `on`, about its origin; only for channels and snapshots. An `Error` if the element does not
    act on that body."""
    return Measure("element_moment", on, None, frame, _component(component), _target(element, "element"))


def value(x):
    """Value of a user-defined variable or of a first-order state."""
    return Measure(_target(x, "variable", "state")._kind, target=x)


def modal(body, mode):
    """Modal coordinate of a flexible body, modes from 0 on."""
    return Measure("modal", component=_row(mode, "mode"), target=_target(body, "body"))


def kinetic_energy():
    """Kinetic energy of the whole scene; only for channels and snapshots."""
    return Measure("kinetic_energy")


def potential_energy():
    """Potential energy of the whole scene, only for channels and snapshots: of gravity, modes, FE models, SpringDamper, TorsionalSpringDamper,
    Bushing, Beam, contacts and stops. Users' functions and ground_acceleration() have none."""
    return Measure("potential_energy")


def description(x, keep):
    """A formula for the C++ part: its measures, and a tape with these as arguments; None instead of a tape if the formula is a single measure"""
    from .expressions import _expression
    from .tracing import compile_tape, ordered

    x = _expression(x)
    if isinstance(x, Measure):
        return [x.value], None
    leaves = {}
    for n in ordered([x]):
        if n.op == "measure":
            leaves.setdefault(n.key(), n)
    numbers = {key: k for k, key in enumerate(leaves)}
    return [n.value for n in leaves.values()], compile_tape([x], numbers, keep, len(leaves))
