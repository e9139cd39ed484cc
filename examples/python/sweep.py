"""A parameter sweep: a quarter car over a step in the road, described once, run with many springs and dampers.

Numbers of the description may be parameters, or formulas of them. Compared with the two linear equations of the car, solved by their matrix exponential.
"""

import numpy as np

import hhtdae

BODY, WHEEL, TIRE, STEP = 300., 40., 1.8e5, 0.05


def quarter_car():
    scene = hhtdae.Scene()
    stiffness, damping = scene.parameter("stiffness", 2e4), scene.parameter("damping", 1500)
    wheel, body = scene.rigid_body("wheel", mass=WHEEL), scene.rigid_body("body", mass=BODY, position=(0, 0, 0.4))
    axle, seat, ground = wheel.marker(), body.marker(), scene.ground.marker()
    scene.add("wheel's guide", hhtdae.Translational(axle, ground))
    scene.add("body's guide", hhtdae.Translational(seat, ground))
    scene.add("suspension", hhtdae.SpringDamper(seat, axle, stiffness=stiffness, damping=damping, length=0.4))
    scene.add("tire", hhtdae.UserForce(axle, force=[0, 0, TIRE * (STEP - hhtdae.displacement(axle, "z"))]))
    scene.channel("body", hhtdae.displacement(seat, "z") - 0.4, "m")
    scene.channel("acceleration", hhtdae.acceleration(seat, "z"), "m/s^2")
    return scene


def exact(k, c, t):
    """Height of the body, by the eigenvalues of the first-order system about its new rest"""
    A = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [-(k + TIRE) / WHEEL, k / WHEEL, -c / WHEEL, c / WHEEL], [k / BODY, -k / BODY, c / BODY, -c / BODY]])
    values, vectors = np.linalg.eig(A)
    start = np.linalg.solve(vectors, [-STEP, -STEP, 0, 0])
    return STEP + (vectors[1] * start * np.exp(np.multiply.outer(t, values))).sum(axis=-1).real


def main():
    scene, worst = quarter_car(), 0
    print("stiffness N/m  damping N s/m  highest m  rms acceleration m/s^2")
    for k in (1e4, 2e4, 4e4):
        for c in (500, 1500, 3000):
            scene.set(stiffness=k, damping=c)
            with scene.run(tolerance=1e-7, sample=0.002) as run:
                run.solve(1)
            print("%13.0f  %13.0f  %9.4f  %22.3f" % (k, c, run["body"].max(), np.sqrt(np.mean(run["acceleration"]**2))))
            worst = max(worst, abs(run["body"] - exact(k, c, run.times)).max())
    print("largest error of the body's height: %.1e m" % worst)
    return worst


if __name__ == "__main__":
    main()
