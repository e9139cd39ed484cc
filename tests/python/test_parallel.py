"""mpiexec -n 1, 2, 3 python3: the example of a chain and a script with channels, snapshots and modes tell the same as on one rank."""

import os
import re
import subprocess
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
MPIEXEC = os.environ.get("HHTDAE_MPIEXEC", "mpiexec -n").split()

SCRIPT = """
import tempfile

import numpy as np
import hhtdae as h
from mpi4py import MPI

scene = h.Scene(gravity=(0, -9.81, 0), comm=MPI.COMM_WORLD)
before, k = scene.ground, scene.parameter("k", 3.)
for n in range(6):
    link = scene.rigid_body("link %d" % n, inertia=h.inertia.box(1, (1, .1, .1)), position=(n + 0.5, 0, 0))
    pin = scene.connect("pin %d" % n, h.Revolute, link, before, (n, 0, 0))
    i, j = link.marker((-0.5, 0, 0)), before.marker((n, 0, 0) if n == 0 else (0.5, 0, 0))
    scene.add("spring %d" % n, h.TorsionalSpringDamper(i, j, stiffness=20 * k))
    before = link
tip = link.marker((0.5, 0, 0))
scene.channel("x", h.displacement(tip, 0) * k)
scene.channel("y", h.displacement(tip, 1))
run = scene.solve(0.3, tolerance=1e-6, sample=0.1)
now = run.snapshot()
small = scene.run().equilibrium().linearize()
frequency = small.modes()[0].frequency
scene2 = h.Scene(gravity=(0, -9.81, 0))
seen, before = [], scene2.ground
for n in range(3):
    link = scene2.rigid_body("", inertia=h.inertia.box(1, (1, .1, .1)), position=(n + 0.5, 0, 0))
    scene2.connect("", h.Revolute, link, before, (n, 0, 0))
    before = link
m = link.marker((0.5, 0, 0))
y = h.displacement(m, 1)
scene2.add("drag", h.UserForce(m, force=[0, h.callback(lambda v: -0.5 * v, h.velocity(m, 1)), 0]))
run2 = scene2.run(tolerance=1e-7)
run2.event(y + 1, action=lambda r: seen.append(r.time), terminal=True)
run2.solve(1.)
assert len(seen) == 1 and abs(run2.snapshot().value(y) + 1) < 1e-8
run2.close()
rank_values = MPI.COMM_WORLD.allgather((run.values.tolist(), now.motion(tip).position.tolist(), frequency, seen))
assert all(v == rank_values[0] for v in rank_values), rank_values
try:
    h.Scene().set(nothing=1)
    raise SystemExit(3)
except h.Error:
    pass
run.close()
if MPI.COMM_WORLD.rank == MPI.COMM_WORLD.size - 1:  # a scene of one rank is that rank's affair
    own = h.Scene(comm=MPI.COMM_SELF)
    own.add("b", h.PointMass())
    with tempfile.NamedTemporaryFile("r") as file:
        own.view(file.name)
        assert "3 degrees of freedom" in file.read()
if MPI.COMM_WORLD.rank == 0:
    print("result", MPI.COMM_WORLD.size, run["x"][-1], run["y"][-1], frequency, seen[0])
"""


def ranks(count, *arguments):
    done = subprocess.run(MPIEXEC + [str(count), sys.executable, "-B", *arguments], capture_output=True, text=True, timeout=120)
    if done.returncode:
        raise AssertionError("exit status %d\n%s\n%s" % (done.returncode, done.stdout, done.stderr))
    return done.stdout


FLEXIBLE = """
import os, pickle, sys, tempfile
import hhtdae as h
from petsc4py import PETSc

try:
    from hhtdae import flexible
except ImportError:  # the package was built without SLEPc
    raise SystemExit(0)

sys.path.insert(0, %r)
from beam_mesh import beam_mesh

""" % os.path.join(HERE, "..", "..", "examples", "python")


class Ranks(unittest.TestCase):
    def test_script(self):
        results = []
        for count in (1, 2, 3):
            words = re.search("result (.*)", ranks(count, "-c", SCRIPT)).group(1).split()
            self.assertEqual(int(words[0]), count)
            results.append([float(w) for w in words[1:]])
        for other in results[1:]:
            for a, b in zip(results[0], other):
                self.assertAlmostEqual(a, b, delta=1e-7 * (1 + abs(a)))

    def test_errors_of_one_rank(self):
        """What one rank raises in a callback, a channel, an action or an on_step function is an error of all, of which they tell, after which they go on"""
        script = """
import sys
import hhtdae as h
from petsc4py import PETSc

rank = PETSc.COMM_WORLD.rank

def tell(line):
    sys.stdout.write(line + "\\n")
    sys.stdout.flush()

def fail(x, where):
    if rank == 1 and x > 0.2:
        raise LookupError("no " + where)
    return 0.

def bodies(law=None, value=None):
    scene = h.Scene(gravity=(0, 0, -9.81))
    for n in range(4):
        m = scene.add("b%d" % n, h.PointMass(position=(n, 0, 0))).marker()
        if law:
            scene.add("f%d" % n, h.UserForce(m, force=[0, 0, h.callback(law, h.time())]))
        scene.channel("z%d" % n, h.callback(value, h.time() + 1e-30 * h.displacement(m, 2)) if value else h.displacement(m, 2))
    return scene, h.displacement(m, 2)

for where in ("force", "channel", "formula", "action", "step"):
    law = lambda t: fail(t, where)
    scene, z = bodies(law if where == "force" else None, law if where == "channel" else None)
    run = scene.run(tolerance=1e-5)
    if where == "formula":
        run.event(h.callback(law, h.time()) + 1)
    if where == "action":
        run.event(z + 1, lambda r: fail(r.time, where))
    if where == "step":
        run.on_step(lambda r: fail(r.time, where))
    try:
        run.solve(2.)
        tell("none: " + where)
    except (h.Error, LookupError) as error:
        own = isinstance(error, LookupError) or isinstance(error.__cause__, LookupError)
        tell("said: %s %d %s %s" % (where, rank, "no " + where in str(error), own if rank else "On rank 1" in str(error)))
tell("done %d %s" % (rank, scene.run(tolerance=1e-5).solve(0.1).time == 0.1))
"""
        lines = ranks(2, "-c", script).splitlines()
        for where in ("force", "channel", "formula", "action", "step"):
            for rank in (0, 1):
                self.assertIn("said: %s %d True True" % (where, rank), lines)
        self.assertEqual({"done 0 True", "done 1 True"} - set(lines), set())

    def test_uncaught_errors_of_one_rank(self):
        """They end all ranks with the traceback, wherever the others are"""
        begin = "import hhtdae as h\nfrom petsc4py import PETSc\nscene = h.Scene(gravity=(0, 0, -9.81))\nm = scene.add('b', h.PointMass()).marker()\n"
        for script in ("scene.add('f', h.UserForce(m, force=[0, 0, h.callback(lambda t: 1 / max(0.2 - t, 0), h.time())]))\nscene.solve(1.)\n",
                       "if PETSc.COMM_WORLD.rank == 1:\n    1 / 0\nscene.solve(1.)\n"):
            done = subprocess.run(MPIEXEC + ["2", sys.executable, "-B", "-c", begin + script], capture_output=True, text=True, timeout=60)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn("ZeroDivisionError", done.stderr)

    def test_some_ranks(self):
        """A rank that hands out work has no scene, and the others do not wait for it when PETSc ends."""
        script = """
from petsc4py import PETSc
PETSc.Options()["scene_ratee"] = 1
if PETSc.COMM_WORLD.rank:
    import hhtdae
    scene = hhtdae.Scene(gravity=(0, 0, -9.81), comm=PETSc.COMM_SELF)
    scene.add("ball", hhtdae.PointMass())
    scene.solve(0.1)
PETSc._finalize()
"""
        ranks(2, "-c", script)

    def test_nodes_of_some_ranks(self):
        """A rank without nodes takes part in what is said of them"""
        script = """
from petsc4py import PETSc
from hhtdae import integrator

J = PETSc.Mat().createAIJ(((6, None), (6, None)), nnz=1)
J.setUp()
begin, end = J.getOwnershipRange()
for i in range(begin, end):
    J[i, i] = 1
J.assemble()

def jacobian(ts, t, u, v, a, sv, sa, A, P):
    return True

ts = PETSc.TS().create()
ts.setType("hhtdae")
ts.setI2Function(lambda ts, t, u, v, a, F: a.copy(F), J.createVecLeft())
ts.setI2Jacobian(jacobian, J, J)
integrator.set_nodes(ts, [] if PETSc.COMM_WORLD.rank else [[0, 1], [2, 3], [4, 5]])
"""
        ranks(2, "-c", script)

    def test_bodies_of_other_ranks(self):
        """Bodies of one rank beside those of all; what is distributed over other ranks than the scene is refused on all of them"""
        script = FLEXIBLE + """with tempfile.TemporaryDirectory() as folder:
    file = beam_mesh(os.path.join(folder, "beam.msh"), 1., 0.05, 0.05)
    one, all = (flexible.FeModel.from_mesh(file, flexible.Material(2e11, 0., 8000.), comm=c) for c in (PETSc.COMM_SELF, PETSc.COMM_WORLD))
    PETSc.COMM_WORLD.barrier()
ends = [flexible.Attachment("root"), flexible.Attachment("tip")]
body, spread = flexible.reduce(one, ends, modes=2), flexible.reduce(all, ends, modes=2)
again = pickle.loads(pickle.dumps(body))
assert again.comm.size == 1 and len(again.label) == len(body.label)
scene = h.Scene(comm=PETSc.COMM_SELF)
beam = scene.add("beam", h.FlexibleBody(body))
beam.surface(body)
try:
    beam.surface(spread)
    raise SystemExit(3)
except ValueError as error:
    assert "over other ranks than the scene" in str(error)
try:
    flexible.FullFeBody(scene, "whole", all)
    raise SystemExit(4)
except h.Error as error:
    assert "over other ranks than the scene" in str(error)
world = h.Scene()
beam = world.add("beam", h.FlexibleBody(spread))
beam.surface(spread)
beam.surface(body)
"""
        ranks(2, "-c", script)

    def test_driven_whole_body(self):
        """Its attachments leave one rank's part of the matrix singular but for rounding, which is found by the pivots of what is between the ranks"""
        script = FLEXIBLE + """with tempfile.TemporaryDirectory() as folder:
    model = flexible.FeModel.from_mesh(beam_mesh(os.path.join(folder, "beam.msh")), flexible.Material(2e11, 0., 8000.))
    PETSc.COMM_WORLD.barrier()
scene = h.Scene()
scene.start(assembly="project")
beam = flexible.FullFeBody(scene, "beam", model, flexible.FullBody(attachments=[flexible.Attachment("root"), flexible.Attachment("tip")]))
tip, end = beam.attachment("tip").marker(), scene.ground.marker((1, 0, 0))
scene.add("clamp", h.Fixed(beam.attachment("root").marker(), scene.ground.marker()))
scene.add("drive", h.TranslationalMotion(tip, end, lambda t: 1e-3 * h.sin(200 * t)))
run = scene.solve(0.003, tolerance=1e-6)
at = run.snapshot().motion(tip).position[2] - 1e-3 * h.sin(0.6)
assert abs(at) < 1e-12, at
"""
        ranks(2, "-c", script)

    def test_chain(self):
        text = ranks(2, os.path.join(HERE, "..", "..", "examples", "python", "chain.py"), "-links", "30")
        found, exact = re.search(r"2 ranks: the end hangs (\S+) m .* exact (\S+) m", text).groups()
        self.assertAlmostEqual(float(found), float(exact), delta=1e-8)


if __name__ == "__main__":
    try:
        import mpi4py
    except ImportError:
        print("skipped: no mpi4py")
        raise SystemExit(0)
    unittest.main()
