"""The T10 beam of uwsbel/Total-Lagrangian-FEA by hhtdae and by that program's method, backward Euler with a direct factorization
in every iteration of Newton's method, on the same finite-element equations and the same processor.

usage: t10_beam.py BUILD/bin/solidbeam [--sizes 6,4,2/9,6,3] [--tetgen FOLDER --resolutions 2,4,8] [--refine 16] [--end 0.05] [--folder .]

A beam of 3 x 2 x 1 m, E = 7e8, nu = 0.33, rho = 2700, St. Venant-Kirchhoff, clamped at x = 0, 5000 N along x in equal parts on the
nodes at x = 3 from the start on, 50 steps of 1e-3. --sizes: meshes of our own, cells along x, y, z; --tetgen: a folder with the meshes
of that program, beam_3x2x1_resR.1.node and .ele. Errors are of time alone: the largest difference to steps --refine times shorter on the
same mesh, in parts of the largest displacement, of the tip's mean and of one corner. The last column is the same for steps half as
many times shorter: what the reference itself may be off by is less.
"""

import argparse
import os

from bench_tools import error, history, numbers, serial, table

LENGTH = 3.0
LARGE = 20000  # nodes, beyond which backward Euler takes too long for more than a fifth of the time, and with shorter steps at all
EDGES = ((0, 1), (1, 2), (2, 0), (3, 0), (2, 3), (1, 3))  # of a tetrahedron in Gmsh's order
CORNER, TIP = (1, 2, 3), (7, 8, 9)  # columns of solidbeam's history


def tetgen(stem, out):
    """TetGen's .node and .ele of second order as a mesh of Gmsh with the node sets "root" and "tip" """
    def rows(name):
        with open(name) as file:
            lines = [line.split() for line in file if line.strip() and not line.startswith("#")]
        return lines[1:1 + int(lines[0][0])]

    place = {int(r[0]): tuple(float(x) for x in r[1:4]) for r in rows(stem + ".node")}
    elements = []
    for r in rows(stem + ".ele"):
        corners, middles = [int(x) for x in r[1:5]], [int(x) for x in r[5:11]]
        a, b, c, d = (place[n] for n in corners)
        u, v, w = ([y[k] - a[k] for k in range(3)] for y in (b, c, d))
        if sum(u[k] * (v[(k + 1) % 3] * w[(k + 2) % 3] - v[(k + 2) % 3] * w[(k + 1) % 3]) for k in range(3)) < 0:
            corners[0], corners[1] = corners[1], corners[0]
        nearest = []
        for i, j in EDGES:  # whatever the file's order of the middles is
            p, q = place[corners[i]], place[corners[j]]
            nearest.append(min(middles, key=lambda n: sum((place[n][k] - (p[k] + q[k]) / 2) ** 2 for k in range(3))))
        if len(set(nearest)) != 6:
            raise SystemExit("%s: element %s has edges without a middle node" % (stem, r[0]))
        elements.append(corners + nearest)
    ends = [(1, n) for n, x in place.items() if abs(x[0]) < 1e-8] + [(2, n) for n, x in place.items() if abs(x[0] - LENGTH) < 1e-8]
    with open(out, "w") as file:
        file.write('$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n0 1 "root"\n0 2 "tip"\n3 3 "beam"\n$EndPhysicalNames\n')
        file.write("$Nodes\n%d\n" % len(place))
        for n, x in place.items():
            file.write("%d %.17g %.17g %.17g\n" % ((n,) + x))
        file.write("$EndNodes\n$Elements\n%d\n" % (len(ends) + len(elements)))
        for k, (end, n) in enumerate(ends):
            file.write("%d 15 2 %d %d %d\n" % (k + 1, end, end, n))
        for k, nodes in enumerate(elements):
            file.write("%d 11 2 3 3 %s\n" % (len(ends) + k + 1, " ".join(map(str, nodes))))
        file.write("$EndElements\n")


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("program")
    p.add_argument("--sizes", default="")
    p.add_argument("--tetgen")
    p.add_argument("--resolutions", default="2,4,8")
    p.add_argument("--refine", type=int, default=16)
    p.add_argument("--end", type=float, default=0.05)
    p.add_argument("--folder", default=".")
    a = p.parse_args()
    meshes = [(size, ["-size", size]) for size in a.sizes.split("/") if size]
    for r in a.resolutions.split(",") if a.tetgen else []:
        mesh = os.path.join(os.path.abspath(a.folder), "tetgen%s.msh" % r)
        tetgen(os.path.join(a.tetgen, "beam_3x2x1_res%s.1" % r), mesh)
        meshes.append(("TetGen, 1/" + r, ["-mesh", mesh]))
    program = os.path.abspath(a.program)

    def beam(name, more):
        text, _, memory = serial([program, "-load", "5000,0,0", "-end", a.end, "-ts_rtol", "1e-8", "-ts_atol", "1e-8", "-motion", name] + more,
                                 folder=a.folder)
        return numbers(text), history(os.path.join(a.folder, name)), memory

    rows = []
    for name, mesh in meshes:
        fine, reference, _ = beam("reference.txt", mesh + ["-ts_hhtdae_alpha", "-0.05", "-ts_dt", 1e-3 / a.refine])
        half = beam("half.txt", mesh + ["-ts_hhtdae_alpha", "-0.05", "-ts_dt", 2e-3 / a.refine])[1]
        settled = error(half, reference, TIP)
        for method, more in (("backward Euler, h = 1e-3", ["-by", "euler"]),
                             ("backward Euler, h = 2.5e-4", ["-by", "euler", "-ts_dt", "2.5e-4"]),
                             ("hhtdae, alpha = -0.3, h = 1e-3", ["-ts_hhtdae_alpha", "-0.3"]),
                             ("hhtdae, alpha = -0.05, h = 1e-3", ["-ts_hhtdae_alpha", "-0.05"]),
                             ("hhtdae, alpha = -0.05, h = 2.5e-4", ["-ts_hhtdae_alpha", "-0.05", "-ts_dt", "2.5e-4"])):
            if "euler" in more and "-ts_dt" in more and fine["nodes"] > LARGE:
                continue
            if "euler" in more and fine["nodes"] > LARGE:
                method, more = method + ", to %g s" % (a.end / 5), more + ["-end", a.end / 5]
            n, u, memory = beam("run.txt", mesh + more)
            rows.append([name, "%d" % (3 * n["nodes"]), method, "%.3g" % (1e3 * n["cpu_step"]), "%.3g" % n["cpu_first"],
                         "%.2f" % (n["iterations"] / n["steps"]), "%d" % n["factorizations"], "%.0f" % memory,
                         "%.1f %%" % (100 * error(u, reference, TIP)), "%.1f %%" % (100 * error(u, reference, CORNER)), "%.2f %%" % (100 * settled)])
    table(["mesh", "3 x nodes", "method", "a step, ms", "first step, s", "iterations a step", "factorizations", "MB", "error of tip", "of corner",
           "reference"], rows)


if __name__ == "__main__":
    main()
