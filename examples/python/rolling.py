"""A ball that rolls down a slope without slip: acceleration 5/7 g sin(angle), friction 2/7 m g sin(angle)."""

import numpy as np

import hhtdae


def main():
    angle, mass, radius, g = 0.3, 2., 0.1, 9.81
    slope = hhtdae.rotation((0, 1, 0), angle)
    scene = hhtdae.Scene(gravity=(0, 0, -g))
    ball = scene.add("ball", hhtdae.RigidBody(mass, hhtdae.inertia.sphere(mass, radius), position=radius * slope[:, 2]))
    ball.shape(hhtdae.Shape.sphere(radius))
    ramp = scene.ground.marker(axes=slope)
    roll = scene.add("rolling", hhtdae.RollingSphere(ball.marker(), ramp, radius=radius))
    scene.channel("down the slope", hhtdae.displacement(ball.marker(), "x", ramp, ramp), "m")
    run = scene.solve(2, tolerance=1e-7)
    now = run.snapshot()
    friction = np.linalg.norm(now.load(roll, ball.marker(), ramp).force[:2])
    way, exact = run["down the slope"][-1], 0.5 * 5 / 7 * g * np.sin(angle) * 4
    print("way %.6f m, exact %.6f m" % (way, exact))
    print("friction %.6f N, exact %.6f N" % (friction, 2 / 7 * mass * g * np.sin(angle)))
    return way / exact - 1, friction / (2 / 7 * mass * g * np.sin(angle)) - 1


if __name__ == "__main__":
    main()
