"""Common part of joints, motions and forces: fields for the C++ part, formulas of parameters in them, documentation."""

from __future__ import annotations

import copy
import numbers
import sys
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from typing import Any, Callable, Sequence, Union

import numpy as np

from .expressions import Expression, Parameter
from .measures import description
from .tracing import compile_tape, ordered, trace

Number = Union[float, Expression]
Vector = Sequence[float]
Formula = Union[float, Expression]
Law = Callable[[Expression, Expression], Expression]


def _zero():
    return field(default=(0., 0., 0.))


def number(x, name):
    """Converts a number to float; an error names it"""
    if isinstance(x, np.ndarray) and x.ndim == 0:
        x = x[()]
    if not isinstance(x, numbers.Real):
        raise TypeError("%s is %r, must be a number" % (name, x))
    return float(x)


def text(x, who):
    """Checks that a name is a string"""
    if not isinstance(x, str):
        raise TypeError("%s: the name is %r, must be a text" % (who, x))
    return x


def formulas(x):
    """The list of those numbers that are formulas; x: a number or an array"""
    if isinstance(x, Expression):
        return [x]
    if isinstance(x, (tuple, list)):
        return [f for y in x for f in formulas(y)]
    return [y for y in x.flat if isinstance(y, Expression)] if isinstance(x, np.ndarray) and x.dtype == object else []


def check_parameters(nodes, scene, who):
    """Checks that parameters belong to the scene, since it is not notified of changed parameters of another scene"""
    for p in nodes:
        if isinstance(p, Parameter) and p._scene is not scene:
            raise ValueError("%s: parameter %s is of another scene; use one that parameter() of this scene has made" % (who, p.name))


def check_measures(nodes, scene, who):
    """Checks that measures are of markers and elements of the scene, whose numbers would stand for others"""
    for n in nodes:
        if n.op == "measure" and any(getattr(x, "_number", scene.ground._number) != scene.ground._number for x in n.value):
            raise ValueError("%s: %r is of another scene; make it of markers, bodies and elements of this one" % (who, n))


def has_formula(x, scene, who):
    """Whether a number of the description, or one in an array, is a formula of the scene's parameters"""
    found = formulas(x)
    nodes = ordered(found)
    if any(n.op in ("measure", "argument", "function") for n in nodes):
        raise TypeError("%s is a formula of the state or of time, must be a number or a formula of parameters alone; what depends on the state is described by "
                        "UserForce, UserScalarForce, NonlinearSpring or UserConstraint" % who)
    check_parameters(nodes, scene, who)
    return bool(found)


def plain(x):
    """x with formulas replaced by their present values"""
    if isinstance(x, Expression):
        return float(x)
    if isinstance(x, (tuple, list)):
        return [plain(y) for y in x]
    if isinstance(x, np.ndarray) and x.dtype == object:
        return [plain(y) for y in x]
    return x


def copied(x, known=None):
    """A deep copy of lists, dictionaries, arrays and data classes; other objects, above all formulas and parameters, are not copied. Used for
    descriptions that are read again later and must not change meanwhile"""
    known = {} if known is None else known
    if id(x) in known:
        return known[id(x)]
    if type(x) is tuple:
        return tuple(copied(y, known) for y in x)
    if isinstance(x, np.ndarray):
        return x.copy()
    if type(x) is list:
        y = known[id(x)] = []
        y.extend(copied(z, known) for z in x)
        return y
    if type(x) is dict:
        y = known[id(x)] = {}
        y.update((key, copied(z, known)) for key, z in x.items())
        return y
    if is_dataclass(x) and not isinstance(x, type):
        y = known[id(x)] = copy.copy(x)
        for f in fields(x):
            object.__setattr__(y, f.name, copied(getattr(x, f.name), known))
        return y
    return x


def _law(f, keep):
    y = trace(f, 2, "a force law")
    if any(n.op == "measure" for n in ordered([y])):
        raise TypeError("a force law depends on its two arguments and on parameters alone, not on time or measures: use UserScalarForce with a formula of "
                        "these, hhtdae.distance(i, j) and hhtdae.rate(i, j), or hhtdae.angle(i, j)")
    return compile_tape([y], {}, keep, 2)


class Spec:
    """Base of elements: their fields for the C++ part"""

    _functions = {}  # for fields that are functions: how to convert them

    def _convert(self, keep, who):
        """The functions of the element, converted once"""
        converted = {}
        for name, how in self._functions.items():
            x = getattr(self, name)
            if x is not None:
                try:
                    converted[name] = how(x, keep)
                except TypeError as error:
                    raise TypeError("%s: %s: %s" % (who, name, error)) from error
        return converted

    def _numbers(self):
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in self._functions}

    def _check(self, who):
        """An error if a field is None, unless that is its default, or it is a marker, which the library checks"""
        for f in fields(self):
            if getattr(self, f.name) is None and f.default is not None and f.type not in (Any, "Any"):
                raise TypeError("%s: %s is None, must be a value%s" % (who, f.name, "" if f.default is MISSING and f.default_factory is MISSING else "; leave it out for its default"))

    def _described(self, scene, who):
        """Whether the element depends on parameters"""
        self._check(who)
        return any([x._described(scene, "%s: %s" % (who, name)) if isinstance(x, Spec) else has_formula(x, scene, "%s: %s" % (who, name)) for name, x in self._numbers().items()])

    def _fields(self, converted):
        out = dict(converted)
        for name, x in self._numbers().items():
            out[name] = x._fields({}) if isinstance(x, Spec) else x if hasattr(x, "_id") else plain(x)
        return out


def _expressions(many, keep):
    if isinstance(many, (Expression, str)) or callable(many) or not np.iterable(many):
        raise TypeError("must be a list of formulas, as [0, 0, hhtdae.sin(hhtdae.time())], is %r" % (many,))
    return [description(x, keep) for x in many]


if sys.version_info >= (3, 11):
    from typing import dataclass_transform
else:
    def dataclass_transform(**options):
        return lambda decorator: decorator


@dataclass_transform(eq_default=False)
def _spec(cls):
    """Makes a data class that is compared by identity, and adds the fields that all elements have to its documentation"""
    cls = dataclass(eq=False)(cls)
    if cls.__doc__ and {"i", "j"} <= {f.name for f in fields(cls)}:
        cls.__doc__ += _MARKERS + (_STATE if "state" in {f.name for f in fields(cls)} else "")
    return cls


_MARKERS = """

    i, j : Marker
        Markers on the body on which the element acts, and on the body on which the reaction acts.
"""
_STATE = """    state : bool
        Whether its components are unknowns of the equations, force states.
"""


@_spec
class _Joint(Spec):
    i: Any
    j: Any
