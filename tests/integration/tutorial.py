"""The tutorial's programs print what its text shows, in C++ and in Python, and that is right: a rod with one degree of freedom is integrated here by itself.

usage: tutorial.py source-tree directory-of-programs scratch [python path-of-package]
"""

import math
import os
import re
import shutil
import sys

from common import check, run

tree, programs, scratch = sys.argv[1:4]
python, package = (sys.argv[4:6] + [None, None])[:2]
source = os.path.join(tree, "examples", "tutorial")
os.makedirs(scratch, exist_ok=True)
shutil.copy(os.path.join(source, "beam.msh"), scratch)

with open(os.path.join(tree, "src", "docs", "tutorial.md")) as file:
    steps = re.split(r"^## Step \d: ", file.read(), flags=re.M)[1:]
check(len(steps) == 5, "the tutorial has %d steps, not 5" % len(steps))
shown = ["\n".join(line.strip() for line in re.search(r"It prints\n\n((?: {4}.*\n)+)", step).group(1).splitlines()) for step in steps]


def numbers(text):
    return [float(x) for x in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?", text)]


def words(text):
    return re.sub(r"-?\d+(?:\.\d+)?", "#", text).split()


def same(n, printed, where):
    """Words as they stand; numbers to one in the last digit, or a thousandth"""
    check(words(printed) == words(shown[n]), "step %d, %s, prints\n%s\nand not\n%s" % (n + 1, where, printed, shown[n]))
    digits = [len(x.partition(".")[2]) for x in re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?", shown[n])]
    for x, y, d in zip(numbers(printed), numbers(shown[n]), digits):
        check(abs(x - y) <= max(2 * 10**-d, 1e-3 * abs(y)), "step %d, %s: %g, shown is %g" % (n + 1, where, x, y))


done = 0
for n in range(5):
    program = os.path.join(programs, "tutorial%d" % (n + 1))
    if os.path.exists(program):
        same(n, run([program], cwd=scratch, OMPI_MCA_ess_singleton_isolated="1"), "C++")
        done += 1
    if python and (n < 4 or os.path.exists(program)):  # without SLEPc neither has flexible bodies
        same(n, run([python, "-B", os.path.join(source, "tutorial%d.py" % (n + 1))], cwd=scratch, PYTHONPATH=package, OMPI_MCA_ess_singleton_isolated="1"),
             "Python")
        done += 1
check(done >= 4, "only %d programs were there" % done)

# ---- the rod by itself: J a'' = moment(t, a, a'), a from the x axis ----

M, G = 2., 9.81
J = M / 12 * (1 + 0.05**2) + M * 0.25


def swing(moment, end, steps=20000):
    """Runge and Kutta's method of order four; angle and rate at the end"""
    a, w, h = 0., 0., end / steps
    f = lambda t, a, w: (w, moment(t, a, w) / J)
    for k in range(steps):
        t = k * h
        a1, w1 = f(t, a, w)
        a2, w2 = f(t + h / 2, a + h / 2 * a1, w + h / 2 * w1)
        a3, w3 = f(t + h / 2, a + h / 2 * a2, w + h / 2 * w2)
        a4, w4 = f(t + h, a + h * a3, w + h * w3)
        a, w = a + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), w + h / 6 * (w1 + 2 * w2 + 2 * w3 + w4)
    return a, w


def near(what, value, exact, allowed):
    check(abs(value - exact) <= allowed, "%s: %.6g in the tutorial, %.6g by itself" % (what, value, exact))


weight = lambda a: -M * G * 0.5 * math.cos(a)
a, w = swing(lambda t, a, w: weight(a), 1.)
x, y = numbers(shown[0])[1:]
near("x of the tip", x, math.cos(a), 2e-5)
near("y of the tip", y, math.sin(a), 5e-5)
alpha = weight(a) / J
fx, fy = numbers(shown[1].splitlines()[0])[1:]
near("force along x", fx, M * 0.5 * (-alpha * math.sin(a) - w * w * math.cos(a)), 2e-3)
near("force along y", fy, M * (0.5 * (alpha * math.cos(a) - w * w * math.sin(a)) + G), 2e-3)
near("kinetic energy", numbers(shown[1].splitlines()[1])[1], J * w * w / 2, 5e-4)


def spring(seat, seat_rate, law):
    """Moment of a force along the line from the tip to a seat, by its length and rate"""
    def moment(t, a, w):
        (sx, sy), (vx, vy) = seat(t), seat_rate(t)
        c, s = math.cos(a), math.sin(a)
        dx, dy = sx - c, sy - s
        l = math.hypot(dx, dy)
        rate = (dx * (vx + w * s) + dy * (vy - w * c)) / l
        return law(l, rate) / l * (c * dy - s * dx)
    return moment


push = spring(lambda t: (0.1 * (1 - math.cos(6 * t)), 1.), lambda t: (0.6 * math.sin(6 * t), 0.), lambda l, v: 40 * (l - 1.2) + 200 * (l - 1.2)**3 + 1.5 * v)
a, w = swing(lambda t, a, w: weight(a) + push(t, a, w), 2.)
_, x, y, length = numbers(shown[2])
near("x of the tip, step 3", x, math.cos(a), 2e-4)
near("y of the tip, step 3", y, math.sin(a), 2e-4)
near("length of the spring", length, math.hypot(0.1 * (1 - math.cos(12)) - math.cos(a), 1 - math.sin(a)), 2e-4)

for line in shown[3].splitlines():
    k, rest, frequency, ratio = numbers(line)
    hold = lambda a, w=0.: weight(a) + spring(lambda t: (1., 1.), lambda t: (0., 0.), lambda l, v: k * (l - 0.8) + 0.5 * v)(0., a, w)
    low, high = -0.5, 0.5
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if hold(middle) > 0 else (low, middle)
    e = 1e-5
    stiffness, damping = (hold(low - e) - hold(low + e)) / (2 * e), (hold(low, -e) - hold(low, e)) / (2 * e)
    near("rest at %g N/m" % k, rest, math.sin(low), 1e-4)
    near("frequency at %g N/m" % k, frequency, math.sqrt(stiffness / J) / (2 * math.pi), 2e-4)
    near("damping at %g N/m" % k, ratio, damping / (2 * math.sqrt(stiffness * J)), 1e-4)

beam = (4.730040745 / 1.)**2 / (2 * math.pi) * math.sqrt(2.1e11 * 0.005**2 / 12 / 7850)  # free at both ends, Euler and Bernoulli
near("first mode of the strip", numbers(shown[4])[0], beam, 0.01 * beam)
print("%d programs" % done)
