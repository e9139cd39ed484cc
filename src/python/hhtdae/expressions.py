"""Formulas: numbers that a run evaluates.

Measures of the state, parameters and their combinations are expressions. They are built by ordinary operators and by the functions of this
module (or numpy's), once; a run evaluates them, with exact derivatives, in C++ without calling Python::

    power = hhtdae.force(motor, 0) * hhtdae.angular_velocity(shaft, "z")
    law = lambda l, v: 100 * (l - 1)**3 + 2 * v          # called once, with two expressions

``if`` cannot be used in a formula, since values are not known yet when it is built: ``where(x > 0, a, b)`` selects a value in every evaluation,
as do ``minimum`` and ``maximum``. A function that cannot be written as a formula can be a ``callback``, at the cost of a call of Python in every
evaluation.
"""

import numbers
from contextlib import contextmanager

import numpy as np

from . import _core

__all__ = ["Expression", "Parameter", "TimeFunction", "abs_", "arccos", "arcsin", "arctan", "arctan2", "callback", "cbrt", "cos", "cosh", "exp",
           "harmonic", "hypot", "log", "log10", "logical_and", "logical_not", "logical_or", "maximum", "minimum", "polynomial", "sin", "sinh", "spline",
           "sqrt", "step", "step5", "tan", "tanh", "time_values", "where"]


CONDITIONS = ("less", "less_equal", "equal", "logical_not", "logical_and", "logical_or")

_describing = []  # not empty while a describing function runs, which is called again when parameters have changed


@contextmanager
def describing():
    """A context in which formulas of parameters are replaced by their present values."""
    _describing.append(True)
    try:
        yield
    finally:
        _describing.pop()


class Expression:
    """A formula that is evaluated by a run; made by operators and functions from measures, parameters and numbers."""

    __slots__ = ("op", "operands", "value", "__weakref__")
    __array_priority__ = 1000

    def __init__(self, op, operands=(), value=None):
        self.op, self.operands, self.value = op, tuple(operands), value

    __hash__ = object.__hash__

    def __add__(self, other): return _add(self, other)
    def __radd__(self, other): return _add(other, self)
    def __sub__(self, other): return _add(self, _negate(_expression(other)))
    def __rsub__(self, other): return _add(other, _negate(self))
    def __mul__(self, other): return _multiply(self, other)
    def __rmul__(self, other): return _multiply(other, self)
    def __truediv__(self, other): return _divide(self, other)
    def __rtruediv__(self, other): return _divide(other, self)
    def __pow__(self, other): return _power(self, other)
    def __rpow__(self, other): return _power(other, self)
    def __neg__(self): return _negate(self)
    def __pos__(self): return self
    def __abs__(self): return _unary("abs", self)
    def __lt__(self, other): return _node("less", self, other)
    def __le__(self, other): return _node("less_equal", self, other)
    def __gt__(self, other): return _node("less", other, self)
    def __ge__(self, other): return _node("less_equal", other, self)
    def __eq__(self, other): return _node("equal", self, other)
    def __ne__(self, other): return _node("logical_not", _node("equal", self, other))
    def __and__(self, other): return _node("logical_and", self, other)
    def __or__(self, other): return _node("logical_or", self, other)
    def __invert__(self): return _node("logical_not", self)

    def __bool__(self):
        raise TypeError("the value of this formula is known in a run only, 'if', 'and', 'or', min(), max(), numpy's comparisons and functions of arrays cannot ask for it: use "
                        "hhtdae.where(), &, |, hhtdae.minimum() and hhtdae.maximum(), which take arrays of formulas, or a hhtdae.callback()")

    def __float__(self):
        from .tracing import compile_tape, ordered

        if any(n.op in ("argument", "measure", "function") for n in ordered([self])):
            raise TypeError("the value of this formula is known in a run only; functions of `math` take numbers: use those of hhtdae or numpy, "
                            "or a hhtdae.callback()")
        if not _describing and any(n.op == "parameter" for n in ordered([self])):
            raise TypeError("this formula of parameters would be frozen at its present value here: describe the scene by a function that is called again, or take its get()")
        return float(compile_tape([self], {}, [])(np.empty(0))[0])

    def get(self):
        """The present value of a formula that contains only parameters and numbers."""
        with describing():
            return float(self)

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        function = _UFUNCS.get(ufunc.__name__)
        if method != "__call__" or function is None or options:
            raise TypeError("numpy's %s is not available in formulas of hhtdae: use another function, or a hhtdae.callback()" % ufunc.__name__)
        if not any(isinstance(x, np.ndarray) and x.ndim for x in inputs):
            return function(*[x[()] if isinstance(x, np.ndarray) else x for x in inputs])
        boxed = []
        for x in inputs:
            box = np.empty((), dtype=object)
            box[()] = x
            boxed.append(x.astype(object) if isinstance(x, np.ndarray) else box)
        return np.frompyfunc(function, len(inputs), 1)(*boxed)

    # numpy calls these for arrays of expressions.
    def sin(self): return _unary("sin", self)
    def cos(self): return _unary("cos", self)
    def tan(self): return _unary("tan", self)
    def arcsin(self): return _unary("asin", self)
    def arccos(self): return _unary("acos", self)
    def arctan(self): return _unary("atan", self)
    def arctan2(self, x): return _node("atan2", self, x)
    def sinh(self): return _unary("sinh", self)
    def cosh(self): return _unary("cosh", self)
    def tanh(self): return _unary("tanh", self)
    def exp(self): return _unary("exp", self)
    def log(self): return _unary("log", self)
    def log10(self): return _unary("log10", self)
    def sqrt(self): return _unary("sqrt", self)
    def cbrt(self): return _unary("cbrt", self)
    def hypot(self, y): return _node("hypot", self, y)
    def conjugate(self): return self

    def __repr__(self):
        from .tracing import ordered

        return "<formula of %d operations>" % len(ordered([self]))


class Parameter(Expression):
    """A named number of a scene's description, which may have another value in the next run, see `Scene.parameter`.

    Formulas of it, such as ``2 * stiffness``, may be given for any number of the description.
    """

    __slots__ = ("name", "_scene")

    def __init__(self, scene, name, core):
        super().__init__("parameter", (), core)
        self.name, self._scene = name, scene

    def get(self):
        """Its present value."""
        return self.value.value

    def set(self, value):
        """Changes its value: in formulas of the state at once, in the description for runs made from now on. Collective."""
        self._scene.set(**{self.name: value})

    def __reduce__(self):
        return _parameter, (self._scene, self.name)

    def __repr__(self):
        return "<parameter %s = %.12g>" % (self.name, self.get())


def _parameter(scene, name):
    return scene._parameters[name]


class TimeFunction:
    """A function of one number with its first two derivatives: of time in motions, or a table in formulas, ``f(expression)``.

    ``f(x)`` is its value at a number or at all numbers of an array; ``f.derivatives(x)`` is (f, f', f'').
    """

    __slots__ = ("_core", "_keep")

    def __init__(self, core, keep=()):
        self._core, self._keep = core, tuple(keep)

    def __call__(self, x):
        if isinstance(x, Expression):
            return Expression("table", (x,), self)
        if np.ndim(x):
            return np.array([self._core(float(y))[0] for y in np.ravel(x)]).reshape(np.shape(x))
        return self._core(float(x))[0]

    def derivatives(self, x):
        """(f, f', f'') at the number x."""
        return self._core(float(x))


class _Callback:
    __slots__ = ("function", "gradient")

    def __init__(self, function, gradient):
        self.function, self.gradient = function, gradient


# ---- construction of expressions, simplified where operands are 0 or 1 ----

def _expression(x):
    if isinstance(x, Expression):
        return x
    if isinstance(x, np.ndarray) and x.ndim == 0:
        return _expression(x[()])
    if isinstance(x, (numbers.Real, np.bool_)):
        return Expression("constant", (), float(x))
    raise TypeError("%r is no number and no formula" % (x,))


def _constant(x):
    return x.value if isinstance(x, Expression) and x.op == "constant" else None


def _arrays(function, *x):
    """Applies the function element by element to arrays, for operators with an array and an expression as operands"""
    return np.frompyfunc(function, len(x), 1)(*[y if isinstance(y, np.ndarray) else np.array(y, dtype=object) for y in x])


def _node(op, *operands):
    if any(isinstance(x, np.ndarray) and x.ndim for x in operands):
        return _arrays(lambda *x: _node(op, *x), *operands)
    nodes = [_expression(x) for x in operands]
    result = Expression(op, nodes)
    if all(n.op == "constant" for n in nodes):
        return _expression(float(result))
    return result


def _unary(op, x):
    return _node(op, x)


def _add(a, b):
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return _arrays(_add, a, b)
    a, b = _expression(a), _expression(b)
    if _constant(a) == 0:
        return b
    if _constant(b) == 0:
        return a
    if b.op == "negate":
        return _node("subtract", a, b.operands[0])
    return _node("add", a, b)


def _negate(a):
    if a.op == "negate":
        return a.operands[0]
    return _node("negate", a)


def _multiply(a, b):
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return _arrays(_multiply, a, b)
    a, b = _expression(a), _expression(b)
    for x, y in ((a, b), (b, a)):
        if _constant(x) == 0:
            return x
        if _constant(x) == 1:
            return y
    return _node("multiply", a, b)


def _divide(a, b):
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return _arrays(_divide, a, b)
    a, b = _expression(a), _expression(b)
    if _constant(b) == 1 or (_constant(a) == 0 and _constant(b) is None):
        return a
    return _node("divide", a, b)


def _power(a, b):
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return _arrays(_power, a, b)
    a, b = _expression(a), _expression(b)
    p = _constant(b)
    if p == 1:
        return a
    if p == 2:
        return _multiply(a, a)
    return _node("power", a, b)


_UFUNCS = {"add": _add, "subtract": lambda a, b: _add(a, _negate(_expression(b))), "multiply": _multiply, "divide": _divide, "true_divide": _divide,
           "power": _power, "negative": lambda a: _negate(_expression(a)), "positive": lambda a: a, "square": lambda a: _multiply(a, a),
           "reciprocal": lambda a: _divide(1., a), "absolute": lambda a: _unary("abs", a), "fabs": lambda a: _unary("abs", a),
           "arcsin": lambda a: _unary("asin", a), "arccos": lambda a: _unary("acos", a), "arctan": lambda a: _unary("atan", a),
           "arctan2": lambda a, b: _node("atan2", a, b), "hypot": lambda a, b: _node("hypot", a, b), "minimum": lambda a, b: _node("minimum", a, b),
           "maximum": lambda a, b: _node("maximum", a, b), "less": lambda a, b: _node("less", a, b), "greater": lambda a, b: _node("less", b, a),
           "less_equal": lambda a, b: _node("less_equal", a, b), "greater_equal": lambda a, b: _node("less_equal", b, a),
           "equal": lambda a, b: _node("equal", a, b), "not_equal": lambda a, b: _node("logical_not", _node("equal", a, b)),
           "logical_and": lambda a, b: _node("logical_and", a, b), "logical_or": lambda a, b: _node("logical_or", a, b),
           "logical_not": lambda a: _node("logical_not", a)}
for _name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "log10", "sqrt", "cbrt"):
    _UFUNCS[_name] = lambda a, _op=_name: _unary(_op, a)


def _by_elements(function, *x):
    """Applies a function to numbers and formulas, or element by element to arrays and lists of these; the result is a number if all operands are
    numbers"""
    x = [np.array(y, dtype=object) if isinstance(y, (list, tuple)) else y for y in x]
    arrays = [y for y in x if isinstance(y, np.ndarray)]
    result = _arrays(function, *x) if any(y.ndim for y in arrays) else function(*x)
    if any(isinstance(z, Expression) for y in x for z in (y.flat if isinstance(y, np.ndarray) else (y,))):
        return result
    return result.astype(float) if isinstance(result, np.ndarray) else float(result)


def _public(op, text, names=("x",)):
    def function(*x):
        if len(x) != len(names):
            raise TypeError("%s() takes %d arguments" % (function.__name__, len(names)))
        return _by_elements(lambda *y: _node(op, *y), *x)
    function.__doc__ = text + " of formulas, numbers or arrays of them."
    return function


sin, cos, tan = _public("sin", "Sine"), _public("cos", "Cosine"), _public("tan", "Tangent")
arcsin, arccos, arctan = _public("asin", "Inverse sine"), _public("acos", "Inverse cosine"), _public("atan", "Inverse tangent")
arctan2 = _public("atan2", "Angle of the point (x, y), arguments y, x,", ("y", "x"))
sinh, cosh, tanh = _public("sinh", "Hyperbolic sine"), _public("cosh", "Hyperbolic cosine"), _public("tanh", "Hyperbolic tangent")
exp, log, log10 = _public("exp", "Exponential"), _public("log", "Natural logarithm"), _public("log10", "Logarithm to base 10")
sqrt, cbrt, abs_ = _public("sqrt", "Square root"), _public("cbrt", "Cube root"), _public("abs", "Absolute value")
hypot = _public("hypot", "Length of (x, y)", ("x", "y"))
minimum, maximum = _public("minimum", "The lesser", ("x", "y")), _public("maximum", "The greater", ("x", "y"))
logical_and, logical_or = _public("logical_and", "Both", ("x", "y")), _public("logical_or", "One or both", ("x", "y"))
logical_not = _public("logical_not", "The contrary")
for _name in ("sin cos tan arcsin arccos arctan arctan2 sinh cosh tanh exp log log10 sqrt cbrt abs_ hypot minimum maximum logical_and logical_or "
              "logical_not").split():
    globals()[_name].__name__ = globals()[_name].__qualname__ = _name


def where(condition, a, b):
    """``a`` if the condition holds, else ``b``, selected in every evaluation; both are evaluated. Arrays are treated element by element.

    For a load that jumps at a time, a `Parameter` that an action of `Run.event` sets is better, see `time`. A force that jumps with the sign of
    a velocity, ideal Coulomb friction, has no solution while the body sticks, and steps become tiny there: regularize it, ``mu * tanh(v / v_slip)``,
    or let an event hold the body."""
    return _by_elements(_where, condition, a, b)


def _where(condition, a, b):
    if not isinstance(condition, Expression):
        return a if condition else b
    return _node("where", condition, a, b)


def _step(x, x0, h0, x1, h1, shape):
    if not isinstance(x0, Expression) and not isinstance(x1, Expression) and not -np.inf < x0 < x1 < np.inf:
        raise ValueError("a step from x = %g to x = %g must end after it begins, and be finite" % (x0, x1))
    s = (_expression(x) - x0) / (x1 - x0)
    return where(s <= 0, h0, where(s >= 1, h1, h0 + (h1 - h0) * shape(s)))


def step(x, x0, h0, x1, h1):
    """A step from h0 for x <= x0 to h1 for x >= x1 by a cubic, like Adams' STEP; its second derivative jumps at both ends."""
    return _by_elements(lambda *y: _step(*y, lambda s: s * s * (3 - 2 * s)), x, x0, h0, x1, h1)


def step5(x, x0, h0, x1, h1):
    """A step from h0 for x <= x0 to h1 for x >= x1 by a quintic, like Adams' STEP5: twice continuously differentiable."""
    return _by_elements(lambda *y: _step(*y, lambda s: s * s * s * (10 + s * (6 * s - 15))), x, x0, h0, x1, h1)


def callback(function, *arguments, gradient=None):
    """A formula that calls a Python function in every evaluation.

    Parameters
    ----------
    function : callable
        Takes as many numbers as there are `arguments`, returns a number. It should be smooth, and must depend on its arguments only.
    *arguments : Expression
        The arguments of the function.
    gradient : callable, optional
        Returns the derivatives by all arguments. Without it they are central differences: usually four calls for each argument in every
        evaluation of the Jacobian. The first two steps are 6e-6 and 8e-7 of the argument, or of 1 if it is smaller. If these differences
        disagree, because the argument is small in its unit, at a kink, or because the function is noisy, shorter steps follow, up to twenty calls.

    A call costs about a microsecond plus the time of the function; a formula costs some ten nanoseconds for each operation.
    """
    if not callable(function):
        raise TypeError("callback: %r cannot be called" % (function,))
    return Expression("function", [_expression(x) for x in arguments], _Callback(function, gradient))


# ---- functions of one number ----

def polynomial(coefficients):
    """c0 + c1 t + c2 t^2 + ... as a `TimeFunction`, or, if coefficients are formulas of parameters, as a function that is traced."""
    if any(isinstance(c, Expression) for c in coefficients):
        terms = list(coefficients)

        def horner(t):
            y = terms[-1]
            for c in reversed(terms[:-1]):
                y = y * t + c
            return y
        return horner
    return TimeFunction(_core.TimeFunction.polynomial(np.asarray(coefficients, dtype=float)))


def harmonic(amplitude, omega, phase=0., offset=0.):
    """offset + amplitude sin(omega t + phase) as a `TimeFunction`, or, if arguments are formulas of parameters, as a function that is traced;
    omega in radians per unit of time."""
    if any(isinstance(x, Expression) for x in (amplitude, omega, phase, offset)):
        return lambda t: offset + amplitude * sin(omega * t + phase)
    return TimeFunction(_core.TimeFunction.harmonic(amplitude, omega, phase, offset))


def spline(x, y):
    """Natural cubic spline through the points (x, y), x increasing, with linear extrapolation, as a `TimeFunction`: for example a measured
    motion, or the characteristic of a damper, ``spline(v, F)(hhtdae.rate(i, j))``."""
    if any(isinstance(z, Expression) for z in (*np.ravel(np.asarray(x, dtype=object)), *np.ravel(np.asarray(y, dtype=object)))):
        raise TypeError("the points of a spline are numbers; multiply its value by a formula, or describe the element by a function, see Scene.add()")
    return TimeFunction(_core.TimeFunction.spline(np.asarray(x, dtype=float), np.asarray(y, dtype=float)))


def time_values(function):
    """A `TimeFunction` from a Python function of a number that returns (f, f', f''); called at every evaluation."""
    return TimeFunction(_core.TimeFunction.values(function), [function])
