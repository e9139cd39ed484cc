"""Tutorial, step 4: parameters, static equilibrium, natural frequencies."""

import hhtdae

scene = hhtdae.Scene(gravity=(0, -9.81, 0))
k = scene.parameter("stiffness", 100)  # parameters have to be defined first
rod = scene.rigid_body("rod", mass=2, inertia=hhtdae.inertia.box(2, (1, 0.05, 0.05)), position=(0.5, 0, 0))
scene.connect("pin", hhtdae.Revolute, rod, scene.ground, (0, 0, 0), axis=(0, 0, 1))
tip, hook = rod.marker((0.5, 0, 0)), scene.ground.marker((1, 1, 0))
scene.add("spring", hhtdae.SpringDamper(tip, hook, stiffness=k, damping=0.5, length=0.8))

for stiffness in (50, 100, 200):
    scene.set(stiffness=stiffness)
    with scene.run() as run:
        run.equilibrium()
        height = run.snapshot().motion(tip).position[1]
        mode = run.linearize().modes()[0]
        print("%.0f N/m: the tip rests at %.4f m, %.4f Hz, damping ratio %.4f" % (stiffness, height, mode.frequency, mode.damping_ratio))
