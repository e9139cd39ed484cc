"""Finds zeros of functions of the state within a step."""

import math
import zlib

import numpy as np

from .tracing import ordered


def zero(f, a, fa, b, fb):
    """The smallest t > a, to rounding, at which f no longer has the sign that it has at a, where b > a: by the Illinois variant of regula falsi,
    and by bisection if that converges slowly or f is zero in a whole interval."""
    side, sign = 0, math.copysign(1, fa)
    for k in range(200):
        near = 4e-16 * max(abs(a), abs(b))
        if b - a <= near:
            break
        if fb == 0 and side == 2:  # f(b) is exactly zero: done if f still has its sign just before b
            t = b - near
        else:
            t = 0.5 * (a + b) if k % 4 == 3 or fb == 0 else b - fb * (b - a) / (fb - fa)
        if not math.isfinite(t):
            t = 0.5 * (a + b)
        t = float(min(max(t, np.nextafter(a, b)), np.nextafter(b, a)))  # t stays strictly between a and b if the zero is within rounding of one
        ft = f(t)
        if ft * sign > 0:
            a, fa = t, ft
            fb, side = (0.5 * fb if side == -1 else fb), -1
        elif ft == 0:
            side = 2 if fb != 0 else 1
            b, fb = t, ft
        else:
            b, fb = t, ft
            fa, side = (0.5 * fa if side == 1 else fa), 1
    return b


def identity(formula, direction):
    """A number by which the event of a formula is recognized in another run of the scene, or in another process"""
    place, text = {}, []
    for n in ordered([formula]):
        place[id(n)] = len(place)
        if n.op == "measure":
            value = [x._id if hasattr(x, "_id") else x for x in n.value]
        else:
            value = n.name if n.op == "parameter" else n.value if n.op == "constant" else ""
        text.append((n.op, [place[id(x)] for x in n.operands], value))
    return float(zlib.crc32(repr((text, direction)).encode()))


def of_positions(formula):
    """Whether a formula depends on positions and time alone, so that nothing but moved bodies changes its sign"""
    kinds = ("displacement", "distance", "angle", "modal", "time")
    return all(n.op not in ("parameter", "function") and (n.op != "measure" or n.value[0] in kinds) for n in ordered([formula]))


class Signs:
    """Finds passages of functions through zero within a step, from their values at both ends of the step. A change of sign between two steps,
    caused by an action that makes velocities jump, is not a passage.

    A function that is zero at the beginning of a step, as after an event, is evaluated from a thousandth of that step on, or of the time since
    its last event if that is shorter, so that arbitrarily short bounces are found.

    The step after an event begins with accelerations and reactions that differ from those at the end of the step before by the error of the step. So
    functions of these may be slightly back on the side from which they came. This does not count as a further passage until they are twice as far
    away from zero as at that beginning: test Reactions.

    A run that continues another one begins with positions that are projected on the constraints, and functions of these may be back as well. If parameters
    have changed, too, this is told from a new place of the bodies by its size: at most `largest_return` of the value before the passage, where bodies
    move by a part of the tolerance. Tests Events.test_not_again and Events.test_again_elsewhere of test_continued.py.
    """

    largest_return = 1e-3

    def __init__(self, directions=()):
        self.directions, self.names, self.last, self.side, self.back = [], [], [], [], []
        self.within = math.inf  # part of the values before the passage by which functions may be back at the beginning of the next step
        for direction in directions:
            self.add(direction)

    def add(self, direction, name=0.):
        """Adds a function; name: its identity()"""
        self.directions.append(int(direction))
        self.names.append(name)
        self.last.append((-math.inf, math.inf))  # time of the last passage, and time between it and the one before
        self.side.append(0.)  # a value with the sign before the passage; 0 if an action has changed the state since then
        self.back.append(0.)  # the value at the beginning of the step after the passage if it has that sign, else 0

    def note(self, k, time):
        """Records a passage of function k, at which the next step begins"""
        before = self.last[k][0]
        self.last[k] = time, time - before

    def changed(self):
        """To be called if the state was changed at the beginning of the next step: the signs of functions there are then not due to errors of the
        step"""
        self.side = [0.] * len(self.side)

    def numbers(self, known=lambda k: True):
        """All that must be known of each function in another run; known: whether it is to be known of function k"""
        return [float(x) for k, name in enumerate(self.names) if known(k) for x in (name, *self.last[k], self.side[k], self.back[k])]

    def resume(self, numbers):
        """Takes numbers() of another run over; functions that it had not are new"""
        known = {}
        for k in range(0, len(numbers), 5):
            known.setdefault(numbers[k], []).append(numbers[k + 1:k + 5])
        for k, name in enumerate(self.names):
            found = known.get(name)
            time, pause, self.side[k], self.back[k] = found.pop(0) if found else (-math.inf, math.inf, 0., 0.)
            self.last[k] = time, pause

    def passed(self, begin, end, at):
        """The pairs (time, number of the function) of all passages between two times of one step, in order of time; at(k, t) is the value of
        function k at t"""
        found = []
        for k, direction in enumerate(self.directions):
            start, before, after = begin, at(k, begin), at(k, end)
            last, pause = self.last[k]
            if last == begin:
                self.back[k] = before if before * self.side[k] > 0 and abs(before) <= self.within * abs(self.side[k]) else 0.
            if before == 0 or last == begin:
                start = begin + 1e-3 * (min(end - begin, pause) if last == begin else end - begin)
                before = at(k, start)
            if self.back[k] and 0 < before / self.back[k] <= 2:
                continue
            self.back[k] = 0.
            if before * after < 0 or (after == 0 and before != 0):
                if direction == 0 or (direction > 0) == (before < 0):
                    self.side[k] = before
                    found.append((zero(lambda t: at(k, t), start, before, end, after), k))
        self.within = math.inf
        return sorted(found)
