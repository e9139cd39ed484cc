"""Zeros of functions of the state between the ends of a step."""

import math

import numpy as np


def zero(f, a, fa, b, fb):
    """Where f leaves the sign that it has at a, to rounding, from the side of b > a: secants, halved values at an end that stays (Illinois), and bisection
    where these are slow or f is zero in a whole part."""
    side, sign = 0, math.copysign(1, fa)
    for k in range(200):
        near = 4e-16 * max(abs(a), abs(b))
        if b - a <= near:
            break
        if fb == 0 and side == 2:  # met exactly: ends here if f has its sign just before
            t = b - near
        else:
            t = 0.5 * (a + b) if k % 4 == 3 or fb == 0 else b - fb * (b - a) / (fb - fa)
        if not math.isfinite(t):
            t = 0.5 * (a + b)
        t = float(min(max(t, np.nextafter(a, b)), np.nextafter(b, a)))  # a zero within rounding of an end
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
    """Finds passages of functions through zero, each in the step in which it happens, from their values at both ends. What happens between two steps, a
    jump of the velocities by an action, is no passage.

    A function that is zero where a step begins, as it is after an event, is looked at from a thousandth of that step on, or of the time since
    its last event where that is shorter: bounces become as short as one likes.

    The step after an event begins with other accelerations and reactions than the one before ended with, by the error of the step, so that functions
    of these may be back a little on the side that they come from. They have passed for all that, and do not pass again until they are twice as far
    away from zero as they were there: test Reactions.
    """

    def __init__(self, directions=()):
        self.directions, self.last, self.side, self.back = [], [], [], []
        for direction in directions:
            self.add(direction)

    def add(self, direction):
        self.directions.append(int(direction))
        self.last.append((-math.inf, math.inf))  # time of its last passage, and since the one before
        self.side.append(0.)  # a value on the side where it was before the passage; 0: the state has been changed since then
        self.back.append(0.)  # the value where the step after the passage began, if it was on that side

    def note(self, k, time):
        """A passage has happened, and the next step begins there"""
        before = self.last[k][0]
        self.last[k] = time, time - before

    def changed(self):
        """Somebody has changed the state where the next step begins: on which side functions are there is no error"""
        self.side = [0.] * len(self.side)

    def passed(self, begin, end, at):
        """(time, number) of all passages between two times of one step, in order of time; at(k, t) is function k there"""
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
