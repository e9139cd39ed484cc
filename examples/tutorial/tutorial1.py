"""Tutorial, step 1: a rod on a pin is let go and swings."""

import hhtdae

scene = hhtdae.Scene(gravity=(0, -9.81, 0))

# 1 m long, 2 kg, along x; its centre half a metre from the pin
bar = hhtdae.RigidBody(mass=2, inertia=hhtdae.inertia.box(2, (1, 0.05, 0.05)), position=(0.5, 0, 0))
rod = scene.add("rod", bar)
scene.connect("pin", hhtdae.Revolute, rod, scene.ground, (0, 0, 0), axis=(0, 0, 1))
tip = rod.marker((0.5, 0, 0))

run = scene.solve(1, tolerance=1e-8)

position = run.snapshot().motion(tip).position
print("tip at 1 s: %.5f %.5f m" % (position[0], position[1]))
