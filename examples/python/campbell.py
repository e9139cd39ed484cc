"""Campbell diagram: natural frequencies of a disc on an elastic shaft against its speed, compared with Stodola's equation.

python3 campbell.py -plot shows it.
"""

import sys

import numpy as np

import hhtdae

LENGTH, RADIUS, DISC, MASS, E, G = 0.5, 0.01, 0.15, 8., 2.1e11, 8e10
I = np.pi * RADIUS**4 / 4


def rotor(speed):
    scene = hhtdae.Scene()
    spin = (0, 0, speed)
    hub = scene.rigid_body("hub", inertia=hhtdae.inertia.cylinder(1, 0.02, 0.05), angular_velocity=spin)
    disc = scene.rigid_body("disc", mass=MASS, inertia=hhtdae.inertia.disc(MASS, DISC), position=(0, 0, LENGTH), angular_velocity=spin)
    along = hhtdae.axes_along((1, 0, 0), x=(0, 0, 1))
    scene.connect("bearing", hhtdae.Revolute, hub, scene.ground, (0, 0, 0))
    scene.add("shaft", hhtdae.Beam(disc.marker(axes=along), hub.marker(axes=along), length=LENGTH, E=E, G=G, area=np.pi * RADIUS**2, Iyy=I, Izz=I, J=2 * I))
    return scene, disc


def bending(speed):
    """Circular frequencies of modes that bend the shaft, slowest first"""
    scene, disc = rotor(speed)
    small, found = scene.run().linearize(), []
    for mode in small.modes():
        part = small.part(mode, disc)
        if mode.value.imag > 1 and np.linalg.norm(part.displacement[:2]) + np.linalg.norm(part.rotation[:2]) > 1e-6:
            found.append(mode.value.imag)
    return sorted(found)


def stodola(speed):
    J, L = MASS * DISC**2 / 4, LENGTH
    M, C = np.diag([MASS, J]), np.diag([0, 2 * J * speed])
    K = E * I * np.array([[12 / L**3, -6 / L**2], [-6 / L**2, 4 / L]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [np.linalg.solve(M, K), np.linalg.solve(M, C)]])
    return sorted(abs(np.linalg.eigvals(A)))


def main(speeds=7, plot=False):
    rows, worst = [], 0
    print("    1/min  frequencies of bending, Hz")
    for rpm in np.linspace(0, 6000, speeds):
        found, exact = np.array(bending(rpm * np.pi / 30)), np.array(stodola(rpm * np.pi / 30))
        rows.append([rpm, *found / (2 * np.pi)])
        worst = max(worst, abs(found / exact - 1).max())
        print("%9.0f" % rpm + "".join("  %10.4f" % f for f in rows[-1][1:]))
    print("largest relative difference from Stodola's equation: %.1e" % worst)
    if plot:
        import matplotlib.pyplot as plt

        rows = np.array(rows)
        plt.plot(rows[:, 0], rows[:, 1:])
        plt.plot(rows[:, 0], rows[:, 0] / 60, "--", label="once per turn")
        plt.xlabel("1/min"), plt.ylabel("Hz"), plt.legend()
        plt.show()
    return worst


if __name__ == "__main__":
    main(speeds=61 if "-plot" in sys.argv else 7, plot="-plot" in sys.argv)
