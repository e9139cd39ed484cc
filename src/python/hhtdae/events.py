"""Finds zeros of functions of the state within a step."""

import math

import numpy as np


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


class Signs:
    """Finds passages of functions through zero within a step, from their values at both ends of the step. A change of sign between two steps,
    caused by an action that makes velocities jump, is not a passage.

    A function that is zero at the beginning of a step, as after an event, is evaluated from a thousandth of that step on, or of the time since
    its last event if that is shorter, so that arbitrarily short bounces are found.

    The step after an event begins with accelerations and reactions that differ from those at the end of the step before by the error of the step. So
    functions of these may be slightly back on the side from which they came. This does not count as a further passage until they are twice as far
    away from zero as at that beginning: test Reactions.
    """

    def __init__(self, directions=()):
        self.directions, self.last, self.side, self.back = [], [], [], []
        for direction in directions:
            self.add(direction)

    def add(self, direction):
        self.directions.append(int(direction))
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

    def passed(self, begin, end, at):
        """The pairs (time, number of the function) of all passages between two times of one step, in order of time; at(k, t) is the value of
        function k at t"""
        found = []
        for k, direction in enumerate(self.directions):
            start, before, after = begin, at(k, begin), at(k, end)
            last, pause = self.last[k]
            if last == begin:
                self.back[k] = before if before * self.side[k] > 0 else 0.
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
        return sorted(found)
