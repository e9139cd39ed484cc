"""The integrator as a time stepper of petsc4py: ts.setType("hhtdae"), with all options of PETSc.

Two masses on springs with a rigid rod between them: three unknowns, x1, x2 and the force of the rod. From the command line:
    python3 time_stepper.py -ts_view -ts_hhtdae_summary -ts_hhtdae_alpha -0.1
"""

import math
import sys

import petsc4py

if __name__ == "__main__":
    petsc4py.init(sys.argv)
from petsc4py import PETSc

import hhtdae


def residual(ts, t, u, v, a, f):
    f.array = [a[0] + 100 * u[0] + u[2], 2 * a[1] - u[2], u[0] - u[1] + 1]


def jacobian(ts, t, u, v, a, shift_v, shift_a, J, P):
    P.setValues(range(3), range(3), [shift_a + 100, 0, 1, 0, 2 * shift_a, -1, 1, -1, 0])
    P.assemble()
    return True


def main():
    J = PETSc.Mat().createDense([3, 3], comm=PETSc.COMM_SELF)
    J.setUp()
    u, v = J.createVecRight(), J.createVecRight()
    u.array = [0.1, 1.1, 0]
    ts = PETSc.TS().create(comm=PETSc.COMM_SELF)
    ts.setType("hhtdae")
    ts.setI2Function(residual, u.duplicate())
    ts.setI2Jacobian(jacobian, J)
    ts.setSolution2(u, v)
    ts.setMaxTime(1)
    ts.setMaxSteps(100000)
    ts.setExactFinalTime(PETSc.TS.ExactFinalTime.MATCHSTEP)
    ts.setTolerances(rtol=1e-7, atol=1e-7)
    hhtdae.integrator.set_alpha(ts, -0.05)
    ts.setFromOptions()
    ts.solve(u)
    exact = 0.1 * math.cos(math.sqrt(100 / 3))
    s = hhtdae.statistics(ts)
    print("%d steps, %d residuals, %d factorizations" % (s.steps, s.residuals, s.factorizations))
    print("x1(1) = %.6f, exact %.6f; force of the rod %.4f" % (u[0], exact, u[2]))
    error = u[0] - exact
    ts.destroy()
    return error


if __name__ == "__main__":
    main()
