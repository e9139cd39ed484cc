"""A fast top in steady precession with spin w, lean th and turning rate W, a root of  A W^2 cos(th) - C w W + m g l = 0  (moments of inertia C about the axis,
A perpendicular to it). Started with the smaller root, the top keeps its lean.
"""

import numpy as np

import hhtdae

MASS, ARM, LEAN, SPIN, G = 0.5, 0.1, 0.5, 200., 9.81


def main():
    J = hhtdae.inertia.disc(MASS, 0.05)
    C, A = J[2, 2], J[0, 0] + MASS * ARM**2
    # SPIN is the angular velocity about the axis, including the component of the precession:
    W = np.roots([A * np.cos(LEAN), -C * SPIN, MASS * G * ARM]).min()
    axis = np.array([np.sin(LEAN), 0, np.cos(LEAN)])
    across = np.array([0, 0, W]) - axis * axis[2] * W
    spin = across + SPIN * axis
    scene = hhtdae.Scene(gravity=(0, 0, -G))
    top = scene.add("top", hhtdae.RigidBody(mass=MASS, inertia=J, position=ARM * axis, rotation=hhtdae.rotation((0, 1, 0), LEAN), angular_velocity=spin,
                                            velocity=np.cross(spin, ARM * axis)))
    scene.add("tip", hhtdae.Spherical(top.marker((0, 0, -ARM)), scene.ground.marker()))
    for c in "xyz":
        scene.channel(c, hhtdae.displacement(top.marker(), c) / ARM)
    run = scene.solve(2, tolerance=1e-7)
    lean = np.arccos(run["z"])
    angle = np.unwrap(np.arctan2(run["y"], run["x"]))
    print("%d steps for %.0f turns" % (run.steps, SPIN * 2 / (2 * np.pi)))
    print("lean %.6f to %.6f rad, at the start %.6f" % (lean.min(), lean.max(), LEAN))
    print("turning rate %.6f rad/s, exact %.6f" % (angle[-1] / 2, W))
    return np.ptp(lean), angle[-1] / 2 / W - 1


if __name__ == "__main__":
    main()
