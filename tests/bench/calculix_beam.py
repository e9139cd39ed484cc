"""A cantilever with large displacements by hhtdae and by CalculiX (ccx, implicit dynamics with the same alpha): the same mesh, material
and load; processor time at equal error.

usage: calculix_beam.py BUILD/bin/solidbeam [--size 12,8,4] [--element tetrahedron10 or brick20] [--load 0,0,-1e7] [--rise 0.02]
                        [--end 0.1] [--steps 5e-3,2.5e-3,1.25e-3] [--reference 1e-4] [--alpha -0.05] [--folder .]

The load grows in proportion to time until --rise and stays. First the equilibrium under all of it, by both. Then runs of both with fixed
steps, CalculiX with its own criterion of convergence, and of hhtdae with steps by error. An error is the largest
difference of the displacements of two nodes (corner and edge of solidbeam) to the same program's run with steps of --reference, at
the times of both, in parts of the largest displacement. Processor time and memory are those of whole processes, one thread each.
Without ccx: exit status 77.
"""

import argparse
import math
import os
import re
import shutil
import sys

from bench_tools import error, history, numbers, run, serial, table

# Places in Gmsh's order of the nodes that CalculiX has in its order
ELEMENTS = {"tetrahedron10": (11, "C3D10", [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]),
            "brick20": (17, "C3D20", [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15])}
CORNER, EDGE = (1, 2, 3), (4, 5, 6)  # columns of histories
YOUNG, POISSON, DENSITY = 7e8, 0.33, 2700


class Mesh:
    """What solidbeam has written"""

    def __init__(self, path, element):
        kind, self.type, order = ELEMENTS[element]
        with open(path) as file:
            lines = iter(file.read().split("\n"))
        self.nodes, self.elements, ends = {}, [], {1: set(), 2: set()}
        for line in lines:
            if line == "$Nodes":
                for _ in range(int(next(lines))):
                    n, *x = next(lines).split()
                    self.nodes[int(n)] = tuple(map(float, x))
            if line == "$Elements":
                for _ in range(int(next(lines))):
                    _, gmsh, tags, physical, *rest = map(int, next(lines).split())
                    nodes = rest[tags - 1:]
                    if gmsh == kind:
                        self.elements.append([nodes[k] for k in order])
                    else:
                        ends[physical].update(nodes)
        self.root, self.tip = sorted(ends[1]), sorted(ends[2])
        low, high = ([f(x[k] for x in self.nodes.values()) for k in range(3)] for f in (min, max))
        self.watched = [self.nearest(high), self.nearest([(low[0] + high[0]) / 2, high[1], high[2]])]

    def nearest(self, x):
        distance = lambda n: sum((a - b) ** 2 for a, b in zip(self.nodes[n], x)) ** 0.5
        least = min(map(distance, self.nodes))
        return min(n for n in self.nodes if distance(n) <= least * (1 + 1e-9) + 1e-12)


def deck(mesh, load, rise, procedure, criterion):
    lines = ["*NODE"] + ["%d, %.17g, %.17g, %.17g" % ((n,) + x) for n, x in mesh.nodes.items()]
    lines += ["*ELEMENT, TYPE=%s, ELSET=ALL" % mesh.type]
    for k, nodes in enumerate(mesh.elements):
        words = [str(k + 1)] + [str(n) for n in nodes]
        lines += [", ".join(words[:11]) + ("," if len(words) > 11 else "")] + ([", ".join(words[11:])] if len(words) > 11 else [])
    for name, nodes in (("ROOT", mesh.root), ("WATCHED", mesh.watched)):
        lines += ["*NSET, NSET=" + name] + ["%d," % n for n in nodes]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", "%g, %g" % (YOUNG, POISSON), "*DENSITY", "%g" % DENSITY, "*SOLID SECTION, ELSET=ALL, MATERIAL=M",
              "*BOUNDARY", "ROOT, 1, 3", "*AMPLITUDE, NAME=RISE"]
    lines += ["0., 0., %.17g, 1., 1e6, 1." % rise if rise > 0 else "0., 1., 1e6, 1."]
    lines += ["*STEP, NLGEOM, INC=10000000"] + procedure
    if criterion:
        lines += ["*CONTROLS, PARAMETERS=FIELD", "%g, %g, , , %g" % ((criterion,) * 3)]
    lines += ["*CLOAD, AMPLITUDE=RISE"]
    for k, f in enumerate(load):
        if f:
            lines += ["%d, %d, %.17g" % (n, k + 1, f / len(mesh.tip)) for n in mesh.tip]
    return "\n".join(lines + ["*NODE PRINT, NSET=WATCHED, FREQUENCY=1", "U", "*END STEP", ""])


def calculix(mesh, load, rise, procedure, criterion, folder):
    """Rows of time and displacements, processor seconds, MB"""
    with open(os.path.join(folder, "deck.inp"), "w") as file:
        file.write(deck(mesh, load, rise, procedure, criterion))
    text, cpu, memory = run(["ccx", "deck"], folder=folder)
    if "*ERROR" in text:
        sys.exit(text[-2000:] + "\nFAILED: ccx")
    rows, here = [], None
    with open(os.path.join(folder, "deck.dat")) as file:
        for line in file:
            found = re.search(r"set WATCHED and time\s+(\S+)", line)
            words = line.split()
            if found:
                here = {}
                rows.append([float(found.group(1)), here])
            elif here is not None and len(words) == 4:
                here[int(words[0])] = [float(x) for x in words[1:]]
    return [[t] + [x for n in mesh.watched for x in known[n]] for t, known in rows], cpu, memory, text.count("iteration ")


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("program")
    p.add_argument("--size", default="12,8,4")
    p.add_argument("--element", default="tetrahedron10", choices=sorted(ELEMENTS))
    p.add_argument("--load", default="0,0,-1e7")
    p.add_argument("--rise", type=float, default=0.02)
    p.add_argument("--end", type=float, default=0.1)
    p.add_argument("--steps", default="5e-3,2.5e-3,1.25e-3")
    p.add_argument("--tolerances", default="1e-3,1e-4")
    p.add_argument("--reference", type=float, default=1e-4)
    p.add_argument("--alpha", type=float, default=-0.05)
    p.add_argument("--folder", default=".")
    a = p.parse_args()
    if not shutil.which("ccx"):
        print("skipped: CalculiX is not installed (Debian: calculix-ccx)")
        sys.exit(77)
    folder, load = os.path.abspath(a.folder), [float(x) for x in a.load.split(",")]
    steps, tolerances = ([float(x) for x in text.split(",") if x] for text in (a.steps, a.tolerances))
    gmsh, motion = os.path.join(folder, "mesh.msh"), os.path.join(folder, "motion.txt")
    beam = [os.path.abspath(a.program), "-size", a.size, "-element", a.element, "-load", a.load, "-motion", motion]

    # Equilibrium
    n = numbers(serial(beam + ["-by", "static", "-increments", 4, "-write_mesh", gmsh], folder=folder)[0])
    mesh = Mesh(gmsh, a.element)
    ours = history(motion)[-1]
    theirs = calculix(mesh, load, 1, ["*STATIC, DIRECT", "0.25, 1."], 1e-8, folder)[0][-1]
    print("%s %s, %d nodes; equilibrium under (%s) N: displacement of the corner %s m; largest difference of CalculiX' %.1e of it" % (
        a.size, a.element, n["nodes"], a.load, ", ".join("%.6g" % ours[k] for k in CORNER),
        max(abs(x - y) for x, y in zip(ours[1:7], theirs[1:7])) / math.sqrt(sum(ours[k] ** 2 for k in CORNER))))

    dynamic = beam + ["-rise", a.rise, "-end", a.end, "-ts_hhtdae_alpha", a.alpha]

    def hhtdae(more):
        text, cpu, memory = serial(dynamic + more, folder=folder)
        return history(motion), cpu, memory, numbers(text)

    def implicit(h, criterion):
        return calculix(mesh, load, a.rise, ["*DYNAMIC, DIRECT, ALPHA=%g" % a.alpha, "%.17g, %.17g" % (h, a.end)], criterion, folder)

    def fixed(h, tolerance=1e-4):  # corrections are left with a thousandth of the tolerance
        return ["-ts_dt", h, "-ts_rtol", tolerance, "-ts_atol", tolerance]

    own, known = hhtdae(fixed(a.reference, 1e-6))[0], implicit(a.reference, 1e-5)[0]
    print("runs with steps of %g differ by %.2e at the corner" % (a.reference, error(known, own, CORNER)))
    rows = []
    worst = lambda u, reference: "%.2e" % max(error(u, reference, CORNER), error(u, reference, EDGE))
    for h in steps:
        u, cpu, memory, iterations = implicit(h, None)
        rows.append(["CalculiX", "h = %g" % h, worst(u, known), "%d" % len(u), "%d" % iterations, iterations, "%.2f" % cpu, "%.0f" % memory])
    for h in steps:
        u, cpu, memory, n = hhtdae(fixed(h))
        rows.append(["hhtdae", "h = %g" % h, worst(u, own), "%d" % n["steps"], "%d" % n["iterations"], "%d" % n["factorizations"], "%.2f" % cpu, "%.0f" % memory])
    for tolerance in tolerances:
        more = ["-ts_dt", 1e-4, "-ts_adapt_type", "hhtdae", "-ts_rtol", tolerance, "-ts_atol", tolerance]
        u, cpu, memory, n = hhtdae(more + ["-every", a.steps.split(",")[0]])
        rows.append(["hhtdae, steps by error", "tolerance %g" % tolerance, worst(u, own), "%d" % n["steps"], "%d" % n["iterations"],
                     "%d" % n["factorizations"], "%.2f" % cpu, "%.0f" % memory])
    table(["program", "steps", "error", "number", "iterations", "factorizations", "CPU s", "MB"], rows)


if __name__ == "__main__":
    main()
