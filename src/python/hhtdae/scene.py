"""Multibody scenes: descriptions from which runs are made."""

import operator
import os
import re
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Type, Union

import numpy as np
from petsc4py import PETSc

from . import _core
from .bodies import FlexibleBody, PointMass, RigidBody, Shape, _direction, axes_along
from .elements import ELEMENTS
from .expressions import Expression, Parameter, describing
from .joints import RotationalMotion, TranslationalMotion, Universal, UserConstraint
from .measures import Measure, description
from .run import Run
from .recipe import Recipe
from .spec import Formula, Spec, check_parameters, copied, has_formula, number, plain, text
from .threads import one_thread
from .tracing import time_function

__all__ = ["Body", "Element", "Marker", "Scene", "State", "Variable"]


class _Handle:
    """Refers to a part of a scene; results and messages use its name"""

    __slots__ = ("_id", "_number", "_scene", "name")

    def __init__(self, scene, ids, name):
        self._id, self._number = ids
        self._scene, self.name = scene, name

    def __repr__(self):
        return "<%s %s>" % (type(self).__name__, self.name)

    def __reduce__(self):
        return type(self)._of, (self._scene, self._id, self.name)

    @classmethod
    def _of(cls, scene, number, name):
        """The handle in an unpickled scene, which has another number than the pickled one"""
        return cls(scene, (number, scene.ground._number), name)


class Body(_Handle):
    """A body of a scene, the ground, or the frame of an attachment. `name` is what results and messages call it."""

    __slots__ = ()
    _kind = "body"

    def marker(self, position: Sequence[float] = (0., 0., 0.), axes: Any = None, name: str = "") -> "Marker":
        """A marker on the body; position relative to the body's origin and axes (columns) are in body axes, for the ground in space axes."""
        return self._scene._marker(self, position, axes, name, False)

    def marker_at(self, position: Sequence[float], axes: Any = None, name: str = "") -> "Marker":
        """A marker on the body, given by its position and axes at the start, in space axes."""
        return self._scene._marker(self, position, axes, name, True)

    def attachment(self, name: str) -> "Body":
        """The frame of an attachment of a flexible body: a body for markers and shapes. It has no unknowns."""
        self._scene._describe()
        return Body(self._scene, self._scene._core.attachment(self, name), "%s.%s" % (self.name, name))

    def node(self, label: int) -> "Body":
        """The frame at a node that the reduction has kept, by the node's number in the FE model."""
        self._scene._describe()
        return Body(self._scene, self._scene._core.node(self, label), "%s.node %d" % (self.name, label))

    def shape(self, shape: Shape) -> "Body":
        """Adds a shape with which the body is drawn in animations and pages."""
        if not isinstance(shape, Shape):
            raise TypeError("a shape of %s is %r, must be Shape.box(half), Shape.cylinder(radius, length) or Shape.sphere(radius)" % (self.name, shape))
        self._scene._describe("a shape of %s" % self.name)
        self._scene._core.shape(self, shape.kind, shape.size, shape.position, shape.axes, shape._rgb())
        return self

    def surface(self, body: Any, stress_unit: str = "") -> "Body":
        """Draws a flexible body in pages by the deformed surface of its mesh, coloured by stress if the `hhtdae.flexible.ReducedBody` has stress
        modes. The reduced body must have kept its elements and the modes at all nodes, and be on one rank or on the ranks of the scene.
        Collective."""
        from . import flexible

        self._scene._describe("a surface of %s" % self.name)
        flexible._flexible.show(self._scene._core, self._scene.comm, self, body._core, stress_unit)
        return self


class Marker(_Handle):
    """A point with axes on a body."""
    __slots__ = ()
    _kind = "marker"


class Element(_Handle):
    """A joint, motion or force. `name` is what results and messages call it."""
    __slots__ = ()
    _kind = "element"


class Variable(_Handle):
    """A user-defined variable. `name` is what results and messages call it."""
    __slots__ = ()
    _kind = "variable"


class State(_Handle):
    """A first-order state. `name` is what results and messages call it."""
    __slots__ = ()
    _kind = "state"


class Scene:
    """A multibody scene: bodies, markers, joints, motions, forces.

    Units are chosen by the user and must be consistent; angles are in radians. All errors of a description are reported at once, with the names
    of the parts, when the first run is made. Under MPI every rank describes the same scene in the same order.

    Parameters
    ----------
    gravity : (3,), optional
        Acceleration of gravity, space axes; formulas of parameters have to be given by `set_gravity`.
    planar : bool
        Bodies move in the xy plane: 3 coordinates, position and angle about z. Forces along z and moments about x and y are ignored; nonzero
        constants for these in a `UserForce` are an error, and gravity along z causes a notice.
    comm : petsc4py or mpi4py communicator
        Default: the world's.

    Examples
    --------
    >>> scene = hhtdae.Scene(gravity=(0, -9.81, 0))
    >>> arm = scene.add("arm", hhtdae.RigidBody(mass=2, inertia=hhtdae.inertia.box(2, (1, .1, .1)), position=(0.5, 0, 0)))
    >>> pin = scene.add("pin", hhtdae.Revolute(arm.marker((-0.5, 0, 0)), scene.ground.marker()))
    >>> scene.channel("tip", hhtdae.displacement(arm.marker((0.5, 0, 0)), "y"), "m")
    >>> run = scene.solve(2.0, tolerance=1e-6)
    >>> run["tip"]
    """

    def __init__(self, gravity: Optional[Sequence[float]] = None, planar: bool = False, comm: Any = None) -> None:
        self.comm = PETSc.COMM_WORLD if comm is None else PETSc.Comm(comm)
        if not isinstance(planar, (bool, np.bool_)):
            raise TypeError(f"Scene: planar must be True or False, not {planar!r}")
        self._core = _core.Scene(self.comm, bool(planar))
        self._keep = [self.comm]  # objects to which the C++ part has borrowed references: callbacks and describing functions
        self._channels = []
        self._parameters = {}
        self._states = self._bodies = self._elements = self._variables = 0
        self._begun = False  # whether anything but parameters has been described
        self._edits = 0  # number of calls that have described something
        self._constraints_jump = False  # whether positions that satisfy the constraints depend on parameters
        self._fixed = False  # true from the first successful set-up on
        self._recipe: Optional[Recipe] = None
        self._start = dict(assembly="report", redundant="drop", rotations="local", equilibrium=False, view=False, tolerance=1e-6, time=0., angle_tol=0.)
        self._output = dict(file="", csv="", dt=0., animation="", animation_dt=0., balance=False, page="", page_title="", page_dt=0.,
                            page_frames=500, page_nodes=6000)
        self.ground = Body(self, self._core.ground(), "ground")
        if gravity is not None:
            self.set_gravity(gravity)

    def _describe(self, late=None):
        """Called first by every function that describes something; late: name of the part for the error message if it cannot be added after the
        set-up"""
        if self._fixed and late is not None:
            raise RuntimeError("%s came too late: the scene is fixed from its set-up or first run on, and stays as it was. Describe it before, or make another scene; a formula "
                               "can be asked of any run by Snapshot.value()" % late)
        self._begun = True
        self._edits += 1

    def __reduce__(self):
        if self._recipe is None:
            raise TypeError("a scene refers to functions and objects of PETSc, which cannot be pickled: let a function of a module describe it, marked by @hhtdae.model")
        return self._recipe.again, (self._recipe.state(self),)

    # ---- description ----

    def parameter(self, name: str, value: float) -> Parameter:
        """A number that may have another value in the next run. Parameters must be made before everything else except gravity and
        `ground_acceleration`. Returns a `Parameter`, which can be given for any number of the description. Its name must be unique among
        parameters."""
        if self._begun:
            raise ValueError("parameter %s came too late: parameters are made before everything else but gravity and the ground's acceleration" % name)
        text(name, "Scene.parameter()")
        self._edits += 1
        self._parameters[name] = p = Parameter(self, name, self._core.parameter(name, number(value, "parameter " + name)))
        return p

    def set(self, **values: float) -> None:
        """Changes the values of parameters. Collective.

        Numbers of the description change for runs made from now on; existing runs keep the old ones. Formulas of the state and callbacks,
        which read parameters when they are evaluated, change at once in all runs: simultaneous runs with different values there need separate scenes.
        `Run.snapshot`, `Run.sample` and `Run.linearize` at the present time change, too; their forces, accelerations and reactions, and velocities that
        motions prescribe, are then those with which the run continues. At earlier times of the last step, and in snapshots taken before, they have the
        values of parameters of that time. If a value makes a formula jump in `Run.on_step` or in actions of events, call `Run.restart`: steps across a
        jump lose accuracy. Between two parts of a run `Run.solve` and `Run.step_by` do so by themselves. If prescribed displacements or user
        constraints depend on parameters, positions are then moved to the nearest that satisfy them.
        """
        values = {name: number(value, "parameter " + name) for name, value in values.items()}
        for name in sorted(values, key=lambda name: name in self._parameters):  # all or none are set: unknown names come first and raise an error
            self._core.set(name, values[name])

    def set_gravity(self, acceleration: Sequence[Any]) -> None:
        """Sets the acceleration of gravity, (3,) in space axes, which may contain formulas of parameters."""
        described = has_formula(acceleration, self, "gravity")
        begun = self._begun
        self._describe("gravity")
        self._begun = begun
        if described:
            acceleration = copied(acceleration)
        self._core.gravity(self._later(lambda: plain(acceleration)) if described else acceleration)

    def ground_acceleration(self, x=0., y=0., z=0.) -> None:
        """Base excitation: the ground's acceleration along the space axes, functions of time. All coordinates are relative to the ground."""
        keep, begun = [], self._begun
        self._describe("the ground's acceleration")
        self._begun = begun
        functions = [time_function(f, keep) for f in (x, y, z)]
        self._keeps(keep, "ground_acceleration()")
        self._core.ground_acceleration(*functions)

    def add(self, name: str, what: Union[Spec, Callable[[], Optional[Spec]]]) -> Any:
        """Adds a body, joint, motion or force.

        Parameters
        ----------
        name : str
            For messages and results; unique among bodies, or among elements. An empty name is replaced by one such as "body 7" or "spring damper
            3", which is the `name` of the returned object.
        what : RigidBody, PointMass, FlexibleBody, one of the elements, or a function without arguments that returns one
            A function is called again whenever parameters have changed. A function that describes an element may return None: the element then
            exists but does nothing. It must not make markers; its markers are made before. When a run continues another one, `run(after=)`,
            elements that count full turns or follow curves cannot be added or removed: couplers, gears, torsion springs, constraints of angles.
            Numbers that are formulas of parameters need no function.

        Returns
        -------
        Body or Element
        """
        text(name, "Scene.add()")
        if isinstance(what, Spec):
            name = name or self._unnamed(type(what))
            described, converted = self._converted(what, name)
            if described:
                what = copied(what)  # the caller may have changed it when parameters change
            given = self._later(lambda: what._fields(converted)) if described else what._fields(converted)
            self._keep.append((what, converted))
            return self._enter(name, what, given)
        if not callable(what):
            raise TypeError("Scene.add(%r): %r is no body, joint, motion or force" % (name, what))
        with describing():
            first = what()
        if first is None:
            raise TypeError("Scene.add(%r): the function must return a body or an element at first, then its kind is known" % name)
        name = name or self._unnamed(type(first))
        return self._enter(name, first, self._later(lambda: self._fields_of(what(), type(first), name)))

    def _unnamed(self, kind):
        """The name of a part for which none was given"""
        if issubclass(kind, (RigidBody, PointMass, FlexibleBody)):
            return "body %d" % self._bodies
        return "%s %d" % (re.sub("(?<=[a-z])(?=[A-Z])", " ", kind.__name__).lower(), self._elements)

    def _fields_of(self, what, kind, name):
        if what is None and not issubclass(kind, (RigidBody, PointMass, FlexibleBody)):
            return None
        if type(what) is not kind:
            raise TypeError("%s must be a %s again, is %r" % (name, kind.__name__, what))
        return what._fields(self._converted(what, name)[1])

    def _converted(self, what, name):
        """Whether a description depends on parameters, and its converted functions"""
        keep, who = [], "%s %s" % (type(what).__name__, name)
        described, converted = what._described(self, who), what._convert(keep, who)
        self._keeps(keep, who)
        if isinstance(what, (UserConstraint, RotationalMotion, TranslationalMotion)) and getattr(what, "of", "displacement") == "displacement":
            self._constraints_jump |= any(isinstance(x, Expression) and x.op == "parameter" for x in keep)
        return described, converted

    def _keeps(self, keep, who):
        """Checks parameters and stores references to the objects that formulas use"""
        check_parameters(keep, self, who)
        self._keep.extend(keep)

    def _formula(self, x, who):
        keep = []
        try:
            given = description(x, keep)
        except TypeError as error:
            raise TypeError("%s: %s" % (who, error)) from error
        self._keeps(keep, who)
        return given

    def _enter(self, name, what, given):
        self._describe(name)
        kind = type(what)
        for body, enter in ((RigidBody, self._core.rigid_body), (PointMass, self._core.point_mass), (FlexibleBody, self._core.flexible_body)):
            if issubclass(kind, body):
                self._bodies += 1
                return Body(self, enter(name, given), name)
        known = next((c.__name__ for c in kind.__mro__ if c.__name__ in ELEMENTS), None)
        if known is None:
            raise TypeError("Scene.add(%r): a %s is no body, joint, motion or force" % (name, kind.__name__))
        element = Element(self, self._core.element(known, name, given), name)
        self._elements += 1
        self._states += getattr(what, "of", None) == "acceleration"  # a prescribed acceleration adds a state, the speed of the motion
        return element

    def _later(self, function):
        def describe(*given):
            with describing():
                return function(*given)

        self._keep.append(describe)
        return describe

    def _marker(self, body, position, axes, name, at):
        self._describe()
        place = lambda: (plain(position), np.eye(3) if axes is None else plain(axes))
        who = "marker %s" % (name or "on " + body.name)
        described = any([has_formula(position, self, who + ": position"), has_formula(axes, self, who + ": axes")])
        if described:
            position, axes = copied(position), copied(axes)
        return Marker(self, self._core.marker(body, self._later(place) if described else place(), name, at), name or "on " + body.name)

    def rigid_body(self, name: str, **fields: Any) -> Body:
        """The same as ``add(name, RigidBody(**fields))``."""
        return self.add(name, RigidBody(**fields))

    def point_mass(self, name: str, **fields: Any) -> Body:
        """The same as ``add(name, PointMass(**fields))``."""
        return self.add(name, PointMass(**fields))

    def connect(self, name: str, joint: Type[Spec], i: Body, j: Body, point: Sequence[float], axis: Sequence[float] = (0., 0., 1.), **fields: Any) -> Element:
        """A joint of bodies i and j at a point of space; makes coincident markers on both bodies with z along an axis of space. For joints that
        are described by two such markers.

        >>> scene.connect("pin", hhtdae.Revolute, arm, scene.ground, (0, 0, 0), axis=(0, 0, 1))
        """
        if joint is Universal:
            raise TypeError("Scene.connect(%r): a Universal needs z axes that are perpendicular, and connect() makes them parallel: Scene.add(name, Universal(i.marker_at(point, axes_along(axis_i)), "
                            "j.marker_at(point, axes_along(axis_j))))" % name)
        _direction(axis, "Scene.connect(): axis")
        axes = axes_along(axis)
        return self.add(name, joint(i.marker_at(point, axes), j.marker_at(point, axes), **fields))

    def variable(self, name: str, definition: Formula, initial: float = 0.) -> Variable:
        """A user-defined variable: an unknown V = formula. Names are as in `add`."""
        name = text(name, "Scene.variable()") or "variable %d" % self._variables
        initial = number(initial, "variable %s: its initial value" % name)
        self._describe("variable " + name)
        variable = Variable(self, self._core.variable(name, self._formula(definition, "variable " + name), initial), name)
        self._variables += 1
        return variable

    def state(self, name: str, rate: Union[Formula, Callable[[Expression], Expression]], initial: float) -> State:
        """A first-order state: x' = formula. The formula may be a function of one argument, the value of the state: ``lambda x: -x``. Names are
        as in `add`."""
        name = text(name, "Scene.state()") or "state %d" % self._states
        initial = number(initial, "state %s: its initial value" % name)
        self._describe("state " + name)
        if callable(rate) and not isinstance(rate, Expression):
            own = State(self, (self._states, self.ground._number), name)
            rate = rate(Measure("state", target=own))
        state = State(self, self._core.state(name, self._formula(rate, "state " + name), initial), name)
        self._states += 1
        return state

    def states(self, names: Sequence[str], rates: Callable[[Sequence[Expression]], Sequence[Formula]], initial: Sequence[float]) -> List[State]:
        """Coupled first-order states, for example of an observer: x' = rates(x), with as many values as names:
        ``scene.states(["x", "v"], lambda x: [x[1], -4 * x[0]], [1., 0.])``."""
        names, initial = list(names), list(initial)
        values = [Measure("state", target=State(self, (self._states + k, self.ground._number), name)) for k, name in enumerate(names)]
        formulas = list(rates(values))
        if not len(names) == len(formulas) == len(initial):
            raise ValueError("states: %d names, %d rates, %d initial values, must be as many" % (len(names), len(formulas), len(initial)))
        initial = [number(x, "state %s: its initial value" % name) for name, x in zip(names, initial)]
        for name, formula in zip(names, formulas):
            self._formula(formula, "state " + name)
        return [self.state(*each) for each in zip(names, formulas, initial)]

    def channel(self, name: str, value: Formula, unit: str = "") -> None:
        """A result that runs record under a name: a measure, or a formula of measures and parameters; unit: for tables and plots."""
        name = text(name, "Scene.channel()") or "channel %d" % len(self._channels)
        self._describe("channel " + name)
        self._core.channel(name, self._formula(value, "channel " + name), unit)
        self._channels.append((name, unit))

    def line(self, *markers: Marker) -> None:
        """A line through markers in animations and pages, a spring for example."""
        self._describe("a line")
        self._core.line(list(markers))

    def start(self, **policy):
        """Sets how runs made from now on start; options of the command line and of `run` have precedence. Existing runs do not change. If the
        settings differ from those of the last run, the next run sets the scene up again.

        Parameters
        ----------
        assembly : {"report", "off", "project"}
            What happens with initial values that violate the constraints. "report": an error that names the elements; "off": nothing, the option
            ``ts_hhtdae_start`` of the run determines it; "project": positions and velocities are moved to the nearest consistent ones in the
            metric of the masses. First all bodies move as rigid ones. If this is not sufficient, as for a press fit or a motion that drives one
            end of a clamped beam, flexible bodies deform when the run is made: velocities become those after a plastic impact, and bodies, most
            of all whole ones, are strained near the attachments until `Run.equilibrium` relaxes them. A whole finite-element body
            (`hhtdae.flexible.FullFeBody`) is not moved as a rigid one: its attachments move to satisfy joints and motions, while its other nodes
            keep positions and velocities given by ``FullBody(position=, velocity=, angular_velocity=)``, so that it is strained and vibrates
            unless these satisfy the joints. Bodies with ``fixed_start`` do not move; joints of mechanisms that contain one are satisfied by rigid
            motions only.
        tolerance : float
            Largest accepted violation: radians for angles, relative to the size of the largest mechanism (bodies connected by joints, and their
            markers) for lengths.
        redundant : {"drop", "refuse", "keep"}
            What happens with redundant constraints.
        equilibrium : bool
            The run starts at rest in static equilibrium, in which friction holds nothing, see `Run.equilibrium`.
        view : bool
            Whether the results of the start are printed.
        time : float
            Time of the initial values.
        rotations : {"local", "euler313"}
            Coordinates of the rotations of bodies in space.
        angle_tol : float
            Tolerance of the error test for rotations, radians; 0: the tolerance of the run, as for lengths, which is too small a number for
            angles if lengths are small numbers in their unit.
        """
        chosen = self._choose(self._start, policy, "start", assembly=("report", "off", "project"), redundant=("drop", "refuse", "keep"), rotations=("local", "euler313"))
        self._core.start(*[chosen[k] for k in ("assembly", "redundant", "rotations", "equilibrium", "view", "tolerance", "time", "angle_tol")])
        self._start = chosen

    def output(self, **settings):
        """Sets files of results, in addition to the channels that runs keep in memory.

        Parameters
        ----------
        file, csv : str
            Files of the channels in HDF5, and as a CSV table.
        dt : float
            Time between samples; 0: the end of every step.
        animation : str
            Prefix of the animation's files for ParaView.
        animation_dt : float
            Time between frames; 0: the end of every step.
        balance : bool or str
            Energy and momentum at every step: True: printed; a name: written to this file.
        page : str
            HTML file that shows the run in three dimensions, with its channels, in any browser.
        page_title : str
            Default: the file's name.
        page_dt : float
            Time between frames of the page; 0: `page_frames` frames up to the end time of the first `Run.solve`.
        page_frames, page_nodes : int
            Number of frames, and largest number of nodes shown of whole finite-element bodies.
        """
        chosen = self._choose(self._output, settings, "output")
        self._set_page(chosen)
        self._core.output(*[chosen[k] for k in ("file", "csv", "dt", "animation", "animation_dt", "balance")])
        self._output = chosen

    def _set_page(self, output):
        self._core.page(*[output[k] for k in ("page", "page_title", "page_dt", "page_frames", "page_nodes")])

    @staticmethod
    def _choose(present, given, what, **choices):
        """The present settings updated by the given ones, which must have the same types; an error changes nothing"""
        chosen = dict(present)
        for name, value in given.items():
            whole = "%s(): %s" % (what, name)
            if name not in present:
                raise TypeError("%s(): %r is not known, there are %s" % (what, name, ", ".join(present)))
            if name in choices and value not in choices[name]:
                raise ValueError("%s is %r, must be one of %s" % (whole, value, ", ".join(choices[name])))
            kind = type(present[name])
            if isinstance(value, np.bool_):
                value = bool(value)
            if name == "balance":
                kind = (bool, str)
                value = os.fspath(value) if isinstance(value, os.PathLike) else value
            elif kind is float:
                value = number(value, whole)
                if name != "time" and not 0 <= value < np.inf:
                    raise ValueError("%s is %g, must not be negative, and finite" % (whole, value))
            elif kind is str:
                value = os.fspath(value) if isinstance(value, os.PathLike) else value
            elif kind is int:
                value = operator.index(value) if hasattr(value, "__index__") and not isinstance(value, bool) else value
            if kind is not float and not isinstance(value, kind):
                raise TypeError("%s is %r, must be %s" % (whole, value, {str: "a string", int: "a whole number", bool: "True or False"}.get(kind, "True, False or a string")))
            chosen[name] = value
        return chosen

    @property
    def channels(self) -> List[Tuple[str, str]]:
        """Names and units of the channels, in their order."""
        return list(self._channels)

    # ---- runs ----

    @one_thread
    def set_up(self) -> None:
        """Checks and assembles the scene; without this call the first run does it. Collective."""
        self._core.set_up()
        self._fixed = True

    def run(self, tolerance: Optional[float] = None, sample: Optional[float] = 0., after: Optional[Run] = None,
            options: Optional[Dict[str, Any]] = None, page: Union[bool, str] = False) -> Run:
        """A run that has not begun: see `Run`. Collective.

        Parameters
        ----------
        tolerance : float, optional
            Tolerance of the error of positions in every step, in the unit of length and radians; for each coordinate it is multiplied by max(1,
            its own largest size so far) (PETSc's default: 1e-4). Motions smaller than the tolerance are not resolved: if all motions are of
            micrometres, in metres, or a contact a hundred metres from the origin deforms by millimetres, a correspondingly smaller tolerance is required. Rotations are tested
            with the same number, in radians: if lengths are small numbers in their unit, set a separate tolerance of angles,
            ``scene.start(angle_tol=1e-6)``; otherwise the run may need a hundred times as many steps.
        sample : float or None
            Time between samples of the channels, at its multiples and the start; 0: the end of every step, which costs nothing; None: nothing is recorded. Accelerations and reactions
            within steps are usually more accurate than those at the ends, but not with fast, weakly damped modes, above all of flexible bodies,
            see `Snapshot`. Sample these at the ends of steps, or use a smaller tolerance.
        after : Run, optional
            The new run continues from the present state of that run, with the present values of parameters. What elements have taken from the start
            (the length of a `PointDistance`, the value that a gear, rack, coupler, screw or mesh keeps) stays as it is; of a `PointDistance`
            that comes, and of a coupler or mesh whose ratio, radius, factors or pitch have changed, it is that of the present positions, so that
            none of these moves a body. Velocities change as in a plastic impact.
        options : dict, optional
            PETSc's options without the dash, ``{"ts_adapt_type": "none", "ts_dt": 1e-3}``, for this run only; options of the command line have
            precedence. Fixed steps, as in this example, must be short enough for angles over full turns, see `angle`.
        page : bool or str
            Whether frames for `Run.page` are recorded; a string is the name of the file, otherwise it is a temporary one. Title, and number of
            frames or time between them, are those of `output`.
        """
        return Run(self, tolerance, sample, after, options, page)

    def solve(self, until: float, tolerance: Optional[float] = None, sample: Optional[float] = 0., options: Optional[Dict[str, Any]] = None,
              page: Union[bool, str] = False) -> Run:
        """A run from the start to the time `until`: ``scene.run(...).solve(until)``."""
        return self.run(tolerance, sample, None, options, page).solve(until)

    def view(self, file: str = "") -> None:
        """Prints the contents of the scene, its degrees of freedom and redundant constraints, or writes them to a file. Collective."""
        self._core.set_up()
        self._fixed = True
        self._core.view(self.comm, file)
