"""Tutorial, step 5: the rod becomes a flexible strip, from a finite-element mesh."""

import hhtdae
from hhtdae import flexible

model = flexible.FeModel.from_mesh("beam.msh", {"steel": flexible.Material(2.1e11, 0.3, 7850)})
# node sets at which joints, forces and markers act
body = flexible.reduce(model, [flexible.Attachment("left"), flexible.Attachment("right")], modes=6, stress=True)
print("first mode of the free strip: %.3f Hz" % body.frequencies[0])

scene = hhtdae.Scene(gravity=(0, -9.81, 0))
# two percent of critical to 100 Hz, ten to 1000 Hz and beyond
rod = scene.add("rod", hhtdae.FlexibleBody(body.modal(), damping=[(100, 0.02), (1000, 0.1)]))
left, right = rod.attachment("left"), rod.attachment("right")
scene.connect("pin", hhtdae.Revolute, left, scene.ground, (0, 0, 0), axis=(0, 0, 1))
tip, root = right.marker(), left.marker()

run = scene.solve(0.5, tolerance=1e-7)

now = run.snapshot()
bent = now.relative_motion(tip, root).position  # position of the tip relative to the root
stress = body.von_mises(now.modes(rod))
print("at 0.5 s: deflection %.4f mm, largest stress %.4f MPa" % (1e3 * bent[1], 1e-6 * stress.max()))
