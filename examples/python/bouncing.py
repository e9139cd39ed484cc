"""Contact: a ball that bounces on a plane, compared with Hertz's law.

The contact law k d^(3/2) has no losses here: at the deepest penetration all energy is in the contact, so that it is (5 m v^2 / (4 k))^(2/5) if the
weight is neglected, and every rebound reaches the height of the start.
"""

import hhtdae


def main():
    mass, radius, height, k, g = 0.2, 0.05, 0.5, 1e6, 9.81
    scene = hhtdae.Scene(gravity=(0, 0, -g))
    ball = scene.add("ball", hhtdae.RigidBody(mass, hhtdae.inertia.sphere(mass, radius), position=(0, 0, height + radius)))
    at = ball.marker()
    contact = scene.add("floor", hhtdae.SpherePlane(at, scene.ground.marker(), radius=radius, law=hhtdae.ContactLaw(stiffness=k, exponent=1.5)))
    scene.channel("gap", hhtdae.displacement(at, "z") - radius, "m")
    scene.channel("force", hhtdae.force(contact, 2), "N")
    run = scene.solve(2, tolerance=1e-8, sample=1e-4)
    gap = run["gap"]
    deepest = (2.5 * mass * g * height / k)**0.4
    later = gap[run.times > 0.5]
    print("%d steps; deepest %.4f mm, Hertz %.4f mm; largest force %.1f N" % (run.steps, -1e3 * gap.min(), 1e3 * deepest, run["force"].max()))
    print("rebounds reach %.5f m of %.5f m" % (later.max(), height))
    return -gap.min() / deepest - 1, later.max() / height - 1


if __name__ == "__main__":
    main()
