"""Modes and meshes as arrays: a free beam's frequencies, mode shapes, stress modes; a reduced body in a file.

The shapes at the nodes are numpy arrays; with meshio installed, body.to_meshio(eta).write("mode.vtu") writes a picture. Compared with beam theory
(Euler-Bernoulli bending and stretching of a slender free beam).
"""

import os
import tempfile

import numpy as np
from beam_mesh import beam_mesh


def main():
    from hhtdae import flexible

    L, depth, E, density = 1., 0.02, 7e10, 2700.
    with tempfile.TemporaryDirectory() as folder:
        mesh = beam_mesh(os.path.join(folder, "beam.msh"), L, depth, depth, n=(20, 1, 1))
        model = flexible.FeModel.from_mesh(mesh, flexible.Material(E, 0., density))
    print("%d nodes, cells: %s" % (model.nodes, {k: v.shape for k, v in model.elements.cells().items()}))
    body = flexible.reduce(model, [], method="free_free", modes=24, stress=True)
    roots = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])
    bending = roots**2 / (2 * np.pi * L**2) * np.sqrt(E * depth**2 / (12 * density))
    found = body.frequencies[:6:2]  # each comes twice, along y and along z
    stress = np.array([abs(body.stress[:, 0, k]).max() for k in range(len(body.frequencies))])
    print("mode  frequency Hz  axial stress at most, MPa per unit of the mode")
    for k, f in enumerate(body.frequencies[:6]):
        print("%4d  %12.4f  %10.3f" % (k, f, 1e-6 * stress[k]))
    print("beam theory:", "  ".join("%.4f" % f for f in bending))
    stretching = np.sqrt(E / density) / (2 * L)
    nearest = body.frequencies[np.argmin(abs(body.frequencies - stretching))]
    print("stretching: %.3f Hz, theory %.3f Hz" % (nearest, stretching))
    return abs(found / bending - 1).max(), abs(nearest / stretching - 1)


if __name__ == "__main__":
    main()
