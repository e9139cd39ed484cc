"""Multibody scenes: the description, of which runs are made."""

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
from .joints import RotationalMotion, TranslationalMotion, UserConstraint
from .measures import Measure, description
from .run import Run
from .recipe import Recipe
from .spec import Formula, Spec, check_parameters, copied, has_formula, number, plain, text
from .threads import one_thread
from .tracing import time_function

__all__ = ["Body", "Element", "Marker", "Scene", "State", "Variable"]


class _Handle:
    """Refers to a part of a scene; its name is what results and messages call it"""

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
        """Where the scene has come from another process: scenes are numbered anew there"""
        return cls(scene, (number, scene.ground._number), name)


class Body(_Handle):
    """A body of a scene, the ground, or the frame of an attachment. `name` is what results and messages call it."""

    __slots__ = ()
    _kind = "body"

    def marker(self, position: Sequence[float] = (0., 0., 0.), axes: Any = None, name: str = "") -> "Marker":
        """A marker on the body; position and axes (columns) in body axes from the body's origin; of the ground in space axes."""
        return self._scene._marker(self, position, axes, name, False)

    def marker_at(self, position: Sequence[float], axes: Any = None, name: str = "") -> "Marker":
        """The same, given where it is at the start, in space axes."""
        return self._scene._marker(self, position, axes, name, True)

    def attachment(self, name: str) -> "Body":
        """The frame of an attachment of a flexible body: a body for markers and shapes. It has no unknowns."""
        self._scene._describe()
        return Body(self._scene, self._scene._core.attachment(self, name), "%s.%s" % (self.name, name))

    def node(self, label: int) -> "Body":
        """The same at a node that the reduction has kept, by its number in the FE model."""
        self._scene._describe()
        return Body(self._scene, self._scene._core.node(self, label), "%s.node %d" % (self.name, label))

    def shape(self, shape: Shape) -> "Body":
        """Draws the body in animations and pages."""
        if not isinstance(shape, Shape):
            raise TypeError("a shape of %s is %r, must be Shape.box(half), Shape.cylinder(radius, length) or Shape.sphere(radius)" % (self.name, shape))
        self._scene._describe("a shape of %s" % self.name)
        self._scene._core.shape(self, shape.kind, shape.size, shape.position, shape.axes, shape._rgb())
        return self

    def surface(self, body: Any, stress_unit: str = "") -> "Body":
        """Draws a flexible body in pages by the surface of its mesh, deformed, and coloured by stress where the `hhtdae.flexible.ReducedBody` has stress
        modes; it must have kept its elements and the modes at all nodes, and be on one rank or on those of the scene. Collective."""
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

    Units are the user's own, but consistent; angles are in radians. What is wrong with a scene is reported by name, all of it at once, when its first
    run is made. Under MPI every rank describes the same scene in the same order.

    Parameters
    ----------
    gravity : (3,), optional
        Acceleration of gravity, space axes; formulas of parameters have to be given by `set_gravity`.
    planar : bool
        Bodies move in the xy plane: 3 coordinates, position and angle about z. Forces along z and moments about x and y are none: constants of a `UserForce` that say
        otherwise are an error, about gravity along z a notice is printed.
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
        self._keep = [self.comm]  # what the C++ part refers to and does not own: callbacks and functions that describe
        self._channels = []
        self._parameters = {}
        self._states = self._bodies = self._elements = self._variables = 0
        self._moving = []  # numbers of bodies in the scene, and whether they are flexible
        self._gravity = (0., 0., 0.)
        self._begun = False  # whether there is more than parameters
        self._edits = 0  # calls that have described something
        self._constraints_jump = False  # whether positions that constraints ask for depend on parameters
        self._fixed = False  # from the first set-up that has succeeded
        self._recipe: Optional[Recipe] = None
        self._start = dict(assembly="report", redundant="drop", rotations="local", equilibrium=False, view=False, tolerance=1e-6, time=0., angle_tol=0.)
        self._output = dict(file="", csv="", dt=0., animation="", animation_dt=0., balance=False, page="", page_title="", page_dt=0.,
                            page_frames=500, page_nodes=6000)
        self.ground = Body(self, self._core.ground(), "ground")
        if gravity is not None:
            self.set_gravity(gravity)

    def _describe(self, late=None):
        """Every call that describes something begins with this; `late`: what it is called where it can only come before the set-up"""
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
        """A number that may be another one in the next run. Parameters come before everything else but gravity and `ground_acceleration`. Returns a `Parameter`, which
        stands for a number anywhere in the description. Its name is one that no other parameter has."""
        if self._begun:
            raise ValueError("parameter %s came too late: parameters are made before everything else but gravity and the ground's acceleration" % name)
        text(name, "Scene.parameter()")
        self._edits += 1
        self._parameters[name] = p = Parameter(self, name, self._core.parameter(name, number(value, "parameter " + name)))
        return p

    def set(self, **values: float) -> None:
        """Gives parameters other values. Collective.

        What the description was made of counts for runs that are made from now on; runs that were made before keep what they had. Formulas of the state and callbacks,
        which read parameters as they are evaluated, follow at once, in all runs: runs side by side with different values there need scenes of their own.
        So do `Run.snapshot`, `Run.sample` and `Run.linearize` at the present time, whose forces, accelerations and reactions are then those with which the run goes on.
        Between parts of a run, in `Run.on_step` and in actions of events where a value makes a formula jump call `Run.restart`: steps across a jump lose accuracy.
        `Run.step_by` does so by itself. Where motions of displacement or user constraints depend on parameters, positions are moved there to the nearest that meet them.
        """
        values = {name: number(value, "parameter " + name) for name, value in values.items()}
        for name in sorted(values, key=lambda name: name in self._parameters):  # all or none: one that there is not is an error before others are set
            self._core.set(name, values[name])

    def set_gravity(self, acceleration: Sequence[Any]) -> None:
        """Acceleration of gravity, (3,) in space axes; it may have formulas of parameters."""
        described = has_formula(acceleration, self, "gravity")
        begun = self._begun
        self._describe("gravity")
        self._begun = begun
        if described:
            acceleration = copied(acceleration)
        self._core.gravity(self._later(lambda: plain(acceleration)) if described else acceleration)
        self._gravity = acceleration

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
            For messages and results. It is one that no other body, or no other element, has; an empty one becomes "body 7", "spring damper 3", which is the `name` of
            what is returned.
        what : RigidBody, PointMass, FlexibleBody, one of the elements, or a function without arguments that returns one
            A function is called again whenever parameters have changed. One of an element may return None: the element has its place, and nothing
            acts; its markers are made outside of it, as others are an error. Within a run, `run(after=)`, elements that count angles over full turns or follow curves
            cannot come or go: couplers, gears, torsion springs, constraints of angles. Numbers that are formulas of parameters need no function.

        Returns
        -------
        Body or Element
        """
        text(name, "Scene.add()")
        if isinstance(what, Spec):
            name = name or self._unnamed(type(what))
            described, converted = self._converted(what, name)
            if described:
                what = copied(what)  # the caller's may be another one when parameters change
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
        """What a part without a name is called"""
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
        """Whether it depends on parameters, and its functions"""
        keep, who = [], "%s %s" % (type(what).__name__, name)
        described, converted = what._described(self, who), what._convert(keep, who)
        self._keeps(keep, who)
        if isinstance(what, (UserConstraint, RotationalMotion, TranslationalMotion)) and getattr(what, "of", "displacement") == "displacement":
            self._constraints_jump |= any(isinstance(x, Expression) and x.op == "parameter" for x in keep)
        return described, converted

    def _keeps(self, keep, who):
        """Keeps what formulas refer to"""
        check_parameters(keep, self, who)
        self._keep.extend(keep)

    def _formula(self, x, who):
        keep = []
        given = description(x, keep)
        self._keeps(keep, who)
        return given

    def _enter(self, name, what, given):
        self._describe(name)
        kind = type(what)
        for body, enter in ((RigidBody, self._core.rigid_body), (PointMass, self._core.point_mass), (FlexibleBody, self._core.flexible_body)):
            if issubclass(kind, body):
                self._bodies += 1
                added = Body(self, enter(name, given), name)
                self._moving.append((added._id, name, body is FlexibleBody))
                return added
        known = next((c.__name__ for c in kind.__mro__ if c.__name__ in ELEMENTS), None)
        if known is None:
            raise TypeError("Scene.add(%r): a %s is no body, joint, motion or force" % (name, kind.__name__))
        element = Element(self, self._core.element(known, name, given), name)
        self._elements += 1
        self._states += getattr(what, "of", None) == "acceleration"  # a motion that is given by its acceleration has a state, its speed
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
        """A joint of bodies i and j at a point of space, with markers on both, z along an axis of space: for all joints that two markers alike describe.

        >>> scene.connect("pin", hhtdae.Revolute, arm, scene.ground, (0, 0, 0), axis=(0, 0, 1))
        """
        _direction(axis, "Scene.connect(): axis")
        axes = axes_along(axis)
        return self.add(name, joint(i.marker_at(point, axes), j.marker_at(point, axes), **fields))

    def variable(self, name: str, definition: Formula, initial: float = 0.) -> Variable:
        """A user-defined variable: an unknown V = formula. Names are as of `add`."""
        name = text(name, "Scene.variable()") or "variable %d" % self._variables
        initial = number(initial, "variable %s: its initial value" % name)
        self._describe("variable " + name)
        variable = Variable(self, self._core.variable(name, self._formula(definition, "variable " + name), initial), name)
        self._variables += 1
        return variable

    def state(self, name: str, rate: Union[Formula, Callable[[Expression], Expression]], initial: float) -> State:
        """A first-order state: x' = formula. The formula may be a function of one argument, of which it gets the state's own value: ``lambda x: -x``. Names are as of `add`."""
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
        """States that refer to one another, as those of an observer: x' = rates(x), of as many values as there are names:
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
        """A result that runs record under a name: a measure, or a formula of measures and parameters, with the unit for tables."""
        text(name, "Scene.channel()")
        self._describe("channel " + name)
        self._core.channel(name, self._formula(value, "channel " + name), unit)
        self._channels.append((name, unit))

    def line(self, *markers: Marker) -> None:
        """A line through markers in animations and pages, a spring for example."""
        self._describe("a line")
        self._core.line(list(markers))

    def start(self, **policy):
        """How runs start that are made from now on; options of the command line and those of `run` come after it. Runs that were made before keep what they had; where
        it is another start than that of the last run, the next one sets the scene up again.

        Parameters
        ----------
        assembly : {"report", "off", "project"}
            About initial values that violate the constraints: an error that names the elements; nothing, they are left to the run's own start (option
            ``ts_hhtdae_start``); or "project": bodies and velocities move to the nearest consistent ones in the metric of the masses. Bodies move as rigid ones
            first. What rigid motions cannot meet, a press fit or a motion that drives one end of a clamped beam, flexible bodies deform for when the run is
            made: velocities become those after a plastic impact, positions are strained near the attachments, most in whole bodies, until
            `Run.equilibrium` relaxes them. A whole finite-element body (`hhtdae.flexible.FullFeBody`) is not moved as a rigid one: attachments go where joints and
            motions want them, and its other nodes stay where, and as fast as, ``FullBody(position=, velocity=, angular_velocity=)`` has put them, so that it is strained
            and vibrates unless these meet the joints. ``fixed_start`` holds a body; joints that hang together with one are met by rigid motions alone.
        tolerance : float
            Of misfits, times the size of the largest mechanism (bodies that joints hang together, and their markers) for lengths; radians.
        redundant : {"drop", "refuse", "keep"}
            About constraints that say the same thing twice.
        equilibrium : bool
            The run starts at rest in static equilibrium.
        view : bool
            Prints what the start has done.
        time : float
            Of the initial values.
        rotations : {"local", "euler313"}
            Coordinates of the rotations of bodies in space.
        angle_tol : float
            Of the error test for rotations, radians; 0: the tolerance of the run, as of lengths, which in small units is too small a number for angles.
        """
        chosen = self._choose(self._start, policy, "start", assembly=("report", "off", "project"), redundant=("drop", "refuse", "keep"), rotations=("local", "euler313"))
        self._core.start(*[chosen[k] for k in ("assembly", "redundant", "rotations", "equilibrium", "view", "tolerance", "time", "angle_tol")])
        self._start = chosen

    def output(self, **settings):
        """Files of results, beside what runs keep in memory.

        Parameters
        ----------
        file, csv : str
            Channels in HDF5, and as a table.
        dt : float
            Between samples; 0: the end of every step.
        animation : str
            Prefix of the animation's files for ParaView.
        animation_dt : float
            Between frames; 0: every step.
        balance : bool or str
            Energy and momentum at every step: printed, or into a file.
        page : str
            HTML file that shows the run in three dimensions, with its channels, in any browser.
        page_title : str
            Default: the file's name.
        page_dt : float
            Between its frames; 0: `page_frames` of them up to the time that `Run.solve` first goes to.
        page_frames, page_nodes : int
            Frames, and nodes that are shown of whole finite-element bodies, at most.
        """
        chosen = self._choose(self._output, settings, "output")
        self._set_page(chosen)
        self._core.output(*[chosen[k] for k in ("file", "csv", "dt", "animation", "animation_dt", "balance")])
        self._output = chosen

    def _set_page(self, output):
        self._core.page(*[output[k] for k in ("page", "page_title", "page_dt", "page_frames", "page_nodes")])

    @staticmethod
    def _choose(present, given, what, **choices):
        """What is present with what is given, of the types that are present; what is refused changes nothing"""
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
        """Checks and assembles the scene; the first run does it otherwise. Collective."""
        self._core.set_up()
        self._fixed = True

    def run(self, tolerance: Optional[float] = None, sample: Optional[float] = 0., after: Optional[Run] = None,
            options: Optional[Dict[str, Any]] = None, page: Union[bool, str] = False) -> Run:
        """A run that has not begun: see `Run`. Collective.

        Parameters
        ----------
        tolerance : float, optional
            Of the error of positions in every step, in their units and radians, times the largest of one and what the coordinates reach (PETSc's default: 1e-4).
            Where everything moves by micrometres, in metres, or where a contact a hundred metres away gives way by millimetres, it has to be as much smaller, or
            what is smaller than the tolerance is not there. Rotations are tested with the same number, in radians: where lengths are small in their unit give them
            a tolerance of their own, ``scene.start(angle_tol=1e-6)``, or steps are a hundred times as many as they need be.
        sample : float or None
            Time between samples of the channels, at its multiples and the start; 0: the end of every step, which costs nothing; None: nothing is recorded. Accelerations and reactions
            within steps are more accurate than those at their ends, as a rule, but not with fast modes that hardly anything damps, of flexible bodies
            above all: see `Snapshot`. Those are better sampled at the ends of steps, or with a smaller tolerance.
        after : Run, optional
            The run goes on where that one is, with parameters as they are now.
        options : dict, optional
            PETSc's options without the dash, ``{"ts_adapt_type": "none", "ts_dt": 1e-3}``, for this run alone; those of the command line win.
        page : bool or str
            Records frames for `Run.page`; a string names the file that they are written to, else it is a temporary one. Title, and number of frames or
            time between them, are those of `output`.
        """
        return Run(self, tolerance, sample, after, options, page)

    def solve(self, until: float, tolerance: Optional[float] = None, sample: Optional[float] = 0., options: Optional[Dict[str, Any]] = None,
              page: Union[bool, str] = False) -> Run:
        """A run from the start to the time `until`: ``scene.run(...).solve(until)``."""
        return self.run(tolerance, sample, None, options, page).solve(until)

    def view(self, file: str = "") -> None:
        """Prints what the scene has, degrees of freedom and redundant constraints, or writes it into a file. Collective."""
        self._core.set_up()
        self._fixed = True
        self._core.view(self.comm, file)
