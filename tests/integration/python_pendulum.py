"""A pendulum in Cartesian coordinates from petsc4py, with the plug-in loaded through PETSC_OPTIONS.

x'' + 2 x l = 0,  y'' + 2 y l + g = 0,  x^2 + y^2 - 1 = 0: index 3, the multiplier l is the third unknown. The angle's
ordinary differential equation, solved with far smaller steps, is the reference for position, velocity and rod force.
usage: python_pendulum.py libhhtdae.so
"""

import math
import os
import sys

from common import check, skip

os.environ["PETSC_OPTIONS"] = "-dll_append " + sys.argv[1]
try:
    import petsc4py

    petsc4py.init([sys.argv[0]])
    from petsc4py import PETSc
except ImportError as error:
    skip("petsc4py is not installed for %s (Debian: python3-petsc4py): %s" % (sys.executable, error))

G, END, ANGLE, RATE = 9.81, 2.0, 1.0, 0.5  # angle from the downward vertical


def residual(ts, t, u, v, a, f):
    x, y, l = u.array_r
    f.array = [a[0] + 2 * x * l, a[1] + 2 * y * l + G, x * x + y * y - 1]


def jacobian(ts, t, u, v, a, shift_v, shift_a, J, P):
    x, y, l = u.array_r
    P.zeroEntries()
    P.setValues(range(3), range(3), [shift_a + 2 * l, 0, 2 * x, 0, shift_a + 2 * l, 2 * y, 2 * x, 2 * y, 0])
    P.assemble()
    if J != P:
        J.assemble()
    return True


def reference():
    """Angle and rate at END by the classical Runge-Kutta method: 20000 steps leave rounding"""
    n = 20000
    h, p, w = END / n, ANGLE, RATE
    for _ in range(n):
        k1 = w, -G * math.sin(p)
        k2 = w + h / 2 * k1[1], -G * math.sin(p + h / 2 * k1[0])
        k3 = w + h / 2 * k2[1], -G * math.sin(p + h / 2 * k2[0])
        k4 = w + h * k3[1], -G * math.sin(p + h * k3[0])
        p += h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        w += h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
    return p, w


def pendulum(tolerance):
    """Position with multiplier, velocity, and the number of steps at t = END"""
    J = PETSc.Mat().createAIJ([3, 3], nnz=3, comm=PETSc.COMM_SELF)
    J.setValues(range(3), range(3), [0.0] * 9)
    J.assemble()
    u, v, f = J.createVecRight(), J.createVecRight(), J.createVecRight()
    u.array = [math.sin(ANGLE), -math.cos(ANGLE), 0.0]
    v.array = [RATE * math.cos(ANGLE), RATE * math.sin(ANGLE), 0.0]
    ts = PETSc.TS().create(comm=PETSc.COMM_SELF)
    ts.setType("hhtdae")
    ts.setI2Function(residual, f)
    ts.setI2Jacobian(jacobian, J)
    ts.setSolution2(u, v)
    ts.setMaxTime(END)
    ts.setTimeStep(1e-3)
    ts.setExactFinalTime(PETSc.TS.ExactFinalTime.MATCHSTEP)
    ts.setTolerances(rtol=0.0, atol=tolerance)
    ts.setMaxSteps(100000)
    ts.setFromOptions()
    ts.solve(u)
    check(ts.getType() == "hhtdae", "the type is %s" % ts.getType())
    check(abs(ts.getTime() - END) < 1e-12, "the run ended at t = %g" % ts.getTime())
    u, v = ts.getSolution2()
    return u.array.copy(), v.array.copy(), ts.getStepNumber()


p, w = reference()
position = math.sin(p), -math.cos(p)
velocity = w * math.cos(p), w * math.sin(p)
multiplier = (w * w + G * math.cos(p)) / 2  # the rod pulls with 2 l per unit of length and mass
previous = None
for tolerance in (1e-4, 1e-6, 1e-8):
    u, v, steps = pendulum(tolerance)
    error = max(abs(u[0] - position[0]), abs(u[1] - position[1]))
    error_v = max(abs(v[0] - velocity[0]), abs(v[1] - velocity[1]))
    error_l = abs(u[2] - multiplier)
    print("tolerance %g: %d steps, error in q %.1e, in q' %.1e, in lambda %.1e, constraint %.1e"
          % (tolerance, steps, error, error_v, error_l, abs(u[0] ** 2 + u[1] ** 2 - 1)))
    check(abs(u[0] ** 2 + u[1] ** 2 - 1) < tolerance, "the constraint is violated")
    # A tolerance on q stands behind errors of tol^(2/3) in q, q' and tol^(1/3) in the multiplier, since h ~ tol^(1/3).
    check(error < 6 * tolerance ** (2 / 3), "the position is off")
    check(error_v < 50 * tolerance ** (2 / 3), "the velocity is off")
    check(error_l < 25 * tolerance ** (1 / 3), "the multiplier is off")
    if previous:
        check(error < previous[0] / 3 and steps > 3 * previous[1], "a tighter tolerance did not buy accuracy with steps")
    previous = error, steps
