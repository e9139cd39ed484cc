"""Errors of a run by tolerance, the table of the README: a pendulum of 1 m, released from the horizontal, for 5 s, against the exact solution.

The tolerance bounds the error of positions in one step; the table has the largest error of the whole run over the largest value. The exact angle
is 2 asin(k sn(w t + K, k)) with k = sin(45 deg), w = sqrt(g / L), and sn by descending arithmetic-geometric means (Abramowitz, Stegun, 16.4).
"""

import numpy as np

import hhtdae

GRAVITY, END = 9.81, 5.


def residual(t, q, v, a):
    return [a[0], a[1] + GRAVITY]


def rod(t, q):
    return [(q[0]**2 + q[1]**2 - 1) / 2]  # the multiplier is the tension per metre


def elliptic(u, k):
    """sn(K + u) of modulus k"""
    a, c, n = [1.], [k], 0
    b = np.sqrt(1 - k * k)
    while c[-1] > 1e-16:
        a, b, c, n = a + [(a[-1] + b) / 2], np.sqrt(a[-1] * b), c + [(a[-1] - b) / 2], n + 1
    phi = 2**n * a[-1] * (u + np.pi / (2 * a[-1]))
    for m in range(n, 0, -1):
        phi = (phi + np.arcsin(c[m] / a[m] * np.sin(phi))) / 2
    return np.sin(phi)


def exact(t):
    """Positions, velocities (2, times) and the tension (times,)"""
    k, w = np.sin(np.pi / 4), np.sqrt(GRAVITY)
    sn = elliptic(w * t, k)
    angle, c = 2 * np.arcsin(k * sn), 2 * GRAVITY * k * k
    speed = -np.sign(elliptic(w * t - 1e-7, k) - elliptic(w * t + 1e-7, k)) * np.sqrt(np.maximum(0, 2 * GRAVITY * np.cos(angle)))
    q = np.array([np.sin(angle), -np.cos(angle)])
    return q, speed * np.array([np.cos(angle), np.sin(angle)]), 3 * c * np.cos(angle)


def errors(tolerance, order):
    """Steps, and largest errors of position, velocity and tension over their largest values"""
    run = hhtdae.solve_mechanism(residual, (0, END), [1, 0], [0, 0], constraints=rod, rtol=tolerance, atol=tolerance, trace=True,
                                 options={"ts_hhtdae_order": order})
    found = run.q, run.v, run.multipliers[0]
    return [run.statistics.steps] + [np.abs(x - y).max() / np.abs(y).max() for x, y in zip(found, exact(run.t))]


def main(tolerances=(1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)):
    print("| tolerance | steps | position | velocity | tension | order chosen: steps | position | velocity | tension |")
    print("|" + "---|" * 9)
    table = []
    for tolerance in tolerances:
        row = errors(tolerance, "2") + errors(tolerance, "auto")
        table.append(row)
        print("| %.0e | %d | %.1e | %.1e | %.1e | %d | %.1e | %.1e | %.1e |" % (tolerance, *row))
    return tuple(row[k] for row in table for k in (1, 5))


if __name__ == "__main__":
    main()
