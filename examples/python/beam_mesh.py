"""A straight beam as a mesh file, where Gmsh is not at hand: a helper of the examples with flexible bodies."""

import numpy as np


def beam_mesh(file, length=1., depth=0.05, width=0.05, n=(10, 1, 1)):
    """A straight beam along x of bricks with 20 nodes, as a mesh of Gmsh: volume "beam", node sets "root" and "tip"."""
    tag, nodes = {}, []
    nx, ny, nz = n
    for i in range(2 * nx + 1):
        for j in range(2 * ny + 1):
            for k in range(2 * nz + 1):
                if i % 2 + j % 2 + k % 2 <= 1:
                    tag[i, j, k] = len(tag) + 1
                    nodes.append((length * i / (2 * nx), depth * (j / (2 * ny) - 0.5), width * (k / (2 * nz) - 0.5)))

    def element(kind, physical, corners, edges):
        middle = [tuple((a + b) // 2 for a, b in zip(corners[p], corners[q])) for p, q in edges]
        elements.append("%d %d 2 %d %d %s" % (len(elements) + 1, kind, physical, physical, " ".join(str(tag[c]) for c in list(corners) + middle)))

    elements = []
    square, cube = [(0, 0), (2, 0), (2, 2), (0, 2)], [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    edges = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
    for j in range(ny):
        for k in range(nz):
            for physical, i in ((1, 0), (2, 2 * nx)):
                element(16, physical, [(i, 2 * j + a, 2 * k + b) for a, b in square], [(0, 1), (1, 2), (2, 3), (3, 0)])
            for i in range(nx):
                element(17, 3, [(2 * i + a, 2 * j + b, 2 * k + c) for a, b, c in cube], edges)
    with open(file, "w") as out:
        out.write("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"root\"\n2 2 \"tip\"\n3 3 \"beam\"\n$EndPhysicalNames\n")
        out.write("$Nodes\n%d\n" % len(nodes) + "".join("%d %.17g %.17g %.17g\n" % ((k + 1,) + x) for k, x in enumerate(nodes)) + "$EndNodes\n")
        out.write("$Elements\n%d\n" % len(elements) + "\n".join(elements) + "\n$EndElements\n")
    return file


def clamped_free(length, depth, width, young, density):
    """First frequency of bending of a slender beam that is clamped at one end, after Euler and Bernoulli"""
    return 1.8751040687119611**2 / (2 * np.pi * length**2) * np.sqrt(young * depth**2 / (12 * density))
