"""A flexible body: a finite-element model of a beam is reduced, clamped in a scene, loaded at its tip, and let go.

Deflection, stress at the surface halfway along the beam and the frequency of the free vibration are compared with beam theory. Meshes come from Gmsh or any
program that writes its files, matrices from CalculiX, from files or from memory: see hhtdae.flexible.FeModel.
"""

import os
import tempfile

import numpy as np
from beam_mesh import beam_mesh, clamped_free

import hhtdae

LENGTH, DEPTH, E, DENSITY, LOAD = 1., 0.05, 2e11, 8000., 1000.


def main():
    from hhtdae import flexible

    with tempfile.TemporaryDirectory() as folder:
        mesh = beam_mesh(os.path.join(folder, "beam.msh"), LENGTH, DEPTH, DEPTH)
        model = flexible.FeModel.from_mesh(mesh, flexible.Material(E, 0., DENSITY))
    body = flexible.reduce(model, [flexible.Attachment("root"), flexible.Attachment("tip")], modes=8, stress=True)
    scene = hhtdae.Scene()
    load = scene.parameter("load", LOAD)
    beam = scene.add("beam", hhtdae.FlexibleBody(body.modal()))
    scene.add("clamp", hhtdae.Fixed(beam.attachment("root").marker(), scene.ground.marker()))
    tip = beam.attachment("tip").marker()
    scene.add("load", hhtdae.UserForce(tip, force=[0, 0, -load]))
    scene.channel("tip", hhtdae.displacement(tip, "z"), "m")
    rest = scene.run().equilibrium()
    now = rest.snapshot()
    deflection, stress = now.motion(tip).position[2], body.von_mises(now.modes(beam))
    I = DEPTH**4 / 12
    middle = np.argmin(np.abs(body.coordinates[:, 0] - 0.5) + np.abs(body.coordinates[:, 2] - DEPTH / 2))
    exact = -LOAD * LENGTH**3 / (3 * E * I), LOAD * 0.5 * LENGTH * DEPTH / 2 / I
    print("deflection %.4f mm, beam theory %.4f mm" % (1e3 * deflection, 1e3 * exact[0]))
    print("stress half way %.3f MPa, beam theory %.3f MPa" % (1e-6 * stress[middle], 1e-6 * exact[1]))
    scene.set(load=0)
    run = scene.run(after=rest, tolerance=1e-7, sample=1e-4, options={"ts_hhtdae_alpha": -0.01}).solve(0.2)
    z = run["tip"]
    k = np.flatnonzero((z[:-1] < 0) & (z[1:] >= 0))  # passages upwards
    passages = run.times[k] - z[k] * (run.times[k + 1] - run.times[k]) / (z[k + 1] - z[k])
    frequency, theory = (len(k) - 1) / (passages[-1] - passages[0]), clamped_free(LENGTH, DEPTH, DEPTH, E, DENSITY)
    print("let go it oscillates with %.3f Hz, beam theory %.3f Hz" % (frequency, theory))
    return deflection / exact[0] - 1, stress[middle] / exact[1] - 1, frequency / theory - 1


if __name__ == "__main__":
    main()
