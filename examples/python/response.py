"""Frequency response: a tuned absorber on a shaken base, by the scene's linearization and by scipy.signal from its state space.

Compared with the closed form of the two equations of motion.
"""

import numpy as np

import hhtdae

M, K, m, k, c = 10., 4000., 1., 330., 6.


def main():
    scene = hhtdae.Scene()
    main_mass, absorber = scene.rigid_body("main mass", mass=M), scene.rigid_body("absorber", mass=m, position=(0, 0, 0.2))
    i, j, ground = main_mass.marker(), absorber.marker(), scene.ground.marker()
    foot = scene.ground.marker((0, 0, -0.5))
    for name, marker in (("first guide", i), ("second guide", j)):
        scene.add(name, hhtdae.Translational(marker, ground))
    scene.add("spring", hhtdae.SpringDamper(i, foot, stiffness=K))
    scene.add("tuned spring", hhtdae.SpringDamper(j, i, stiffness=k, damping=c))
    small = scene.run().linearize()
    for mode in small.modes():
        print(mode)
    push, z = hhtdae.Excitation.force(i, (0, 0, 1)), hhtdae.displacement(i, "z")
    w = np.linspace(5, 40, 60)
    h = small.response(push, z, w)
    exact = (k - m * w**2 + 1j * w * c) / ((K + k - M * w**2 + 1j * w * c) * (k - m * w**2 + 1j * w * c) - (k + 1j * w * c)**2)
    A, B, C, D = small.state_space([push], [z])
    by_states = np.array([(C @ np.linalg.solve(1j * x * np.eye(len(A)) - A, B) + D)[0, 0] for x in w])
    print("largest amplitude %.3e m/N at %.2f rad/s; without the absorber's damper it would be at %.2f" % (abs(h).max(), w[abs(h).argmax()], np.sqrt(K / M)))
    error = max(abs(h / exact - 1).max(), abs(by_states / exact - 1).max())
    print("largest relative difference from the closed form: %.1e" % error)
    return error


if __name__ == "__main__":
    main()
