"""Tutorial, step 2: recorded channels, questions to a run, pictures."""

import sys

import petsc4py

petsc4py.init(sys.argv)  # options of the command line: -scene_page tutorial2.html
import hhtdae

scene = hhtdae.Scene(gravity=(0, -9.81, 0))
bar = hhtdae.RigidBody(mass=2, inertia=hhtdae.inertia.box(2, (1, 0.05, 0.05)), position=(0.5, 0, 0))
rod = scene.add("rod", bar)
pin = scene.connect("pin", hhtdae.Revolute, rod, scene.ground, (0, 0, 0), axis=(0, 0, 1))
tip, end = rod.marker((0.5, 0, 0)), rod.marker((-0.5, 0, 0))

rod.shape(hhtdae.Shape.box((0.5, 0.025, 0.025)))  # for pictures: half edges
scene.channel("height", hhtdae.displacement(tip, "y"), "m")
x, y = hhtdae.joint_force(pin, "x"), hhtdae.joint_force(pin, "y")
scene.channel("load", hhtdae.sqrt(x**2 + y**2), "N")
scene.output(csv="tutorial2.csv", dt=0.01)

run = scene.solve(1, tolerance=1e-8, sample=0.01)  # run["height"], run["load"]; run.plot() by matplotlib

now = run.snapshot()
load = now.load(pin, end)
kinetic, potential = now.energy()
print("the pin's force on the rod at 1 s: %.3f %.3f N" % (load.force[0], load.force[1]))
print("kinetic energy at 1 s: %.4f J" % kinetic)
