"""A first scene: a rod on a pin, recorded channels, reactions, a plot.

Compared with the balance of energy: the kinetic energy is the potential energy that the centre of mass has lost.
"""

import sys

import hhtdae


def main(plot=False):
    scene = hhtdae.Scene(gravity=(0, -9.81, 0))
    rod = scene.add("rod", hhtdae.RigidBody(mass=2, inertia=hhtdae.inertia.box(2, (1, 0.05, 0.05)), position=(0.5, 0, 0)))
    pin = scene.connect("pin", hhtdae.Revolute, rod, scene.ground, point=(0, 0, 0))
    tip = rod.marker((0.5, 0, 0))
    scene.channel("height of the tip", hhtdae.displacement(tip, "y"), "m")
    scene.channel("reaction", hhtdae.sqrt(sum(hhtdae.joint_force(pin, c)**2 for c in "xyz")), "N")
    run = scene.solve(2, tolerance=1e-8)
    now = run.snapshot()
    kinetic, _ = now.energy()
    fallen = -now.motion(rod).position[1]
    print(run)
    print("tip at the end: %.6f m; largest reaction: %.4f N" % (run["height of the tip"][-1], run["reaction"].max()))
    print("kinetic energy %.6f J, lost in height %.6f J" % (kinetic, 2 * 9.81 * fallen))
    if plot:
        import matplotlib.pyplot as plt

        run.plot()
        plt.show()
    return kinetic - 2 * 9.81 * fallen, run["reaction"].max()


if __name__ == "__main__":
    main(plot="-plot" in sys.argv)
