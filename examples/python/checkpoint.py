"""A run that is saved halfway and resumed by another program, with the same bits as an uninterrupted run."""

import os
import tempfile

import hhtdae


def model():
    scene = hhtdae.Scene(gravity=(0, -9.81, 0))
    upper = scene.rigid_body("upper", inertia=hhtdae.inertia.box(1, (1, 0.1, 0.1)), position=(0.5, 0, 0))
    lower = scene.rigid_body("lower", inertia=hhtdae.inertia.box(1, (1, 0.1, 0.1)), position=(1.5, 0, 0))
    scene.connect("shoulder", hhtdae.Revolute, upper, scene.ground, (0, 0, 0))
    scene.connect("elbow", hhtdae.Revolute, lower, upper, (1, 0, 0))
    tip = lower.marker((0.5, 0, 0))
    scene.channel("x", hhtdae.displacement(tip, "x"), "m")
    scene.channel("y", hhtdae.displacement(tip, "y"), "m")
    return scene


def main():
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "half")
        first = model().run(tolerance=1e-6).solve(1)
        first.save(file)
        first.solve(2)
        second = model().run(tolerance=1e-6).load(file).solve(2)
    for name, run in (("in one go", first), ("resumed", second)):
        print("%-10s x = %.17g, y = %.17g after %d steps" % (name, run["x"][-1], run["y"][-1], run.steps))
    return first["x"][-1] - second["x"][-1], first["y"][-1] - second["y"][-1]


if __name__ == "__main__":
    main()
