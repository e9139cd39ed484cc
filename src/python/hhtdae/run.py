"""Runs of a scene: everything that changes."""

import os
import re
import shutil
import tempfile
import warnings
import weakref
from contextlib import contextmanager
from typing import Any, Callable, Dict, Iterator, Optional, Union

import numpy as np
from petsc4py import PETSc

from . import _core, integrator
from ._errors import Error
from .events import Signs, identity, of_positions
from .expressions import CONDITIONS, _expression
from .ranks import together
from .query import Linearization, Snapshot
from .results import Channels, Page, Results
from .spec import check_measures, check_parameters, number
from .threads import one_thread
from .tracing import ordered

__all__ = ["Run"]


class _Given:
    """Options that are temporarily in PETSc's database, and which of them have been queried"""

    def __init__(self):
        self.values, self.used = {}, set()

    def put(self):
        for name, value in self.values.items():
            PETSc.Options().setValue(name, value)

    def take(self):
        for name in self.values:
            if _core.option_used(name):
                self.used.add(name)
            PETSc.Options().delValue(name)


_given = []  # nested temporary options, the innermost last


def _named(error, values):
    """An error of PETSc about the value of an option, with the option's name, which PETSc does not tell"""
    found = re.match("Input string (.*) has no ", error.message)
    names = ["-" + name for name, value in values.items() if found and str(value) == found[1]]
    return Error(error.ierr, "option %s: %s" % (" or ".join(names), error.message), error.trace) if names else error


@contextmanager
def temporary_options(given):
    """A context in which PETSc's database contains the given options; options that the user has set have precedence. Yields a list that, after
    the context, has the names of those that were not queried. If the context is entered by a callback of a run, the temporary options of that run
    are removed meanwhile."""
    own, unused, outer = _Given(), [], _given[-1] if _given else _Given()
    outer.take()
    _given.append(own)
    try:
        own.values = {n: x for n, x in ((name.lstrip("-"), x) for name, x in (given or {}).items()) if not PETSc.Options().hasName(n)}
        own.put()
        yield unused
    except Error as error:
        raise _named(error, own.values) from error.__cause__
    finally:
        own.take()
        unused.extend(name for name in own.values if name not in own.used)
        _given.pop()
        outer.put()


def tell_unused(names, level):
    """Warns of given options that were not queried, usually misspelt ones"""
    if names:
        warnings.warn("nobody has asked for the options %s: are their names right?" % ", ".join("-" + name for name in names), RuntimeWarning, level + 1)


def positive(x, name):
    """A positive number as a float"""
    if isinstance(x, bool) or not isinstance(x, (int, float, np.number)) or not 0 < x < np.inf:
        raise ValueError("%s is %r, must be a positive number" % (name, x))
    return float(x)


def collect_garbage(comm):
    """Destroys PETSc's objects of a communicator that Python has released: petsc4py keeps them until all ranks call this, since Python's
    garbage collector does not run at the same time on all ranks. Collective."""
    if hasattr(PETSc, "garbage_cleanup"):
        PETSc.garbage_cleanup(comm)


class Run(Channels):
    """A run of a scene, made by `Scene.run` or `Scene.solve`.

    Its PETSc time stepper is `ts`, a TS of petsc4py: ``run.ts.getSNES().getKSP()``. Channels are arrays by name: ``run["tip"]`` at
    the times ``run.times``. Runs are independent of each other and of later changes of their scene. As a context manager the run is closed at the
    end of the block, which frees its memory; the memory of a run without references is freed when the next run is made. Its `results` can be
    pickled; a pickled run is unpickled as its results.

    On several ranks an exception of a callback, an event's action or an `on_step` function on one rank ends the run on all ranks: that rank
    raises it, the others raise `Error` with its text. Functions that call collective methods must do so on all ranks. An exception that a script
    does not catch ends all ranks.

    PETSc is for one thread at a time: while one thread makes, solves or queries a run, doing so in another thread, with this run or any other, is
    a RuntimeError. Callbacks of a run are called in its thread. For parallel runs use processes, ``multiprocessing.Pool().map(job, values)``.

    Attributes
    ----------
    ts : petsc4py.PETSc.TS
    scene : Scene
    """

    @one_thread
    def __init__(self, scene, tolerance=None, sample=0., after=None, options=None, page=False):
        self.scene, self.ts, self._recorder, self._left = scene, None, None, None
        self._signature = list(scene._channels)
        self._page = _PageFile(scene, page)
        if sample is not None and not number(sample, "sample") >= 0:
            raise ValueError("sample is %r, must be the time between samples, 0 for the end of every step, or None" % (sample,))
        if tolerance is not None:
            tolerance = positive(tolerance, "tolerance")
        self._options, self._events, self._signs, self._passed = dict(options or {}), [], Signs(), []
        self._now = None  # a snapshot with which formulas of events are evaluated
        self._before, self._numbers = None, None  # state, and parameters, at the last event before its actions, or where the run was continued
        self._resumed = None  # numbers of _keep_signs() of the run that this one continues, until it goes on
        self._ended = False  # whether a terminal event has ended the last solve()
        self._serial = 0  # number of calls of TSSolve(); each calls monitors with its initial state first
        self._solving = False  # whether solve() is running: its callbacks must neither solve nor close the run
        collect_garbage(scene.comm)
        with temporary_options(self._options) as self._unused:
            self.ts = scene._core.create_ts(after._open() if after is not None else None)
            scene._fixed = True
            self.ts.setAttr("hhtdae", scene._keep)
            if tolerance is not None:
                self.ts.setTolerances(rtol=tolerance, atol=tolerance)
            self.ts.setMaxSteps(2**31 - 1)
            if sample is not None and scene._channels:
                self._recorder = _core.Recorder(scene._core, float(sample))
                self._recorder.attach(self.ts)
            else:
                _core.attach_signals(self.ts)
            _core.set_from_options(self.ts)
        if after is not None and after._events:
            self._resumed = [0.] + after._signs.numbers()
            if after._changed():
                self._resumed = [0.] + after._signs.numbers(lambda k: of_positions(after._events[k][0]))
                self._signs.within = Signs.largest_return
            self._note_state()

    def _open(self):
        if not self.ts:  # the TS may also have been destroyed by the user
            raise ValueError("the run has been closed")
        return self.ts

    def _not_solving(self, call):
        if self._solving:
            raise RuntimeError("%s(): the run is being solved, and is at t = %g; events, on_step() and callbacks cannot do this to it: do it after solve(), or "
                               "between the parts of step_by()" % (call, self.time))

    @one_thread
    def solve(self, until: float) -> "Run":
        """Continues the run to the time `until`; returns the run. If `Scene.set` has changed parameters since the last `solve`, the integrator
        restarts. Collective. Ctrl-C ends it with KeyboardInterrupt after the present step."""
        self._not_solving("solve")
        ts = self._open()
        until = number(until, "solve(): until")
        if not until < np.inf:
            raise ValueError("solve(): until is %r, must be finite: the time at which the run ends at the latest, where an event is to end it" % until)
        if not until >= ts.getTime():
            raise ValueError("the run is at t = %g and cannot go back to %g" % (ts.getTime(), until))
        if until == ts.getTime():
            return self
        ts.setMaxTime(until)
        self._ended, self._solving = False, True
        try:
            with temporary_options(self._options) as unused, self._page.settings():
                self._solve_to_events()
        finally:
            self._solving = False
        if self._unused:
            tell_unused([name for name in unused if name in self._unused], 3)
            self._unused = []
        reached = self._open().getTime()
        if reached < until and ts.getConvergedReason() == PETSc.TS.ConvergedReason.CONVERGED_ITS:
            warnings.warn("the run has ended at t = %g before %g: it has made the largest number of steps, -ts_max_steps" % (reached, until), RuntimeWarning, 3)
        elif ts.getConvergedReason() < 0:  # with -ts_error_if_step_fails 0
            warnings.warn("the run has failed at t = %g, before %g" % (reached, until), RuntimeWarning, 3)
        return self

    def step_by(self, dt: float, until: float) -> Iterator[float]:
        """Continues the run to `until` in intervals of dt, and yields the time after each of them. A controller may change parameters in between;
        the integrator then restarts, as between two calls of `solve`, from the nearest positions that satisfy prescribed displacements and user
        constraints with the new values. A terminal event ends the iteration after the time of the event.

        >>> for t in run.step_by(0.01, until=5):
        ...     torque.set(-gain * run.snapshot().value(error))
        """
        begin, dt, until = self._open().getTime(), positive(dt, "dt"), number(until, "step_by(): until")
        if not begin <= until < np.inf:
            raise ValueError("the run is at t = %g and cannot go to %r in parts" % (begin, until))
        self._page.span = until - begin
        count = int(np.ceil((until - begin) / dt * (1 - 1e-12)))
        for k in range(1, count + 1):
            end = until if k == count else begin + k * dt
            self.solve(end)
            yield self.time
            if self._ended or self.time < end:
                return

    def event(self, formula, action: Any = None, terminal: bool = False, direction: int = 0) -> None:
        """Calls `action` when a formula passes through zero. Passages are found by the signs at both ends of each step: two passages within one
        step are not found, so limit the step by the option -ts_adapt_dt_max. The step is shortened to end at the passage, where the integrator
        restarts. Velocities that violate joints are removed as in a plastic impact, unless the option -ts_hhtdae_start is given. Channels, files
        and `on_step` functions treat the passage as the end of a step, before the action. A velocity that jumps through zero because of an action
        is not a passage.

        Parameters
        ----------
        formula : Expression
            A measure, or a formula of measures; a condition such as ``x < 0.3`` passes upwards when it becomes true. Full turns of an `angle`
            that no element and no channel reads between the same two markers are counted from the time of this call on or later: make a channel
            of it. By its formula and direction an event is recognized in a run that continues this one, by `load` or ``Scene.run(after=)``: it
            does not find again what has been found.
        action : callable, optional
            action(run) is called at each passage; it may change parameters, or velocities: see `set_velocity`. If it changes the behaviour of a
            callback, it has to call `restart`.
        terminal : bool
            Whether the run ends at the passage.
        direction : {0, 1, -1}
            0: all passages, 1: only upwards, -1: only downwards.
        """
        if direction not in (-1, 0, 1):
            raise ValueError("event(): direction is %r, must be 0, 1 or -1" % (direction,))
        if action is not None and not callable(action):
            raise TypeError("event(): action is %r, must be a function of the run" % (action,))
        formula = _expression(formula)
        if formula.op in CONDITIONS:
            formula = formula - 0.5
        check_parameters(ordered([formula]), self.scene, "event()")
        check_measures(ordered([formula]), self.scene, "event()")
        self._events.append((formula, action, terminal))
        self._signs.add(direction, identity(formula, direction))
        if len(self._events) == 1:
            self._now = Snapshot(self, later=True)
            self._open().setPostStep(_look_of(weakref.ref(self)))
            if self.steps:
                self._project_restarts()

    def _event_value(self, k, time):
        self._now.take(time)
        value = together(self.scene.comm, self._now.value, self._events[k][0])
        if value != value:
            raise ValueError("event %d: its formula is not a number (NaN) at t = %.9g" % (k, time))
        return value

    def _look(self, ts):
        """Called after a step, before the monitors: if a formula passes zero, the TS is moved back to the first passage, and TSSolve() ends. So
        outputs have a step that ends there."""
        self._passed = self._signs.passed(ts.getPrevTime(), ts.getTime(), self._event_value)
        self._keep_signs(False)
        if self._passed:
            integrator.move_back(ts, self._passed[0][0])
            ts.setConvergedReason(PETSc.TS.ConvergedReason.CONVERGED_USER)

    def _present_parameters(self):
        return [p.get() for p in self.scene._parameters.values()]

    def _note_state(self):
        state = self._open().getSolution2()
        if self._before is None:
            self._before = [x.duplicate() for x in state]
        for x, y in zip(state, self._before):
            x.copy(y)
        self._numbers = self._present_parameters()

    def _changed(self):
        """Whether the state or a parameter has changed since the last event"""
        if self._numbers is None or self._numbers != self._present_parameters():
            return True
        return not all([x.equal(y) for x, y in zip(self._open().getSolution2(), self._before)])

    def _keep_signs(self, changed):
        """Gives the run what its checkpoints have to know of events: whether state or parameters have changed since the last one, and `Signs`"""
        _core.set_notes(self._open(), [float(changed)] + self._signs.numbers())

    def _resume_events(self):
        """Takes over what another run knew of the events that have been added meanwhile"""
        if self._resumed is None:
            return
        changed, *numbers = self._resumed or [1.]
        self._resumed = None
        self._signs.resume(numbers)
        if changed:
            self._numbers = None

    def _solve_to_events(self):
        """Solves from event to event; the first event may be added by a callback during the solve"""
        self._resume_events()
        while True:
            ts = self._open()  # an action may have destroyed it
            if self._events:
                changed = self._changed()
                if changed:
                    self._signs.changed()
                self._keep_signs(changed)
            self._passed = []
            self._serial += 1
            self.scene._core.solve(ts)
            self._project_restarts()
            if not self._passed or ts.getTime() < self._passed[0][0]:  # or the passage is after a final time that was interpolated
                return
            time = self._passed[0][0]
            here = [k for t, k in self._passed if t == time]
            self._note_state()
            for k in here:
                self._signs.note(k, time)
                if self._events[k][1] is not None and self._signs.last[k][1] < 1e-12 * abs(time):  # Bounces.test_without_end
                    raise RuntimeError("event %d comes again and again at t = %.9g, in times that rounding cannot tell apart: let its action hold what it throws back, or make it terminal" % (k, time))
                if self._events[k][1] is not None:
                    together(self.scene.comm, self._events[k][1], self)
            self._ended = any(self._events[k][2] for k in here)
            if self._ended or time >= self._open().getMaxTime():
                return

    def _project_restarts(self):
        """Makes restarts project the initial values: interpolated velocities at an event satisfy the constraints only up to the tolerance of the
        step, and positions do not satisfy a constraint whose parameter has been changed. This is done for all restarts of a run with events or
        such constraints that has begun, so that a run resumed from a checkpoint continues as the original one: test Checkpoints of test_events.py."""
        if (self._events or self.scene._constraints_jump) and not self._start_is_chosen():
            integrator.set_start(self._open(), "project")

    def _start_is_chosen(self):
        return PETSc.Options().hasName("ts_hhtdae_start") or "ts_hhtdae_start" in [name.lstrip("-") for name in self._options]

    def restart(self) -> None:
        """Restarts the integrator, which then uses no values of earlier steps. To be called after a callback, or a parameter within a run, has
        made a force or motion jump; between two calls of `solve` this is done for parameters."""
        self._numbers = None
        self._open().restartStep()
        if self.steps:
            self._project_restarts()

    @one_thread
    def set_velocity(self, body, velocity: Any = None, angular_velocity: Any = None) -> None:
        """Sets the velocity of a body's centre of mass (of a `FlexibleBody`: of its frame) and its angular velocity, in space axes, in the present
        state of the run, for example after an impact in the action of an event; None keeps what there is. Positions are not changed, nor are the rates of modal coordinates. The
        integrator restarts, and velocities that violate joints are removed as in a plastic impact, unless the option -ts_hhtdae_start is given. Collective.

        >>> def bounce(run):  # coefficient of restitution 0.8
        ...     v = run.snapshot().motion(ball).velocity
        ...     run.set_velocity(ball, (v[0], -0.8 * v[1], v[2]))
        >>> run.event(height, bounce, direction=-1)

        All velocities together are in the second vector of ``run.ts.getSolution2()``, the bodies in the order in which they were added (on several
        ranks those of each rank): of a rigid body the velocity of the centre of mass, 3 entries, and its angular velocity, 3 entries, both in space
        axes (with ``scene.start(rotations="euler313")`` the rates of the angles); of a point mass 3 entries; in planar scenes 3 and 2; of a
        `FlexibleBody` the rates of its modal coordinates follow. After all bodies there are entries of multipliers, force states, variables and
        states.
        """
        _core.set_velocity(self._open(), body, velocity, angular_velocity)
        if not self._start_is_chosen():
            integrator.set_start(self._open(), "project")
        self.restart()

    def on_step(self, function: Callable[["Run"], Any]) -> None:
        """Calls function(run) after every step. If the function sets parameters that make a formula jump, it has to call `restart`."""
        begun, me = 0, weakref.ref(self)  # the TS must not have a reference to the run, see _look_of()

        def monitor(ts, step, t, u):
            nonlocal begun
            run = me()
            if run is None:
                return
            first, begun = begun != run._serial, run._serial  # the initial state of a part of the run is not the end of a step
            if step > 0 and not first:
                together(run.scene.comm, function, run)
        self._open().setMonitor(monitor)

    def _at(self, time):
        return self.time if time is None else number(time, "time")

    # ---- analyses of a run that has not begun ----

    @one_thread
    def equilibrium(self, time: Any = None) -> "Run":
        """Moves the run to static equilibrium at a time, at rest; returns the run. Prescribed displacements have their values at that time, and
        no velocity: `assemble` afterwards gives bodies the velocities that motions prescribe, as `linearize` of what turns needs them; `solve`
        does so by itself. States that no equation reads, such as integrals for output, keep their values. If initial values violate
        constraints, call ``scene.start(assembly="project")`` before the run is made, or with "off": then the iteration starts from the described
        positions. Friction is zero at rest and holds nothing: what it would hold slides to where it rests without, or an error says that there is no
        equilibrium. Collective."""
        _core.static_equilibrium(self._open(), self._at(time))
        return self

    @one_thread
    def assemble(self, time: Any = None) -> "Run":
        """Moves the run to the nearest positions and velocities that satisfy all constraints and motions at a time; returns the run. The initial
        values have to satisfy them at the start, unless ``scene.start(assembly="project")`` moves them when the run is made."""
        _core.assemble_at(self._open(), self._at(time))
        return self

    @one_thread
    def kinematics(self, time: Any = None) -> "Run":
        """As `assemble`, for scenes whose joints and motions leave no degree of freedom: loads of a snapshot are those of inverse dynamics.
        Returns the run. At and near a dead centre, where constraints depend on one another, velocities, accelerations and loads have few digits or
        none: a notice is printed.

        >>> scene.start(assembly="project")  # velocities that follow from motions need not be given
        >>> scene.run().kinematics(0.5).snapshot().load(drive, marker)
        """
        _core.kinematics(self._open(), self._at(time))
        return self

    # ---- results ----

    @property
    def time(self) -> float:
        """The time that the run has reached."""
        return self._open().getTime()

    @property
    def steps(self) -> int:
        """Accepted steps."""
        return self._open().getStepNumber()

    @property
    def statistics(self) -> integrator.Statistics:
        """Counters of the run, see `hhtdae.Statistics`."""
        return integrator.statistics(self._open())

    @property
    def times(self) -> np.ndarray:
        """Times of the samples, (n,)."""
        return self._recorder.times if self._recorder else np.empty(0)

    @property
    def values(self) -> np.ndarray:
        """All samples, (n, channels)."""
        values = self._recorder.values if self._recorder else np.empty(0)
        return values if len(values) else np.empty((0, len(self._signature)))

    @one_thread
    def sample(self, time: Any = None) -> Dict[str, float]:
        """Values of all channels at a time of the last step (default: its end), by name; before the first step at the start. About accelerations and
        reactions within steps see `Snapshot`."""
        x = self.scene._core.sample(self._open(), self._at(time))
        return dict(zip([name for name, _ in self._signature], x))

    @property
    def results(self) -> Results:
        """The results of the run until now, as separate arrays; also available for a closed run."""
        time, steps, statistics = (self.time, self.steps, self.statistics) if self.ts is not None else self._left
        return Results(self.times, self.values, time, steps, statistics, list(self._signature), self._page.text())

    def __reduce__(self):
        left = self.results
        return Results, tuple(vars(left).values())

    def page(self, height: int = 600) -> Page:
        """The run until now in three dimensions, if ``Scene.run(page=True)`` has recorded frames; a notebook shows it below the cell.

        >>> scene.solve(2., page=True).page()

        Parameters
        ----------
        height : int
            In a notebook, pixels.
        """
        text = self._page.text()
        if text is None:
            raise ValueError("the run has no page, frames are recorded while it goes: Scene.run(page=True), or a file, before it; and only the first rank has it")
        return Page(text, height)

    def snapshot(self, time: Any = None) -> Snapshot:
        """The state of the run at a time of its last step (default: its end), see `Snapshot`. Collective."""
        return Snapshot(self, time)

    def linearize(self, time: Any = None, axes: Any = None) -> Linearization:
        """Small motions about the state at a time of the last step: an equilibrium, a state at rest without accelerations, or a motion that is
        steady relative to the body `axes`, to flexible bodies or to space. In any other state of rigid bodies only `modes()` and `state_space()`
        are valid: see `Linearization`, also for how a spinning elastic body comes to a steady state. Collective."""
        return Linearization(self, time, axes)

    # ---- the rest ----

    @one_thread
    def save(self, file: str) -> None:
        """Writes a checkpoint, from which the run can be resumed with bitwise identical results. Collective."""
        if self._events:
            self._resume_events()
            self._keep_signs(self._changed())
        integrator.checkpoint_save(self._open(), file)

    @one_thread
    def load(self, file: str) -> "Run":
        """Moves the run to the state in a checkpoint of a run of the same scene, from where it continues with bitwise identical results; returns
        the run. Collective.

        Parameters must have the values with which the checkpoint was written; afterwards `Scene.set` may change them. The checkpoint knows full turns
        of all angles that its run had read, and which events it had found; a new run adds them before it goes on. To load what a run made with ``after=``
        has saved, give parameters its values; if the described initial values do not satisfy them, ``scene.start(assembly="off")`` before the run is made.
        """
        ts = self._open()
        self._not_solving("load")
        with temporary_options(self._options):
            _core.set_up(ts)  # before the set-up, checkpoint_load() would only store the name of the file
            integrator.checkpoint_load(ts, file)
            self._project_restarts()
        self._resumed, self._signs.within, self._passed = _core.notes(ts), np.inf, []
        self._note_state()
        if self._recorder:
            self._recorder.resume(self.time)
        return self

    @one_thread
    def close(self) -> None:
        """Destroys the TS of the run and frees its memory; samples remain available. This is an error while the run is being solved."""
        if self.ts:
            self._not_solving("close")
            self._left = self.time, self.steps, self.statistics
            self.ts.destroy()
        self.ts = self._now = None

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def __repr__(self):
        return "<closed run>" if not self.ts else "<run at t = %.6g, %d steps, %d samples>" % (self.time, self.steps, len(self.times))


def _look_of(run):
    """The function that calls the run's _look() after a step. The TS has only a weak reference to the run: the run's snapshot has a reference to
    the TS that Python's garbage collector does not know"""
    def look(ts):
        alive = run()
        if alive is not None:
            alive._look(ts)
    return look


def _remove(folder, process):
    """Removes a temporary directory, except in forked processes, which have a copy of the run"""
    if os.getpid() == process:
        shutil.rmtree(folder, ignore_errors=True)


class _PageFile:
    """The file to which a run writes its page: the user's file, or a temporary one that is removed with the run"""

    def __init__(self, scene, page: Union[bool, str]):
        self.scene, self.span, self.begun, self.temporary = scene, None, False, page is True
        self.file: Optional[str] = None
        if self.temporary:
            folder = tempfile.mkdtemp(prefix="hhtdae-")
            weakref.finalize(self, _remove, folder, os.getpid())
            self.file = os.path.join(folder, "run.html")
        elif page:
            self.file = os.path.abspath(os.fspath(page))

    @contextmanager
    def settings(self):
        """The settings of output when the run is first solved: those of the scene, with this file; options of the command line have precedence"""
        given = self.scene._output
        own = dict(given)
        if self.file:
            own.update(page=self.file, page_title=given["page_title"] or ("run" if self.temporary else ""))
        if self.span and not own["page_dt"]:
            own["page_dt"] = self.span / own["page_frames"]
        if not self.begun:
            self.file = PETSc.Options().getString("scene_page", own["page"])
        self.begun = True
        try:
            self.scene._set_page(own)
            yield
        finally:
            self.scene._set_page(given)

    def text(self) -> Optional[str]:
        """The text of the page; None if there is none, or not on this rank"""
        if not self.begun or not self.file or self.scene.comm.rank or not os.path.exists(self.file):
            return None
        with open(self.file, encoding="utf-8") as page:
            return page.read()
