"""PETSc's src/ts/tutorials/ex44.c, bouncing balls found by TSEvent, run unmodified with the plug-in.

Between two bounces u'' = -g - Cd/2 u'|u'| has a solution in closed form, with and without drag. The script checks
every printed bounce time and every printed height against it.
usage: plugin_ex44.py libhhtdae.so ex44 mpiexec -n
"""

import math
import re
import sys

from common import check, run, tutorial

library, program = sys.argv[1], tutorial(sys.argv[2])
plugin = ["-dll_append", library, "-ts_type", "hhtdae"]
G, RESTITUTION, BOUNCES = 9.8, 0.9, 10


class Flight:
    """A ball thrown up at time t0 from height u0 with velocity v0"""

    def __init__(self, drag, t0, u0, v0):
        self.drag, self.t0, self.u0, self.v0 = drag, t0, u0, v0
        if drag:
            self.terminal = w = math.sqrt(2 * G / drag)
            self.up = w / G * math.atan(v0 / w)
            self.top = u0 + w * w / (2 * G) * math.log(1 + (v0 / w) ** 2)
            fall = w / G * math.acosh(math.exp(G * self.top / w**2))
            self.impact = w * math.tanh(G * fall / w)
        else:
            self.up = v0 / G
            self.top = u0 + v0 * v0 / (2 * G)
            fall = math.sqrt(2 * self.top / G)
            self.impact = G * fall
        self.end = t0 + self.up + fall

    def height(self, t):
        s = t - self.t0 - self.up
        if not self.drag:
            return self.top - G / 2 * s * s
        w = self.terminal
        if s < 0:
            return self.top + w * w / G * math.log(math.cos(G * s / w))
        return self.top - w * w / G * math.log(math.cosh(G * s / w))


def flights(drag, height, number):
    """The flights of the ball that starts at this height with velocity 20"""
    path = [Flight(drag, 0.0, height, 20.0)]
    while len(path) < number:
        last = path[-1]
        path.append(Flight(drag, last.end, 0.0, RESTITUTION * last.impact))
    return path


def one_ball(drag, tolerance):
    """Largest errors of bounce times and of heights on one rank"""
    out = run([program, *plugin, "-Cd", drag, "-ts_rtol", "0", "-ts_atol", tolerance,
               "-ts_event_monitor", "-ts_monitor", "-ts_monitor_solution", "::ascii_matlab"])
    path = flights(float(drag), 0.0, BOUNCES + 1)
    times = [float(t) for t in re.findall(r"Event 0 zero crossing located at time (\S+)", out)]
    # The start at u = 0 may be taken for a crossing, but must not be counted as a bounce.
    check(out.count("Ball hit the ground") == BOUNCES, "%d bounces instead of %d" % (out.count("Ball hit the ground"), BOUNCES))
    check("Ball bounced %d times" % BOUNCES in out, "the event that ends the run was not found")
    time_error = max(abs(t - f.end) for t, f in zip(times, path))

    # -ts_monitor prints the time of a step to six digits, and the solution's monitor the height that belongs to it.
    states = re.findall(r"TS dt \S+ time (\S+?)(?: \(r\))?\n.*?= \[\n(\S+)\n\]", out, re.DOTALL)
    check(len(states) > 2 * BOUNCES, "too few states were printed:\n" + out[-500:])
    height_error = 0.0
    for t, u in ((float(t), float(u)) for t, u in states):
        near = [f for f in path if f.t0 - 1e-3 <= t <= f.end + 1e-3]
        check(near, "a state at t = %g after the last bounce" % t)
        height_error = max(height_error, min(abs(u - f.height(t)) for f in near))
    print("Cd %-4s tolerance %s: bounce times within %.1e, heights within %.1e" % (drag, tolerance, time_error,
                                                                                   height_error))
    return time_error, height_error


# Without drag the acceleration is constant, and Newmark's formulas are exact: what is left is the six printed digits
# and TSEvent's tolerance on u, 1e-6.
time_error, height_error = one_ball("0", "1e-4")
check(time_error < 1e-4, "bounce times are off by %g" % time_error)
check(height_error < 1.5e-3, "heights are off by %g" % height_error)

# With drag the bounds are three times what was measured with alpha = -0.3.
previous = math.inf
for tolerance, bound in (("1e-4", 6e-3), ("1e-6", 3.5e-4)):
    time_error, height_error = one_ball("0.1", tolerance)
    check(time_error < bound, "bounce times are off by %g" % time_error)
    check(height_error < 4 * bound, "heights are off by %g" % height_error)
    check(time_error < previous, "a tighter tolerance gave worse bounce times")
    previous = time_error

# Two balls on two ranks meet the ground at different times; the steps are common, so both have to be found, until the
# first ball has made its last bounce.
out = run([*sys.argv[3:], 2, program, *plugin])
end = flights(0.0, 0.0, BOUNCES)[-1].end
for rank in (0, 1):
    exact = [f.end for f in flights(0.0, 5.0 * rank, BOUNCES) if f.end <= end]
    times = [float(t) for t in re.findall(r"\[%d\]: Ball hit the ground at t = *(\S+) seconds" % rank, out)]
    check(len(times) == len(exact), "rank %d: %d bounces instead of %d" % (rank, len(times), len(exact)))
    worst = max(abs(t - e) for t, e in zip(times, exact))
    print("two ranks: rank %d bounced %d times, within %.1e" % (rank, len(times), worst))
    check(worst < 0.006, "times printed with two decimals are off by %g on rank %d" % (worst, rank))
