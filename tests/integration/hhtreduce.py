"""hhtreduce from the command line: a mesh to a body's file, its table, a picture; what is wrong is said, and ends with a failure."""

import os
import re
import shutil
import struct
import sys
import tempfile

from common import check, run, skip

PROGRAM, MPIEXEC, RANKS = sys.argv[1:4]

if not os.path.exists(PROGRAM):
    skip("hhtreduce is not built")


def mesh(path, n=(6, 1, 1), size=(1.0, 0.1, 0.05)):
    """A bar of bricks with 8 nodes, surfaces "hub" and "tip" at its ends"""
    tag = lambda i, j, k: 1 + i + (n[0] + 1) * (j + (n[1] + 1) * k)
    nodes, elements = [], []
    for k in range(n[2] + 1):
        for j in range(n[1] + 1):
            for i in range(n[0] + 1):
                nodes.append("%d %.17g %.17g %.17g" % (tag(i, j, k), size[0] * i / n[0], size[1] * j / n[1], size[2] * k / n[2]))
    add = lambda kind, group, tags: elements.append("%d %d 2 %d %d %s" % (len(elements) + 1, kind, group, group, " ".join(map(str, tags))))
    for group, i in ((1, 0), (2, n[0])):
        for k in range(n[2]):
            for j in range(n[1]):
                add(3, group, (tag(i, j, k), tag(i, j + 1, k), tag(i, j + 1, k + 1), tag(i, j, k + 1)))
    for k in range(n[2]):
        for j in range(n[1]):
            for i in range(n[0]):
                square = lambda l: [tag(i, j, l), tag(i + 1, j, l), tag(i + 1, j + 1, l), tag(i, j + 1, l)]
                add(5, 3, square(k) + square(k + 1))
    with open(path, "w") as out:
        out.write('$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 "hub"\n2 2 "tip"\n3 3 "bar"\n$EndPhysicalNames\n')
        out.write("$Nodes\n%d\n%s\n$EndNodes\n" % (len(nodes), "\n".join(nodes)))
        out.write("$Elements\n%d\n%s\n$EndElements\n" % (len(elements), "\n".join(elements)))


def table(text):
    """Frequencies of a table of modes"""
    rows = re.findall(r"^ +(\d+) +([0-9.e+]+) +(\S+) +(\S+)$", text, re.M)
    check(rows and [int(r[0]) for r in rows] == list(range(len(rows))), "no table of modes in\n" + text)
    return [float(r[1]) for r in rows]


def near(a, b, tolerance):
    return len(a) == len(b) and all(abs(x - y) <= tolerance * abs(y) for x, y in zip(a, b))


def reduction(folder):
    body = os.path.join(folder, "bar.h5")
    base = ["-mesh", os.path.join(folder, "bar.msh"), "-material", "2.1e11,0.3,7850", "-attach", "hub,end:tip:average@1.0,0.05,0.025",
            "-modes", "6", "-units", "m, kg, s"]
    said = run([PROGRAM, *base, "-stress", "-stiffening", "-o", body])
    check("reduced in" in said and "set hub: 4 nodes" in said, "no progress and table in\n" + said)
    frequencies = table(said)
    check(len(frequencies) == 12, "6 normal modes and 12 of attachments are 12 without rigid ones: %s" % frequencies)
    info = run([PROGRAM, "-info", body])
    for part in ("checksum: good", "mass 39.25,", "m, kg, s", "geometric stiffening: yes", "attachment end at (1, 0.05, 0.025)", "28 nodes with shapes, 28 of them with stress modes",
                 "6 bricks with 8 nodes", "bar.msh"):
        check(part in info, "%r is not in\n%s" % (part, info))
    check(table(info) == frequencies, "the file's table is another one")
    both = os.path.join(folder, "both.h5")
    run([MPIEXEC, RANKS, 2, PROGRAM, *base, "-stress", "-quiet", "-o", both])
    check(near(table(run([MPIEXEC, RANKS, 2, PROGRAM, "-info", both])), frequencies, 1e-7), "frequencies on two ranks are others")
    bare = os.path.join(folder, "bare.h5")
    said = run([PROGRAM, *base, "-no_shapes", "-quiet", "-keep", "0,2-4", "-o", bare])
    check(said.strip() == "", "-quiet is not quiet: " + said)
    info = run([PROGRAM, "-info", bare])
    check(near(table(info), [frequencies[k] for k in (0, 2, 3, 4)], 1e-8), "-keep 0,2-4 kept other modes")
    check("0 nodes without shapes" in info, "-no_shapes kept the nodes\n" + info)
    free = run([PROGRAM, *base[:4], "-method", "freefree", "-max_frequency", 2000, "-o", os.path.join(folder, "free.h5")])
    check(max(table(free)) < 2000, "-max_frequency 2000\n" + free)
    given = ["-o", os.path.join(folder, "given.h5"), "-reduce_eps_tol", "1e-10", "-reduce_eps_krylov_block", 2, "-reduce_slices_from", 1000, "-reduce_verify", 0,
             "-reduce_pc_type", "cholesky", "-fe_mass_points", "stiffness"]  # of these bricks the points for the mass are the same
    said = run([PROGRAM, *base, *given])
    check(near(table(said), frequencies, 1e-6), "options of the solvers make other frequencies")
    check("not counted" in said and "none is missing" not in said, "modes that are not counted are said to be\n" + said)
    error = run([PROGRAM, *base, *given, "-fe_mass_points", "some"], fails=True)
    check("exact or stiffness" in error, error)
    return body, bare, base


def nodes_and_loads(folder, base):
    """Nodes of a set and by number, pressure on the tip's face, whose area is 0.005, forces on two nodes"""
    forces, body, again = (os.path.join(folder, name) for name in ("forces.txt", "loaded.h5", "loaded2.h5"))
    with open(forces, "w") as out:
        out.write("# node, force\n3 1 0 2.5\n\n5 0 -4e0 0\n")
    words = [*base, "-keep_nodes", "tip,1,3-5", "-pressure", "wind:tip,gust:tip:fixed", "-load", "push:" + forces, "-quiet"]
    run([PROGRAM, *words, "-o", body])
    info = run([PROGRAM, "-info", body])
    for part in ("nodes for markers: 8, from 1 to 28, 8 of them with rotation", "load case wind, follows the surface: force (-0.005, ", "load case gust: force (-0.005, ",
                 "load case push: force (1, -4, 2.5)"):
        check(part in info, "%r is not in\n%s" % (part, info))
    run([MPIEXEC, RANKS, 2, PROGRAM, *words, "-o", again])
    lines = [[line for line in run([PROGRAM, "-info", file]).splitlines() if "load case push" in line or "nodes for" in line] for file in (body, again)]
    check(lines[0] == lines[1], "nodes and loads on two ranks are others: %s" % lines)
    for more, message in (
            (["-keep_nodes", "tip,999"], "the model has no node 999"), (["-keep_nodes", "2345678"], "the model has no node 2345678"),
            (["-keep_nodes", "3-2000000"], '"3-2000000" is a range of more than a million'), (["-pressure", "wind:nowhere"], "no node set 'nowhere'"),
            (["-pressure", "wind:tip:along"], "is not name:set"), (["-load", "push:" + os.path.join(folder, "bar.msh")], "line 1 is not")):
        error = run([PROGRAM, *base, *more, "-o", os.path.join(folder, "no.h5")], fails=True)
        check(message in error and error.startswith("hhtreduce: error:"), "%s\nhas no %r in\n%s" % (more, message, error))


def pictures(folder, body):
    vtu, again = os.path.join(folder, "mode.vtu"), os.path.join(folder, "again.vtu")
    said = run([PROGRAM, "-vtu", vtu, "-mode", 3, body])
    check("mode 3" in said, said)
    run([MPIEXEC, RANKS, 3, PROGRAM, "-vtu", again, "-mode", 3, body])
    data = open(vtu, "rb").read()
    check(b'Name="von_mises"' in data and data == open(again, "rb").read(), "pictures on three ranks are others")
    run([PROGRAM, "-vtu", again, "-mode", 3, "-body", body])
    check(open(again, "rb").read() == data, "-body names another file")
    run([PROGRAM, "-vtu", again, "-mode", 3, "-scale", "-1e-3", body])
    check(open(again, "rb").read() != data, "-scale has no effect")


def failures(folder, body, bare, base):
    out = ["-o", os.path.join(folder, "no.h5")]
    damaged = os.path.join(folder, "damaged.h5")
    data = bytearray(open(body, "rb").read())
    where = data.find(struct.pack("<d", 39.25)[2:])  # a piece of a number of the body
    data[where if where > 0 else len(data) // 2] ^= 1
    open(damaged, "wb").write(data)
    for words, message in (
            ([], None),
            (["-info", damaged], "damaged"),
            (["-info", os.path.join(folder, "none.h5")], "there is no such file"),
            (["-info", os.path.join(folder, "bar.msh")], "not an HDF5 file"),
            (["-vtu", os.path.join(folder, "x.vtu"), "-mode", 99, body], "has modes 0 .. 11"),
            (["-vtu", os.path.join(folder, "x.vtu"), "-mode", 0, bare], "reduced with all nodes"),
            (["-vtu", os.path.join(folder, "x.vtu"), body], "needs -mode"),
            (base, "-o body.h5 is missing"),
            (base + ["-o", "/nowhere/no.h5"], "/nowhere/no.h5"),
            (base + out + ["-max_frequncy", 100], "is -max_frequency meant"),
            (base + out + ["-keep", "3-1"], "-keep 3-1"),
            (base + out + ["stray"], "stray"),
            (base + out + ["-modes", "-3"], "-modes"),
            (base + out + ["-method", "guyan"], "-method guyan"),
            (base[:4] + ["-attach", "hub:nowhere"] + out, "nowhere"),
            (base[:4] + ["-attach", "hub@1,2"] + out, "three numbers"),
            (base[:2] + ["-material", "2.1e11,0.7,7850", "-attach", "hub"] + out, "nu is between"),
            (base[:2] + ["-attach", "hub"] + out, "-material E,nu,rho is missing"),
            (["-mesh", os.path.join(folder, "none.msh")] + base[2:] + out, "none.msh"),
            (["-calculix", os.path.join(folder, "none"), "-attach", "hub"] + out, "none.inp"),
            (["-stiffness", "k", "-attach", "hub"] + out, "needed together")):
        if message is None:
            continue
        error = run([PROGRAM, *words], fails=True)
        check(message in error and error.startswith("hhtreduce: error:"), "%s\nhas no %r in\n%s" % (words, message, error))
        check(not os.path.exists(out[1]) and not os.path.exists(out[1] + ".part"), "a file is left behind")
    error = run([MPIEXEC, RANKS, 2, PROGRAM, "-info", damaged], fails=True)
    check(error.count("hhtreduce: error:") == 1, "two ranks say it once:\n" + error)


with tempfile.TemporaryDirectory() as folder:
    mesh(os.path.join(folder, "bar.msh"))
    says = run([PROGRAM, "-help"])
    check("hhtreduce -info frame.h5" in says and "checksum" in says, "-help explains nothing")
    check(run([PROGRAM]) == says, "without options the help is shown")
    trial = run([PROGRAM, "-info", "-help"])
    check("-calculix" in trial, "PETSc's own -info and -help")
    body, bare, base = reduction(folder)
    pictures(folder, body)
    nodes_and_loads(folder, base)
    failures(folder, body, bare, base)
print("hhtreduce: reduced, shown, drawn; what is wrong was refused")
