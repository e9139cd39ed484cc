"""Snapshots of a run, and small motions about its state."""

import warnings
from dataclasses import dataclass
from typing import Tuple

import numpy as np
from petsc4py import PETSc

from . import _core
from ._errors import Error
from .expressions import _expression
from .measures import Measure
from .spec import check_parameters, number
from .threads import one_thread
from .tracing import compile_tape, ordered

__all__ = ["BodyPart", "Excitation", "Linearization", "Load", "Mode", "Motion", "Snapshot", "StateSpace"]

Mode = _core.Mode


@dataclass(eq=False)
class Motion:
    """Motion of a marker or body; all vectors are in the requested axes.

    position, velocity, acceleration : (3,), of the marker's origin or the body's centre of mass
    axes : (3, 3), its axes as columns
    angular_velocity, angular_acceleration : (3,), radians per unit of time, and per unit of time squared
    """
    position: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    axes: np.ndarray
    angular_velocity: np.ndarray
    angular_acceleration: np.ndarray

    def euler(self):
        """3-1-3 angles phi, theta, psi: axes = Rz(phi) Rx(theta) Rz(psi), radians."""
        return _core.euler(self.axes)

    def bryant(self):
        """1-2-3 angles a, b, c: axes = Rx(a) Ry(b) Rz(c), radians."""
        return _core.bryant(self.axes)


@dataclass(eq=False)
class Load:
    """Force (3,) and moment (3,) of an element on a body."""
    force: np.ndarray
    moment: np.ndarray


class Snapshot:
    """The state of a run at a time of its last step, made by `Run.snapshot`: evaluates motions, loads and formulas that need not have been
    declared before.

    Accelerations and multipliers at a time within a step follow from the equations of motion with the interpolated positions and velocities, at
    the cost of about a factorization. At the end of a step they are those of the step, at no cost and usually with an error many times as large.
    With fast, weakly damped modes, above all of flexible bodies, the opposite is true: accelerations and reactions within the step contain the
    error of the interpolated positions times the square of the highest frequency. Then take snapshots at the ends of steps, or lower the tolerance.

    In spatial scenes, an angle that no element and no channel reads between the same two markers (`Body.marker` makes a new one each time) is in
    (-pi, pi] when it is first read, and full turns are counted from then on: make a channel of it, see `angle`. All calls are collective.
    """

    def __init__(self, run, time=None, later=False):
        self._core = _core.Snapshot()
        self._run = run
        if not later:
            self.take(time)

    @one_thread
    def take(self, time=None):
        """Moves the snapshot to another time (default: the end of the last step)."""
        self._core.take(self._run._open(), None if time is None else number(time, "time"))
        return self

    @property
    def time(self):
        """Its time."""
        return self._core.time()

    def motion(self, of, axes=None):
        """`Motion` of a marker relative to space, in the axes of another marker (default: space); or of a body: its centre of mass and axes."""
        from .scene import Marker

        if isinstance(of, Marker):
            return Motion(**self._core.marker(of, axes))
        if axes is not None:
            raise TypeError("the motion of a body is told in space axes; ask for that of a marker")
        return Motion(**self._core.body(of))

    def relative_motion(self, marker, to):
        """`Motion` of a marker relative to the marker `to`, as an observer moving with `to` sees it, in its axes."""
        return Motion(**self._core.relative(marker, to))

    def load(self, element, on, axes=None):
        """`Load` of a joint, motion or force on the body of the marker `on`, zero if it does not act on it; the moment is about that marker's
        origin, both are in the axes of another marker (default: space). For a flexible body it is the load on the attachment of the marker, or,
        for ``ModalLoad`` and ``NodeContact``, which have no attachment, on the whole body; `Error` if the element acts on another attachment only."""
        return Load(*self._core.load(element, on, axes))

    def modes(self, body):
        """Modal coordinates of a flexible body, (modes,)."""
        return self._core.modes(body)

    def value(self, formula):
        """Value of a measure, or of a formula of measures."""
        x = _expression(formula)
        leaves = {}
        for n in ordered([x]):
            if n.op == "measure":
                leaves.setdefault(n.key(), n)
        values = [self._core.value(m.value) for m in leaves.values()]
        if isinstance(x, Measure):
            return values[0]
        keep = []
        tape = compile_tape([x], {key: k for k, key in enumerate(leaves)}, keep, len(leaves))
        check_parameters(keep, self._run.scene, "value()")
        return float(tape(np.array(values, dtype=float))[0])

    def energy(self):
        """Kinetic and potential energy of the scene."""
        return self._core.energy()

    def close(self):
        """Frees its memory."""
        self._core.close()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()


@dataclass(eq=False)
class BodyPart:
    """A body's part in a mode: complex amplitudes of its centre of mass and rotation in space axes, and its share of the kinetic energy."""
    displacement: np.ndarray
    rotation: np.ndarray
    share: float


def _rests_against_motions(ts):
    """Whether all velocities are zero, as in static equilibrium, where motions of displacement have some"""
    u, v = ts.getSolution2()
    rows = _core.get_is(ts, "holonomic")
    if v.norm(PETSc.NormType.INFINITY) > 0 or not rows:
        return False
    t, misfit = ts.getTime(), []
    dt = 1e-6 * max(1., abs(t))
    for k in range(3):
        f = u.duplicate()
        ts.computeI2Function(t + k * dt, u, v, v, f)
        part = f.getSubVector(rows)
        misfit.append(part.copy())
        f.restoreSubVector(rows, part)
    first, second, third = misfit
    change = 4. * (second - first) - (third - first)  # 2 dt times the rate: of a motion that is about to turn it is none
    return change.norm(PETSc.NormType.INFINITY) > 1e-5 * dt


@dataclass(eq=False)
class StateSpace:
    """z' = A z + B f, y = C z + D f in minimal coordinates; unpacks as A, B, C, D, the arguments of scipy.signal.StateSpace."""
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray

    def __iter__(self):
        return iter((self.A, self.B, self.C, self.D))


@dataclass(eq=False)
class Excitation:
    """An input of a linearization, defined by the excitation for the input value 1; made by `force`, `torque`, `motion` or `ground_acceleration`."""
    at: object = None
    load: Tuple[float, float, float] = (0., 0., 0.)
    moment: Tuple[float, float, float] = (0., 0., 0.)
    driven: object = None
    ground: Tuple[float, float, float] = (0., 0., 0.)

    @classmethod
    def force(cls, marker, vector):
        """A force (3,) in space axes at a marker's origin."""
        return cls(marker, vector)

    @classmethod
    def torque(cls, marker, vector):
        """A moment (3,) in space axes on a marker's body."""
        return cls(marker, moment=vector)

    @classmethod
    def motion(cls, element):
        """An addition of 1, in its unit, to the function of a motion element, for example a shaken base."""
        return cls(driven=element)

    @classmethod
    def ground_acceleration(cls, vector):
        """An acceleration (3,) of the ground; all coordinates are relative to the ground."""
        return cls(ground=vector)

    def _tuple(self):
        return self.at, self.load, self.moment, self.driven, self.ground


def _excitation(x):
    if not isinstance(x, Excitation):
        raise TypeError("%r is no Excitation: Excitation.force(marker, vector), .torque(marker, vector), .motion(element) or .ground_acceleration(vector)" % (x,))
    return x._tuple()


class Linearization:
    """Small motions about the state of a run at a time, made by `Run.linearize`: M x'' + C x' + K x = b f. All calls are collective.

    x are displacements and small rotations of bodies, and all other unknowns. M, C and K are those at the time of the state. They describe small
    motions at later times only if the state is an equilibrium or a motion that is steady relative to the axes of x. These axes coincide with
    those of space at the time of the state and rotate with the body `axes` (for example a driven hub for its blades); without `axes`, they rotate
    with the bodies in modal coordinates if all of these have the same angular velocity (for whole bodies name the body that carries them);
    otherwise, or if `axes` is `scene.ground`, they do not rotate: a rotating axisymmetric rotor of rigid discs is steady relative to space.
    Frequencies relative to the axes of an axisymmetric rotor differ from those in space by its speed.

    M, C and K are derivatives of all forces with velocities, accelerations and multipliers held at their present values: they include gyroscopic
    and centrifugal terms, those of accelerations and of the directions of loads and reactions, but not the change of M, C and K with time.

    The motion of a swinging rod is steady relative to no axes. In such a state `modes()` without a count and `state_space()` describe the rates
    of small motions at this time, including the change of constraints along the motion; `response()` and `modes(count)`, which use sparse
    matrices, are valid for equilibria and steady motions only. They warn if accelerations change the state within a period of the slowest
    requested motion. A rotor of rigid bodies that is not axisymmetric must be linearized relative to itself; no warning indicates this.

    The loads and reactions at the time of the state stiffen and bend an elastic body in all of these calls. All of them warn if an elastic body is
    not steady, or if its modal coordinates rotate relative to the axes. A body that spins from the start on has neither the extension nor the
    reactions of its speed, and `Run.equilibrium()` would stop it. Let a run with damping come to rest relative to what rotates, and remove the
    damping for the linearization:

    >>> scene.add("blade", lambda: hhtdae.FlexibleBody(body, angular_velocity=(0, 0, speed), damping=d.get()))  # d = scene.parameter("d", 1.): critical damping
    >>> run = scene.solve(0.5, tolerance=1e-7)
    >>> scene.set(d=0.)
    >>> scene.run(after=run).linearize(axes=hub).modes()
    """

    @one_thread
    def __init__(self, run, time=None, axes=None):
        self._core = _core.Linearization()
        ts = run._open()
        self._core.take(ts, None if time is None else number(time, "time"), axes)
        self._time = run._at(time)
        self._steadiness = None  # once asked for
        if not ts.getStepNumber() and _rests_against_motions(ts):
            warnings.warn("linearize(): bodies are at rest at t = %g, although motions move them, and small motions are those of what stands still. Run.assemble() gives them the velocities of the motions"
                          % self._time, RuntimeWarning, 4)

    def _warn_if_unsteady(self, call, rates, sparse=True):
        """What is sparse has constraints as they are at this moment. What is dense has their change, but loads and shapes of elastic bodies as they are. rates: of the motions that are asked
        for, 1/s, or a function that gives them, which costs as much as all modes"""
        if self._steadiness is None:
            self._steadiness = self._core.steadiness()
        now = self._steadiness
        if now["turning"]:
            warnings.warn("%s: body %s turns relative to the axes of the linearization at t = %g, and small motions are others: its modal coordinates are in its own axes. Take the linearization from "
                          "there, linearize(axes=body)" % (call, now["turning"], self._time), RuntimeWarning, 3)
            return
        if not now["change" if sparse else "elastic_change"]:
            return
        own = now["square_rate"]  # a motion that nothing drives back has no rate of its own: the scene's counts
        squares = [x if x > max(1e-4 * own, now["rounding"]) else own for x in (abs(rate)**2 for rate in (rates() if callable(rates) else rates))]
        square = min((x for x in squares if x), default=0.)
        if squares and not square:  # none but rounding: beside it any motion is fast
            square, limit = now["rounding"], now["rounding"]
        else:
            limit = 1e-3 * square
        if not square or now["change" if sparse else "elastic_change"] <= limit:
            return
        elastic = now["elastic_change"] > limit
        body, change = (now["elastic"], now["elastic_change"]) if elastic else (now["body"], now["change"])
        advice = [] if elastic else ["take state_space() or modes() without a count, which are of any state of rigid bodies"]
        if now["spin"]:
            advice += ["let what vibrates in the turning scene come to rest by a run with damping, and linearize there", "bring the run to equilibrium by Run.equilibrium(), which stops what turns"]
        else:
            advice.append("bring the run to equilibrium by Run.equilibrium()")
        text = "; or ".join(advice + ["name the body from which the motion is steady, linearize(axes=)"])
        warnings.warn("%s: the state at t = %g is neither in equilibrium nor steady as seen from the axes of the linearization, and small motions are others: accelerations move %s %s by "
                      "%.2g of the scene's size, or turn it by as many radians, within 1 rad of a motion of %.3g rad per unit of time. %s"
                      % (call, self._time, "elastic body" if elastic else "body", body, change / square, square**0.5, text[0].upper() + text[1:]), RuntimeWarning, 3)

    def modes(self, count=None, shift=1.):
        """Natural modes, a list of `Mode` by increasing abs(value): all modes by dense algebra, for scenes of up to 1000 unknowns; or the `count`
        slowest ones by SLEPc with the real shift `shift` (1/s)."""
        if count is None:
            found = self._core.modes()
            self._warn_if_unsteady("modes()", [mode.value for mode in found], sparse=False)
            return found
        from . import flexible

        if isinstance(count, (bool, np.bool_)) or not hasattr(count, "__index__"):
            raise TypeError("modes(): count is %r, must be a whole number, or None for all modes" % (count,))
        try:
            found = flexible._flexible.slowest_modes(self._core, int(count), number(shift, "modes(): shift"))
        except Error as error:
            freedoms = self._freedoms()
            if count <= freedoms:
                raise
            text = "modes(%d): the scene has %d degree%s of freedom, and no more modes where nothing is overdamped; ask for fewer, or for all by modes()" % (count, freedoms, "s" * (freedoms != 1))
            raise Error(error.ierr, text + ". " + error.message, error.trace) from error.__cause__
        self._warn_if_unsteady("modes(count)", [mode.value for mode in found])
        return found

    def _freedoms(self):
        """Number of coordinates minus number of constraints"""
        size = {role: rows.getSize() if rows else 0 for role in ("coordinate", "holonomic", "nonholonomic") for rows in [_core.get_is(self._core.ts, role)]}
        return size["coordinate"] - size["holonomic"] - size["nonholonomic"]

    def part(self, mode, body):
        """`BodyPart` of a body in a mode."""
        return BodyPart(*self._core.part(mode, body))

    def value(self, mode, measure):
        """Complex amplitude of a measure in a mode, with the scale of the mode's shape."""
        return self._core.value(mode, _measure(measure))

    def response(self, excitation, measure, omega):
        """Complex amplitudes of a measure for the input cos(omega t), for each circular frequency in `omega` (rad per unit of time)."""
        omega = np.atleast_1d(np.asarray(omega, dtype=float))
        found = self._core.response(_excitation(excitation), _measure(measure), omega)
        self._warn_if_unsteady("response()", omega)
        return found

    def state_space(self, inputs, outputs):
        """`StateSpace` in minimal coordinates between lists of excitations and measures."""
        for name, given, example in (("inputs", inputs, "[Excitation.force(marker, vector)]"), ("outputs", outputs, '[hhtdae.displacement(marker, "x")]')):
            if isinstance(given, (Excitation, Measure, str)) or not np.iterable(given):
                raise TypeError("state_space(): %s is %r, must be a list, as %s" % (name, given, example))
        found = StateSpace(*self._core.state_space([_excitation(e) for e in inputs], [_measure(m) for m in outputs]))
        self._warn_if_unsteady("state_space()", lambda: np.linalg.eigvals(found.A), sparse=False)
        return found

    def operators(self):
        """M, C, K as petsc4py matrices, a row and column for each unknown of the scene."""
        return self._core.operators()

    def animate(self, mode, prefix, amplitude, frames=24):
        """Writes an animation of one period of a mode for ParaView: prefix.pvd and a file for each frame."""
        self._core.animate(mode, prefix, amplitude, frames)

    def close(self):
        """Frees its memory."""
        self._core.close()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()


def _measure(m):
    if not isinstance(m, Measure):
        raise TypeError("%r is no measure; a formula may be made of the results for its measures" % (m,))
    return m.value
