"""The scripts of tests/bench, each on a small case: what they print can be read, and what has to agree does.

usage: bench_scripts.py source-tree solidbeam fullbody folder mpiexec
"""

import os
import re
import shutil
import sys

from common import check, run

tree, solidbeam, fullbody, folder, mpiexec = sys.argv[1:6]
shutil.rmtree(folder, ignore_errors=True)
os.makedirs(folder)


def script(name, *arguments):
    return run([sys.executable, "-B", os.path.join(tree, "tests/bench", name)] + list(arguments) + ["--folder", folder])


def rows(text):
    """Of the first Markdown table, as dictionaries"""
    lines = [[word.strip() for word in line.strip("|").split("|")] for line in text.split("\n\n")[0].split("\n") if line.startswith("|")]
    return [dict(zip(lines[0], line)) for line in lines[2:]]


def tetgen(stem):
    """Two cells of six tetrahedra each as TetGen writes them, the middles of edges in an order that is not Gmsh's"""
    place = {}
    number = lambda p: place.setdefault(p, len(place) + 1)
    elements = []
    for x in (0, 2):
        corners = [(x, 0, 0), (x + 2, 0, 0), (x + 2, 2, 0), (x, 2, 0), (x, 0, 2), (x + 2, 0, 2), (x + 2, 2, 2), (x, 2, 2)]
        for i, j in ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1)):
            c = [corners[k] for k in (0, j, i, 6)]  # the other way round
            middles = [tuple((a + b) // 2 for a, b in zip(c[k], c[l])) for k, l in ((2, 3), (0, 3), (1, 3), (1, 2), (0, 2), (0, 1))]
            elements.append([number(p) for p in c + middles])
    with open(stem + ".node", "w") as file:
        file.write("%d 3 0 0\n" % len(place))
        file.writelines("%d %g %g %g\n" % (n, 0.75 * p[0], p[1], 0.5 * p[2]) for p, n in place.items())
        file.write("# made by a test\n")
    with open(stem + ".ele", "w") as file:
        file.write("%d 10 0\n" % len(elements))
        file.writelines("%d %s\n" % (k + 1, " ".join(map(str, e))) for k, e in enumerate(elements))


# Backward Euler beside hhtdae: of first order it is far less accurate, on both meshes, which are nearly the same
tetgen(os.path.join(folder, "beam_3x2x1_res0.1"))
found = rows(script("t10_beam.py", solidbeam, "--sizes", "2,1,1", "--tetgen", folder, "--resolutions", "0", "--refine", "8", "--end", "0.02"))
check(len(found) == 10, "%d rows" % len(found))
percent = lambda row: float(row["error of tip"].split()[0])
for mesh in ("2,1,1", "TetGen, 1/0"):
    of = {row["method"]: row for row in found if row["mesh"] == mesh}
    euler, ours = of["backward Euler, h = 1e-3"], of["hhtdae, alpha = -0.05, h = 1e-3"]
    check(percent(euler) > 2 * percent(ours) > 0, "%s: errors %s and %s" % (mesh, euler["error of tip"], ours["error of tip"]))
    check(percent(of["hhtdae, alpha = -0.05, h = 2.5e-4"]) < percent(ours) / 2, mesh + ": shorter steps are not more accurate")
    check(int(euler["factorizations"]) >= 20 > int(ours["factorizations"]), mesh + ": factorizations")
check(abs(percent(found[0]) - percent(found[5])) < 3, "the same mesh as TetGen's has other errors: %s, %s" % (found[0], found[5]))

# Counts on one and two ranks
found = rows(script("scaling.py", fullbody, "--strong", "4,2,2", "--weak", "", "--ranks", "1,2", "--steps", "1", "--mpiexec", mpiexec))
check([row["ranks"] for row in found] == ["1", "2"], str(found))
check(float(found[0]["messages"]) == 0 and float(found[1]["messages"]) > 0 and float(found[1]["reductions"]) > 0, str(found))
one, two = (float(row["operations of a rank, most"]) for row in found)
check(0.4 * one < two < one, "operations on one and two ranks: %g, %g" % (one, two))

# CalculiX has the same equilibrium, and with bricks, whose mass it integrates exactly, the same motion but for its start, of first order
if shutil.which("ccx"):
    for element, motion in (("tetrahedron10", 0.2), ("brick20", 1e-3)):
        text = script("calculix_beam.py", solidbeam, "--size", "2,1,1", "--element", element, "--steps", "1e-2", "--tolerances", "1e-3", "--reference", "2e-3")
        check(float(re.search(r"difference of CalculiX' (\S+) of it", text).group(1)) < 1e-6, text)
        check(float(re.search(r"differ by (\S+) at", text).group(1)) < motion, text)
        check([row["program"] for row in rows(text[text.index("|"):])] == ["CalculiX", "hhtdae", "hhtdae, steps by error"], text)
else:
    print("CalculiX is not installed: calculix_beam.py was not run")
