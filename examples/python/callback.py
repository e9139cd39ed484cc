"""A force that is not given by a formula: a Python function that the run calls, and the cost of the calls.

The law is a spring; the same run with the law as a formula shows the cost.
"""

import math
import time

import hhtdae


def oscillator(law):
    scene = hhtdae.Scene()
    mass = scene.add("mass", hhtdae.PointMass(2, position=(0.3, 0, 0)))
    x = hhtdae.displacement(mass.marker(), "x")
    scene.add("spring", hhtdae.UserForce(mass.marker(), force=[law(x), 0, 0]))
    scene.channel("x", x, "m")
    return scene


def main():
    calls = []

    def spring(x):  # could be a table, a fitted network or another program
        calls.append(x)
        return -50 * x

    last = {}
    for name, law in (("formula", lambda x: -50 * x), ("callback", lambda x: hhtdae.callback(spring, x, gradient=lambda x: [-50.]))):
        begun = time.perf_counter()
        run = oscillator(law).solve(5, tolerance=1e-7)
        last[name] = run["x"][-1]
        print("%-8s  %d steps, %.0f us a step, x = %.7f" % (name, run.steps, 1e6 * (time.perf_counter() - begun) / run.steps, last[name]))
    exact = 0.3 * math.cos(5 * 5)
    print("exact x = %.7f; Python was called %d times" % (exact, len(calls)))
    return last["callback"] - exact, last["callback"] - last["formula"]


if __name__ == "__main__":
    main()
