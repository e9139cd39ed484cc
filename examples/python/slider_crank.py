"""Inverse dynamics of a slider-crank: which torque turns the crank at constant speed?

Motions and joints leave no freedom, so that positions, velocities, accelerations and loads follow from the motion alone, position by position, without a run
in time. Compared with the power balance of the closed form of the slider's motion.
"""

import numpy as np

import hhtdae

R, L, MASS, SPEED = 0.1, 0.3, 2.0, 50.0  # crank, rod (without mass) in m; slider in kg; rad/s


def main():
    scene = hhtdae.Scene(planar=True)
    crank = scene.rigid_body("crank", mass=0, inertia=np.zeros((3, 3)))
    rod = scene.rigid_body("rod", mass=0, inertia=np.zeros((3, 3)), position=(R, 0, 0))
    slider = scene.rigid_body("slider", mass=MASS, position=(R + L, 0, 0))
    shaft, bearing = crank.marker(), scene.ground.marker()
    scene.add("bearing", hhtdae.Revolute(shaft, bearing))
    scene.add("crank pin", hhtdae.Revolute(rod.marker(), crank.marker((R, 0, 0))))
    scene.add("piston pin", hhtdae.Revolute(slider.marker(), rod.marker((L, 0, 0))))
    scene.add("guide", hhtdae.Translational(slider.marker(), scene.ground.marker()))
    drive = scene.add("drive", hhtdae.RotationalMotion(shaft, bearing, lambda t: SPEED * t))
    scene.start(assembly="project")
    run = scene.run()
    angles, torque = np.linspace(0, 2 * np.pi, 37), []
    for angle in angles:
        torque.append(run.kinematics(angle / SPEED).snapshot().load(drive, shaft).moment[2])
    # x = R cos(p) + sqrt(L^2 - R^2 sin(p)^2): the torque is m x'' x' / speed.
    s, c = np.sin(angles), np.cos(angles)
    w = np.sqrt(L**2 - R**2 * s**2)
    x1 = -R * s - R**2 * s * c / w
    x2 = -R * c - R**2 * (c**2 - s**2) / w - R**4 * s**2 * c**2 / w**3
    exact = MASS * SPEED**2 * x2 * x1
    print("angle  torque Nm      exact")
    for row in list(zip(np.degrees(angles), torque, exact))[::6]:
        print("%5.0f  %9.4f  %9.4f" % row)
    return np.max(np.abs(torque - exact)) / np.max(np.abs(exact))


if __name__ == "__main__":
    main()
