"""What joints, motions and forces share: fields for the C++ part, formulas of parameters in them, documentation."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, fields
from typing import Any, Callable, Sequence, Union

import numpy as np

from .expressions import Expression
from .measures import description
from .tracing import compile_tape, trace

Number = Union[float, Expression]
Vector = Sequence[float]
Formula = Union[float, Expression]
Law = Callable[[Expression, Expression], Expression]


def _zero():
    return field(default=(0., 0., 0.))


def has_formula(x):
    """Whether a number, or one of an array, is a formula"""
    if isinstance(x, Expression):
        return True
    if isinstance(x, (tuple, list)):
        return any(has_formula(y) for y in x)
    return isinstance(x, np.ndarray) and x.dtype == object and any(has_formula(y) for y in x.flat)


def plain(x):
    """The same with the present values of formulas"""
    if isinstance(x, Expression):
        return float(x)
    if isinstance(x, (tuple, list)):
        return [plain(y) for y in x]
    if isinstance(x, np.ndarray) and x.dtype == object:
        return [plain(y) for y in x]
    return x


def _law(f, keep):
    return compile_tape([trace(f, 2, "a force law")], {}, keep, 2)


class Spec:
    """What elements share: their fields for the C++ part"""

    _functions = {}  # fields that are functions: how they are converted

    def _convert(self, keep):
        """The functions, once"""
        converted = {}
        for name, how in self._functions.items():
            x = getattr(self, name)
            if x is not None:
                converted[name] = how(x, keep)
        return converted

    def _numbers(self):
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in self._functions}

    def _described(self):
        """Whether it depends on parameters"""
        return any(has_formula(x) or (isinstance(x, Spec) and x._described()) for x in self._numbers().values())

    def _fields(self, converted):
        out = dict(converted)
        for name, x in self._numbers().items():
            out[name] = x._fields({}) if isinstance(x, Spec) else x if hasattr(x, "_id") else plain(x)
        return out


def _expressions(many, keep):
    return [description(x, keep) for x in many]


if sys.version_info >= (3, 11):
    from typing import dataclass_transform
else:
    def dataclass_transform(**options):
        return lambda decorator: decorator


@dataclass_transform(eq_default=False)
def _spec(cls):
    """A data class that is compared by identity, with what all elements share in its documentation"""
    cls = dataclass(eq=False)(cls)
    if cls.__doc__ and {"i", "j"} <= {f.name for f in fields(cls)}:
        cls.__doc__ += _MARKERS + (_STATE if "state" in {f.name for f in fields(cls)} else "")
    return cls


_MARKERS = """

    i, j : Marker
        On the body that is acted on, and on the one that takes the reaction.
"""
_STATE = """    state : bool
        Its components are unknowns of the equations, force states.
"""


@_spec
class _Joint(Spec):
    i: Any
    j: Any
