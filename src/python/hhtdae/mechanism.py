"""Solves equations of motion given as Python functions, by one call in the manner of scipy.integrate.solve_ivp."""

import warnings

import numpy as np
from petsc4py import PETSc

from . import _core, integrator
from ._errors import Error
from .differences import differences, scales, slopes, smooth
from .events import Signs
from .expressions import Expression, _expression
from .run import collect_garbage, positive, temporary_options, tell_unused
from .threads import one_thread
from .tracing import compile_tape, differentiate

__all__ = ["MechanismResult", "solve_mechanism"]


class DenseOutput:
    """The solution between the ends of its steps. Called with a time or an array of times it returns the positions, (n,) or (n, times): cubics
    through positions and velocities at the ends of a step; `velocity` the velocities, cubics through velocities and accelerations."""

    def __init__(self, t, q, v, a):
        self.t, self.q, self.v, self.a = t, q, v, a

    def _cubic(self, t, x, rate):
        at = np.atleast_1d(np.asarray(t, dtype=float))
        if np.any(at < self.t[0]) or np.any(at > self.t[-1]):
            raise ValueError("the solution is known from t = %g to %g" % (self.t[0], self.t[-1]))
        k = np.clip(np.searchsorted(self.t, at, side="right") - 1, 0, len(self.t) - 2)
        h = self.t[k + 1] - self.t[k]
        s = (at - self.t[k]) / h
        y = (1 - s)**2 * ((1 + 2 * s) * x[:, k] + s * h * rate[:, k]) + s * s * ((3 - 2 * s) * x[:, k + 1] - (1 - s) * h * rate[:, k + 1])
        return y if np.ndim(t) else y[:, 0]

    def __call__(self, t):
        return self._cubic(t, self.q, self.v)

    def velocity(self, t):
        """Velocities at a time or times, of the same shape."""
        return self._cubic(t, self.v, self.a)


class MechanismResult(dict):
    """What `solve_mechanism` returns; entries are attributes as well.

    t : (times,); q, v, a : (n, times); multipliers : (m, times), those of velocity constraints last
    sol : DenseOutput or None
    t_events, q_events : lists with an array for each event, or None
    status : 0 the end was reached, 1 a terminal event came, -1 the run failed
    success : bool; message : str
    statistics : Statistics
    """

    def __getattr__(self, name):
        try:
            return self[name]
        except KeyError:
            raise AttributeError(name) from None

    def __repr__(self):
        return "\n".join("%12s: %r" % (k, x if not isinstance(x, np.ndarray) else "array of shape %s" % (x.shape,)) for k, x in self.items())


@one_thread
def solve_mechanism(residual, t_span, q0, v0, *, constraints=None, velocity_constraints=None, jacobian=None, constraint_jacobian=None, rtol=1e-6,
                    atol=1e-6, t_eval=None, dense_output=False, events=None, max_step=np.inf, first_step=None, args=(), trace=False, start="project",
                    options=None):
    """Integrates M(q) q'' + Phi_q(t, q)^T lambda = Q(t, q, q'), Phi(t, q) = 0, an index-3 system, as it stands.

    Parameters
    ----------
    residual : callable
        residual(t, q, v, a, *args) returns M a - Q without the forces of the constraints, (n,); linear in a.
    t_span : (float, float)
        Begin and end, begin < end.
    q0, v0 : (n,)
        Positions and velocities at the begin.
    constraints : callable, optional
        constraints(t, q, *args) returns Phi, (m,). Its multipliers are forces: Phi_q^T lambda acts on the left side.
    velocity_constraints : callable, optional
        velocity_constraints(t, q, v, *args) returns Psi, (k,), linear in v: rolling, blades. Their multipliers, after those of `constraints`, are forces as
        well: Psi_v^T mu.
    jacobian : callable, optional
        jacobian(t, q, v, a, *args) returns the derivatives of the residual by q, v and a, three matrices (n, n), arrays or sparse ones of SciPy. Default: central
        differences, 6 n + 1 calls of `residual` for each Newton matrix. Given ones are compared with differences at the initial time: a wrong
        derivative by a is an error, since accelerations and multipliers follow from it; an inexact one by q or v causes a warning.
    constraint_jacobian : callable, optional
        constraint_jacobian(t, q, *args) returns Phi_q, (m, n), an array or a sparse matrix of SciPy. Default: central differences, with which a
        given one is compared at the initial time.
    rtol, atol : float
        Relative and absolute tolerance of the error of positions in every step, for each coordinate max(atol, rtol times its own largest size so
        far). The error of the whole solution is larger: the method is of order two, its steps are proportional to tol^(1/3), its errors to tol^(2/3), or to tol^(1/2) if
        forces jump at unknown times.
    t_eval : sequence of float, optional
        Times of the output, increasing; default: the ends of steps. Between the ends of steps accelerations and multipliers solve the equations
        of motion; at the ends they are those of the step, with an error many times as large.
    dense_output : bool
        `sol`, a function of time.
    events : callable or list of them, optional
        event(t, q, v, *args) returns a number whose zeros are found by its sign at the ends of steps, or a truth value, which passes upwards when
        it becomes true. Two zeros within a step are not found, see `max_step`. Functions may have the attributes `terminal` (bool) and
        `direction` (-1, 0, 1) as in SciPy.
    max_step, first_step : float, optional
        Longest step, and the first one; the first is found otherwise.
    args : tuple
        Further arguments of all functions.
    trace : bool
        The residual and the constraints are called once, with formulas as arguments, and then run in C++ with exact derivatives, some ten times
        faster. This is possible for functions that consist of operators, numpy's elementary functions, array products and `hhtdae.where`, and
        depend on their arguments only. Functions that cannot be traced raise TypeError.
    start : {"project", "report", "off"}
        What happens with initial values that violate the constraints. "project": they are moved to the nearest consistent ones; "report": the
        distance to these is printed, and the run begins with the given values; "off": the run begins with the given values. In messages the rows
        of the residual come first, then those of the constraints. A run from positions that violate the constraints usually fails.
    options : dict, optional
        PETSc's options without the dash; options of the command line have precedence.

    Returns
    -------
    MechanismResult

    Examples
    --------
    A pendulum, x^2 + y^2 = 1:

    >>> def residual(t, q, v, a):
    ...     return [a[0], a[1] + 9.81]
    >>> def rod(t, q):
    ...     return [q[0]**2 + q[1]**2 - 1]
    >>> solution = hhtdae.solve_mechanism(residual, (0, 2), [1, 0], [0, 0], constraints=rod)
    >>> solution.q[:, -1]
    """
    problem = _Problem(residual, t_span, q0, v0, constraints, velocity_constraints, jacobian, constraint_jacobian, args, trace)
    rtol, atol = positive(rtol, "rtol"), positive(atol, "atol")
    max_step = np.inf if np.ndim(max_step) == 0 and max_step == np.inf else positive(max_step, "max_step")
    first_step = None if first_step is None else positive(first_step, "first_step")
    collect_garbage(PETSc.COMM_SELF)
    with temporary_options(options) as unused:
        ts = _create(problem, rtol, atol, max_step, first_step, start, trace)
        output = _Output(problem, t_eval, dense_output, events)
        output.attach(ts)
        _core.set_from_options(ts)
        try:
            status, message = _solve(ts, problem, output)
            result = output.result(ts, status, message)
        finally:
            ts.destroy()
    tell_unused(unused, 3)
    return result


class _Problem:
    """The user's functions and the sizes of their results, which are checked"""

    def __init__(self, residual, t_span, q0, v0, constraints, velocity_constraints, jacobian, constraint_jacobian, args, trace):
        if np.shape(t_span) != (2,):
            raise ValueError("t_span is %r, must be two numbers, begin and end" % (t_span,))
        if not isinstance(args, (tuple, list)):
            raise TypeError("args is %r, must be a tuple: (%r,)" % (args, args))
        self.t0, self.t1 = map(float, t_span)
        self.q0, self.v0 = (np.array(x, dtype=float).reshape(-1) for x in (q0, v0))
        self.n, self.args = len(self.q0), tuple(args)
        if not self.t1 > self.t0:
            raise ValueError("t_span is (%g, %g): its end must come after its begin" % (self.t0, self.t1))
        if not np.isfinite([self.t0, self.t1]).all():
            raise ValueError("t_span is (%g, %g): both ends must be finite; the second is the latest, where an event is to end the run" % (self.t0, self.t1))
        if not np.all(np.isfinite(self.q0)) or not np.all(np.isfinite(self.v0)):
            raise ValueError("q0 and v0 must be finite, are %s and %s" % (self.q0, self.v0))
        if len(self.v0) != self.n:
            raise ValueError("q0 has %d numbers and v0 %d" % (self.n, len(self.v0)))
        self._residual, self._constraints, self._jacobian, self._gradient = residual, constraints, jacobian, constraint_jacobian
        self._rates = velocity_constraints
        self.error = None  # the first exception that these functions have raised in a run
        self.m = 0 if constraints is None else len(np.ravel(np.asarray(constraints(self.t0, self.q0.copy(), *self.args), dtype=float)))
        self.k = 0 if velocity_constraints is None else np.size(velocity_constraints(self.t0, self.q0.copy(), self.v0.copy(), *self.args))
        self.size = self.n + self.m + self.k
        for what, x in (("residual", self.residual(self.t0, self.q0, self.v0, np.zeros(self.n))), ("constraints", self.constraints(self.t0, self.q0)),
                        ("velocity_constraints", self.rates(self.t0, self.q0, self.v0))):
            if not np.all(np.isfinite(x)):
                row = int(np.argmin(np.isfinite(x)))
                raise ValueError("%s() returns %g in row %d at the begin, t = %g" % (what, x[row], row, self.t0))
        self.seen = np.full(self.n, -1.), np.full(self.n, -1.)
        if not trace:
            self.find_scales(self.t0, self.q0, self.v0, np.zeros(self.n))
            if self.m and constraint_jacobian is not None:
                self.check_gradient()
            if self.n and jacobian is not None:
                self.check_jacobian()

    def name(self, row):
        """The name of an unknown and its equation, in terms of the user's functions, for messages"""
        for name, n in (("q", self.n), ("constraints()", self.m), ("velocity_constraints()", self.k)):
            if row < n:
                return "%s[%d]" % (name, row)
            row -= n

    def _shaped(self, x, shape, what):
        if hasattr(x, "toarray"):  # a sparse matrix of SciPy
            x = x.toarray()
        if np.iscomplexobj(x):
            raise ValueError("%s is complex, must be real" % what)
        try:
            x = np.array(x, dtype=float)  # a copy: the function may write into the same array again
        except (TypeError, ValueError) as error:
            raise ValueError("%s must be numbers, is %r: %s" % (what, x, error)) from error
        plain = lambda s: tuple(k for k in s if k != 1)  # shapes (n, 1) and (1, n) are accepted for (n,)
        if plain(x.shape) != plain(shape):
            raise ValueError("%s has the shape %s, must be %s" % (what, x.shape, shape))
        return x.reshape(shape)

    def residual(self, t, q, v, a):
        return self._shaped(self._residual(t, q.copy(), v.copy(), a.copy(), *self.args), (self.n,), "what residual() returns")

    def constraints(self, t, q):
        return self._shaped(self._constraints(t, q.copy(), *self.args), (self.m,), "what constraints() returns") if self.m else np.empty(0)

    def rates(self, t, q, v):
        return self._shaped(self._rates(t, q.copy(), v.copy(), *self.args), (self.k,), "what velocity_constraints() returns") if self.k else np.empty(0)

    def gradient(self, t, q):
        if not self.m:
            return np.empty((0, self.n))
        if self._gradient is not None:
            return self._shaped(self._gradient(t, q.copy(), *self.args), (self.m, self.n), "what constraint_jacobian() returns")
        return differences(lambda x: self.constraints(t, x), q, self.m, self.scale_q)

    def rate_gradient(self, t, q, v):
        return slopes(lambda x: self.rates(t, q, x), v, self.k) if self.k else np.empty((0, self.n))

    def reactions(self, t, q, v, multipliers):
        """Forces of the constraints, Phi_q^T lambda + Psi_v^T mu"""
        return self.gradient(t, q).T @ multipliers[:self.m] + self.rate_gradient(t, q, v).T @ multipliers[self.m:]

    def forces(self, t, q, v, a, multipliers):
        return self.residual(t, q, v, a) + self.reactions(t, q, v, multipliers)

    def find_scales(self, t, q, v, a):
        """Determines the scales of differences anew if a position or velocity is ten times as large as all before"""
        if np.all(np.abs(q) <= 10 * self.seen[0]) and np.all(np.abs(v) <= 10 * self.seen[1]):
            return
        self.seen = np.maximum(self.seen[0], np.abs(q)), np.maximum(self.seen[1], np.abs(v))
        self.scale_q = scales(lambda x: np.concatenate([self.residual(t, x, v, a), self.constraints(t, x), self.rates(t, x, v)]), q)
        self.scale_v = scales(lambda x: self.residual(t, q, x, a), v)

    def check_gradient(self):
        """Compares a given Jacobian of the constraints with differences at the initial time: a wrong one causes wrong forces, which nothing else
        would reveal"""
        given, found = self.gradient(self.t0, self.q0), differences(lambda x: self.constraints(self.t0, x), self.q0, self.m, self.scale_q)
        error = np.abs(given - found) * self.scale_q
        wrong = error > 1e-4 * np.max(np.maximum(np.abs(given), np.abs(found)) * self.scale_q, axis=1, keepdims=True)
        if np.any(wrong) or not np.all(np.isfinite(given)):
            row, column = np.unravel_index(np.argmax(np.where(np.isfinite(error), error, np.inf)), error.shape)
            raise ValueError("constraint_jacobian() is not the derivative of constraints() at t = %g: in row %d, column %d it says %g, differences say %g"
                             % (self.t0, row, column, given[row, column], found[row, column]))

    def check_jacobian(self):
        """Compares given derivatives of the residual with differences at the initial time, where the residual is smooth. Wrong derivatives by a
        cause wrong accelerations and multipliers; wrong ones by q or v, which may be approximate, cause many corrections and small steps. In
        order to test terms like M(q) a, the accelerations are those that solve the equations by least squares, without the terms of the
        constraints that are quadratic in velocities."""
        t, q, v, still = self.t0, self.q0, self.v0, np.zeros(self.n)
        G = np.vstack([self.gradient(t, q), self.rate_gradient(t, q, v)])
        M = slopes(lambda x: self.residual(t, q, v, x), still, self.n)
        K, rest = np.block([[M, G.T], [G, np.zeros((len(G), len(G)))]]), self.residual(t, q, v, still)
        a = np.linalg.lstsq(K, np.concatenate([-rest, np.zeros(len(G))]), rcond=None)[0][:self.n] if np.all(np.isfinite(K)) else still
        given = self.given_matrices(t, q, v, a)
        rounding = 1e-9 * (np.abs(rest) + np.abs(self.residual(t, q, v, a)))[:, None]  # rounding of differences with steps of 6e-6 of a scale
        by_a = lambda: slopes(lambda x: self.residual(t, q, v, x), a, self.n), np.maximum(1., np.abs(a)), np.ones((self.n, self.n), dtype=bool)
        by = [(lambda f=f, x=x, scale=scale: differences(f, x, self.n, scale), scale, smooth(f, x, 6e-6 * scale)) for f, x, scale in
              ((lambda x: self.residual(t, x, v, a), q, self.scale_q), (lambda x: self.residual(t, q, x, a), v, self.scale_v))]
        for name, one, (find, scale, judged) in (("a", given[2], by_a), ("q", given[0], by[0]), ("v", given[1], by[1])):
            try:
                two = find()
            except Exception:  # the residual fails near the initial state
                continue
            wrong = judged & (np.abs(one - two) * scale > 1e-4 * np.max(np.maximum(np.abs(one), np.abs(two)) * scale, axis=1, keepdims=True) + rounding)
            wrong |= ~np.isfinite(one)
            if not np.any(wrong):
                continue
            row, column = np.unravel_index(np.argmax(np.where(np.isfinite(one), np.where(wrong, np.abs(one - two) * scale, 0.), np.inf)), wrong.shape)
            text = "jacobian(): the matrix of derivatives by %s, dF/d%s, is not that of residual() at t = %g: in row %d, column %d it says %g, differences say %g" % (
                name, name, t, row, column, one[row, column], two[row, column])
            if name == "a" or not np.all(np.isfinite(one)):
                raise ValueError(text)
            warnings.warn(text + "; corrections will converge slowly, and steps be short", RuntimeWarning, 5)

    def given_matrices(self, t, q, v, a):
        """The three matrices that jacobian() returns, checked"""
        three = self._jacobian(t, q.copy(), v.copy(), a.copy(), *self.args)
        if not isinstance(three, (tuple, list, np.ndarray)) or len(three) != 3:
            raise ValueError("what jacobian() returns is %r, must be three matrices: the derivatives by q, v and a" % (three,))
        return [self._shaped(x, (self.n, self.n), "the matrix of derivatives by %s that jacobian() returns" % name) for name, x in zip("qva", three)]

    def massless(self):
        """A remark for messages about accelerations on which the residual does not depend at the initial time"""
        M = slopes(lambda x: self.residual(self.t0, self.q0, self.v0, x), np.zeros(self.n), self.n)
        names = ", ".join("a[%d]" % k for k in range(self.n) if not np.any(M[:, k]))
        return names and "; residual() does not depend on %s" % names

    def matrices(self, t, q, v, a, multipliers):
        """Derivatives by q, v, a of the residual including the forces of the constraints"""
        self.find_scales(t, q, v, a)
        if self._jacobian is None:
            return (differences(lambda x: self.forces(t, x, v, a, multipliers), q, self.n, self.scale_q),
                    differences(lambda x: self.residual(t, q, x, a), v, self.n, self.scale_v), slopes(lambda x: self.residual(t, q, v, x), a, self.n))
        K, C, M = self.given_matrices(t, q, v, a)
        if self.m + self.k:
            K = K + differences(lambda x: self.reactions(t, x, v, multipliers), q, self.n, self.scale_q)
        return K, C, M


# ---- the TS ----

def _create(p, rtol, atol, max_step, first_step, start, trace):
    ts = PETSc.TS().create(comm=PETSc.COMM_SELF)
    ts.setType("hhtdae")
    keep = []
    (_trace if trace else _call)(ts, p, keep)
    ts.setAttr("hhtdae", keep)
    u, v = (PETSc.Vec().createSeq(p.size) for _ in range(2))
    u.array[:p.n], v.array[:p.n] = p.q0, p.v0
    ts.setSolution2(u, v)
    ts.setTime(p.t0)
    ts.setMaxTime(p.t1)
    ts.setMaxSteps(2**31 - 1)
    ts.setExactFinalTime(PETSc.TS.ExactFinalTime.MATCHSTEP)
    ts.setTolerances(rtol=rtol, atol=atol)
    if first_step is not None:
        ts.setTimeStep(first_step)
    if np.isfinite(max_step):
        _core.set_max_step(ts, max_step)
    integrator.set_role(ts, "coordinate", range(p.n))
    integrator.set_role(ts, "holonomic", range(p.n, p.n + p.m))
    integrator.set_role(ts, "nonholonomic", range(p.n + p.m, p.size))
    integrator.set_row_name(ts, p.name)
    integrator.set_start(ts, start)
    return ts


def _call(ts, p, keep):
    """Sets equations that call Python. After an exception of a user's function the residual is NaN, which ends the run; the exception is raised
    when PETSc has returned, since newer versions of petsc4py (3.22) may crash if it is raised through PETSc."""
    n, rows = p.n, np.arange(p.size, dtype=PETSc.IntType)

    def caught(f, fail):
        def call(*arguments):
            try:
                if p.error is None:
                    return f(*arguments)
            except Exception as error:
                p.error = error
            return fail(*arguments)
        return call

    def no_residual(ts, t, u, v, a, f):
        f.set(np.nan)

    def no_jacobian(ts, t, u, v, a, shift_v, shift_a, J, P):
        P.setValues(rows, rows, np.full((p.size, p.size), np.nan))
        P.assemble()
        return True

    def residual(ts, t, u, v, a, f):
        q, w, out = u.array_r, v.array_r[:n].copy(), f.array
        out[:n] = p.forces(t, q[:n].copy(), w, a.array_r[:n].copy(), q[n:])
        out[n:n + p.m] = p.constraints(t, q[:n].copy())
        out[n + p.m:] = p.rates(t, q[:n].copy(), w)

    def jacobian(ts, t, u, v, a, shift_v, shift_a, J, P):
        q, w, b, multipliers = u.array_r[:n].copy(), v.array_r[:n].copy(), a.array_r[:n].copy(), u.array_r[n:].copy()
        K, C, M = p.matrices(t, q, w, b, multipliers)
        full, G, R, m = np.zeros((p.size, p.size)), p.gradient(t, q), p.rate_gradient(t, q, w), n + p.m
        full[:n, :n], full[:n, n:m], full[:n, m:] = K + shift_v * C + shift_a * M, G.T, R.T
        full[n:m, :n] = G
        if p.k:
            full[m:, :n] = differences(lambda x: p.rates(t, x, w), q, p.k, p.scale_q) + shift_v * R
        P.setValues(rows, rows, full)
        P.assemble()
        if J != P:
            J.assemble()
        return True

    J = PETSc.Mat().createAIJ([p.size, p.size], nnz=p.size, comm=PETSc.COMM_SELF)
    J.setValues(rows, rows, np.zeros((p.size, p.size)))
    J.assemble()
    ts.setI2Function(caught(residual, no_residual), J.createVecLeft())
    ts.setI2Jacobian(caught(jacobian, no_jacobian), J)


def _traced(f, what, *arguments):
    try:
        result = f(*arguments)
        return [_expression(x) for x in np.ravel(np.asarray(result, dtype=object))]
    except (TypeError, AttributeError, ValueError) as error:
        hint = ": of arrays of formulas, use hhtdae's functions" if isinstance(error, AttributeError) or "ufunc" in str(error) else ""
        raise TypeError("trace=True: %s cannot be traced: %s%s" % (what, error, hint)) from error


def _trace(ts, p, keep):
    """Sets traced equations that run in C++: the residual with Phi_q^T lambda, and the nonzero entries of the three matrices"""
    size, n = p.size, p.n
    leaf = [Expression("argument", (), k) for k in range(1 + 3 * size)]
    q, multipliers, v, a = leaf[1:1 + n], leaf[1 + n:1 + size], leaf[1 + size:1 + size + n], leaf[1 + 2 * size:1 + 2 * size + n]
    box = lambda x: np.array(x + [None], dtype=object)[:-1]
    f = _traced(p._residual, "residual()", leaf[0], box(q), box(v), box(a), *p.args)
    if len(f) != n:
        raise ValueError("what residual() returns has %d numbers, must have %d" % (len(f), n))
    if p.m:
        phi = _traced(p._constraints, "constraints()", leaf[0], box(q), *p.args)
        for (row, column), d in differentiate(phi, range(1, 1 + n)).items():
            f[column - 1] = f[column - 1] + d * multipliers[row]
        f += phi
    if p.k:
        psi = _traced(p._rates, "velocity_constraints()", leaf[0], box(q), box(v), *p.args)
        for (row, column), d in differentiate(psi, range(1 + size, 1 + size + n)).items():
            f[column - 1 - size] = f[column - 1 - size] + d * multipliers[p.m + row]
        f += psi
    entries = [[], [], []]
    for (row, k), d in differentiate(f, range(1, 1 + 3 * size)).items():
        entries[(k - 1) // size].append((row, (k - 1) % size, d))
    matrices = [d for block in entries for _, _, d in block]
    _core.set_equations(ts, size, compile_tape(f, {}, keep, 1 + 3 * size), compile_tape(matrices, {}, keep, 1 + 3 * size),
                        [[r for r, _, _ in block] for block in entries], [[c for _, c, _ in block] for block in entries])


def _solve(ts, p, output):
    try:
        ts.solve(ts.getSolution2()[0])
    except PETSc.Error as error:
        if p.error is not None:
            raise p.error from None
        if error.__cause__ is not None:  # newer versions of petsc4py wrap an exception of a user's monitor in their own error
            raise error.__cause__
        lines = [line.split("] ", 1)[-1] for line in str(error).splitlines()]
        if error.ierr != 91:  # after PETSC_ERR_NOT_CONVERGED the steps before are returned as the result
            raise Error(error.ierr, lines[-1] + p.massless(), lines[1:-1]) from None
        return -1, "the run has failed at t = %.6g: %s" % (ts.getTime(), lines[-1])
    if p.error is not None:  # with -ts_error_if_step_fails 0
        raise p.error
    if output.stopped is not None:
        return 1, "a terminal event came at t = %.6g" % output.stopped
    if ts.getConvergedReason() < 0:
        return -1, "the run has failed at t = %.6g: %s" % (ts.getTime(), _reason(ts))
    if ts.getTime() < p.t1:
        return -1, "the run has ended at t = %.6g: it has made the largest number of steps, -ts_max_steps" % ts.getTime()
    return 0, "the end of the interval was reached"


def _reason(ts):
    reason = ts.getConvergedReason()
    names = {k: name for name, k in vars(PETSc.TS.ConvergedReason).items() if isinstance(k, int)}
    return names.get(reason, str(reason)).lower().replace("_", " ")


# ---- output ----

class _Output:
    """Collects the output of the steps"""

    def __init__(self, problem, t_eval, dense, events):
        self.p, self.dense, self.stopped = problem, dense, None
        self.wanted = None if t_eval is None else np.array(t_eval, dtype=float).reshape(-1)
        if self.wanted is not None and len(self.wanted) and (not np.all(np.diff(self.wanted) > 0) or not problem.t0 <= self.wanted[0] <= self.wanted[-1] <= problem.t1):
            raise ValueError("t_eval must increase, within t_span")
        self.events = [] if events is None else [events] if callable(events) else list(events)
        for k, event in enumerate(self.events):
            if not callable(event):
                raise TypeError("event %d is %r, must be a function of t, q, v" % (k, event))
            if getattr(event, "direction", 0) not in (-1, 0, 1):
                raise ValueError("event %d: its direction is %r, must be -1, 0 or 1" % (k, event.direction))
        self.next, self.rows, self.ends = 0, [], []
        self.found = [([], []) for _ in self.events]

    def attach(self, ts):
        ts.setMonitor(self.monitor)
        if self.events:
            self.signs = Signs([getattr(e, "direction", 0) for e in self.events])
            ts.setPostStep(self.look)

    def look(self, ts):
        """Called after a step: finds passages with the interpolation of the integrator; the first terminal one ends the run"""
        for t, k in self.signs.passed(ts.getPrevTime(), ts.getTime(), lambda k, t: self.event_value(ts, t, k)):
            self.found[k][0].append(t)
            self.found[k][1].append(self.positions(ts, t)[0])
            if getattr(self.events[k], "terminal", False):
                self.stopped = t
                ts.setConvergedReason(PETSc.TS.ConvergedReason.CONVERGED_USER)
                return

    def event_value(self, ts, t, k):
        q, v = self.positions(ts, t)
        x = self.events[k](t, q, v, *self.p.args)
        x = float(x) - 0.5 if np.asarray(x).dtype == bool else float(x)  # a condition passes zero upwards when it becomes true
        if np.isnan(x):
            raise ValueError("event %d is not a number at t = %g" % (k, t))
        return x

    def positions(self, ts, t):
        u, v, a = integrator.interpolate(ts, t)
        x = u.array[:self.p.n].copy(), v.array[:self.p.n].copy()
        for y in (u, v, a):
            y.destroy()
        return x

    def monitor(self, ts, step, t, u):
        if step <= 0:
            return
        if not self.ends:
            self.add(ts, ts.getPrevTime())
        if self.stopped is not None:
            t = self.stopped
        if t > self.ends[-1][0]:
            self.add(ts, t)

    def add(self, ts, t):
        if self.wanted is None or self.dense:
            self.ends.append((t,) + self.state(ts, t))
        else:
            self.ends.append((t,))
        if self.wanted is not None:
            while self.next < len(self.wanted) and self.wanted[self.next] <= t:
                at = self.wanted[self.next]
                self.rows.append((at,) + self.state(ts, at))
                self.next += 1

    def state(self, ts, t):
        u, v, a = integrator.evaluate_at(ts, t)
        n = self.p.n
        x = u.array[:n].copy(), v.array[:n].copy(), a.array[:n].copy(), u.array[n:].copy()
        for y in (u, v, a):
            y.destroy()
        return x

    def result(self, ts, status, message):
        rows = self.rows if self.wanted is not None else self.ends
        columns = lambda k, size, of: np.array([r[k] for r in of]).reshape(len(of), size).T
        p = self.p
        t = np.array([r[0] for r in rows])
        sol = None
        if self.dense and len(self.ends) > 1:
            sol = DenseOutput(np.array([r[0] for r in self.ends]), columns(1, p.n, self.ends), columns(2, p.n, self.ends), columns(3, p.n, self.ends))
        return MechanismResult(t=t, q=columns(1, p.n, rows), v=columns(2, p.n, rows), a=columns(3, p.n, rows), multipliers=columns(4, p.m + p.k, rows), sol=sol,
                               t_events=[np.array(x) for x, _ in self.found] if self.events else None,
                               q_events=[np.array(x).reshape(-1, p.n) for _, x in self.found] if self.events else None,
                               status=status, success=status >= 0, message=message, statistics=integrator.statistics(ts))
