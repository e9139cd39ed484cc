"""Zeros of functions of the state between the ends of a step."""

import math


def zero(f, a, fa, b, fb):
    """Where f changes its sign between a and b, to rounding, from the side of b: secants, halved values at an end that stays (Illinois), and
    bisection where these are slow."""
    side = 0
    for k in range(200):
        if abs(b - a) <= 4e-16 * max(abs(a), abs(b)):
            break
        t = 0.5 * (a + b) if k % 4 == 3 else b - fb * (b - a) / (fb - fa)
        if not min(a, b) < t < max(a, b):
            break
        ft = f(t)
        if ft == 0:
            return t
        if math.copysign(1, ft) == math.copysign(1, fb):
            b, fb = t, ft
            fa, side = (0.5 * fa if side == 1 else fa), 1
        else:
            a, fa = t, ft
            fb, side = (0.5 * fb if side == -1 else fb), -1
    return b


class Signs:
    """Values at the end of the last step of functions whose zeros are sought.

    A function that is zero where a step begins, as it is after an event, is looked at from a thousandth of that step on.
    """

    def __init__(self, directions):
        self.directions = [int(d) for d in directions]
        self.values = [0.] * len(self.directions)
        self.time = None

    def begin(self, time, values, zeros=()):
        """The values at a time; those of `zeros`, by number, are zero there"""
        self.time, self.values = time, [0. if k in zeros else v for k, v in enumerate(values)]

    def passed(self, time, values, at):
        """(time, number) of all passages of the step that ends at a time, in order of time; at(k, t) is function k inside of the step"""
        found = []
        for k, (before, after, direction) in enumerate(zip(self.values, values, self.directions)):
            begin = self.time
            if before == 0:
                begin = self.time + 1e-3 * (time - self.time)
                before = at(k, begin)
            if before * after < 0 or (after == 0 and before != 0):
                if direction == 0 or (direction > 0) == (before < 0):
                    found.append((zero(lambda t: at(k, t), begin, before, time, after) if after != 0 else time, k))
        self.begin(time, values)
        return sorted(found)
