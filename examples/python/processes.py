"""A sweep on two processes: scenes are sent to the processes of a pool, which return runs as their results.

A wagon runs into a buffer, a spring and a damper that act from x = 0 on; the deepest compression for several dampings is compared with the closed form.
"""

import math
import multiprocessing

import hhtdae

MASS, STIFFNESS, SPEED = 2.0, 800.0, 3.0


@hhtdae.model
def buffer(damping):
    scene = hhtdae.Scene()
    wagon = scene.add("wagon", hhtdae.PointMass(mass=MASS, velocity=(SPEED, 0, 0)))
    x, v = hhtdae.displacement(wagon.marker(), "x"), hhtdae.velocity(wagon.marker(), "x")
    scene.add("buffer", hhtdae.UserForce(wagon.marker(), force=[-STIFFNESS * x - damping * v, 0, 0]))
    scene.channel("x", x, "m")
    return scene


def job(scene):
    return scene.solve(0.15, tolerance=1e-7)


def deepest(damping):
    omega, ratio = math.sqrt(STIFFNESS / MASS), damping / (2 * math.sqrt(STIFFNESS * MASS))
    return SPEED / omega * math.exp(-ratio / math.sqrt(1 - ratio**2) * math.acos(ratio))


def main():
    dampings = [5.0, 10.0, 20.0, 40.0]
    with multiprocessing.Pool(2) as pool:
        results = pool.map(job, [buffer(c) for c in dampings])
    worst = 0.0
    for c, r in zip(dampings, results):
        worst = max(worst, abs(r["x"].max() - deepest(c)))
        print("damping %4.1f N s/m: %.4f m, closed form %.4f m" % (c, r["x"].max(), deepest(c)))
    return worst


if __name__ == "__main__":
    main()
