"""A pendulum from its equations of motion, in the manner of scipy.integrate.solve_ivp.

The rod is a constraint, x^2 + y^2 = 1, of index 3. The bottom is an event. With trace=True the two functions are called once, with formulas, and run in
C++ from there on. Compared with the exact period, 4 K(sin(45 deg)) / sqrt(g).
"""

import math

import hhtdae


def residual(t, q, v, a):
    return [a[0], a[1] + 9.81]


def rod(t, q):
    return [q[0]**2 + q[1]**2 - 1]


def bottom(t, q, v):
    return q[0]


def main():
    solution = hhtdae.solve_mechanism(residual, (0, 2), q0=[1, 0], v0=[0, 0], constraints=rod, events=bottom, rtol=1e-8, atol=1e-8, trace=True)
    mean, b = 1., math.cos(math.pi / 4)  # the arithmetic-geometric mean gives the elliptic integral
    for _ in range(6):
        mean, b = (mean + b) / 2, math.sqrt(mean * b)
    period = 2 * math.pi / mean / math.sqrt(9.81)
    found = 2 * (solution.t_events[0][1] - solution.t_events[0][0])
    print(solution.message, "after", solution.statistics.steps, "steps")
    print("tension of the rod at the end: %.4f N" % (2 * solution.multipliers[0, -1]))
    print("period %.6f s, exact %.6f s" % (found, period))
    return found / period - 1


if __name__ == "__main__":
    main()
