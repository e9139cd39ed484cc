"""Tutorial, step 3: forces and motions by formulas."""

import hhtdae

scene = hhtdae.Scene(gravity=(0, -9.81, 0))
rod = scene.rigid_body("rod", mass=2, inertia=hhtdae.inertia.box(2, (1, 0.05, 0.05)), position=(0.5, 0, 0))
base = scene.rigid_body("base", mass=1, position=(0, 1, 0))
tip, seat = rod.marker((0.5, 0, 0)), base.marker()
scene.connect("pin", hhtdae.Revolute, rod, scene.ground, (0, 0, 0), axis=(0, 0, 1))

# the base oscillates along x by 0.1 m, with a smooth start: a motion is a function of time
along = hhtdae.axes_along((1, 0, 0))
moved, rail = base.marker(axes=along), scene.ground.marker((0, 1, 0), along)
scene.add("guide", hhtdae.Translational(moved, rail))
scene.add("drive", hhtdae.TranslationalMotion(moved, rail, lambda t: 0.1 * (1 - hhtdae.cos(6 * t))))


# a stiffening spring with a damper between tip and base: tension as a function of length and rate
def tension(l, v):
    d = l - 1.2
    return 40 * d + 200 * d**3 + 1.5 * v


scene.add("spring", hhtdae.NonlinearSpring(tip, seat, tension))

run = scene.solve(2, tolerance=1e-8)

now = run.snapshot()
position, length = now.motion(tip).position, now.value(hhtdae.distance(tip, seat))
print("tip at 2 s: %.4f %.4f m, length of the spring %.4f m" % (position[0], position[1], length))
