"""Who keeps whom: nothing dangles when Python drops what a run needs, nothing leaks in many runs, programs end in order."""

import gc
import os
import resource
import subprocess
import sys
import threading
import unittest
import weakref

import numpy as np

import hhtdae as h


class Law:
    """A callback that can be watched"""

    def __init__(self, k):
        self.k = k

    def __call__(self, x):
        return -self.k * x


def oscillator(law=None):
    scene = h.Scene()
    k = scene.parameter("k", 40.)
    b = scene.add("b", h.PointMass(position=(0.5, 0, 0)))
    m = b.marker()
    x = h.displacement(m, 0)
    scene.add("pull", h.UserForce(m, force=[h.callback(law or Law(40.), x), 0, -k * h.displacement(m, 2)]))
    scene.channel("x", x)
    return scene


class Keeping(unittest.TestCase):
    def test_run_without_its_scene(self):
        """The scene, its callbacks and its formulas are dropped while a run and even only its TS live"""
        law = Law(40.)
        watch = weakref.ref(law)
        scene = oscillator(law)
        run = scene.run(tolerance=1e-7)
        ts = run.ts
        del scene, law
        gc.collect()
        run.solve(0.5)
        self.assertAlmostEqual(run["x"][-1], 0.5 * np.cos(0.5 * 40**0.5), delta=1e-4)
        del run
        gc.collect()
        ts.setMaxTime(1.)
        ts.solve(ts.getSolution2()[0])
        self.assertIsNotNone(watch())
        ts.destroy()
        del ts
        gc.collect()
        self.assertIsNone(watch())

    def test_run_with_events(self):
        """Its TS looks at it after every step, and must not keep it: closed or dropped it goes, and its scene with it"""
        steps = []
        for close in (True, False):
            scene = h.Scene(gravity=(0, 0, -1))
            height = h.displacement(scene.add("b", h.PointMass(position=(0, 0, 0.1))).marker(), 2)
            scene.channel("z", height)
            run = scene.run(tolerance=1e-5)
            run.event(height)
            run.on_step(lambda run: steps.append(run.time))
            run.solve(0.5)
            watch = weakref.ref(run), weakref.ref(scene)
            if close:
                run.close()
            del run, scene, height
            gc.collect()
            oscillator().run().close()
            self.assertEqual((watch[0](), watch[1]()), (None, None))
        self.assertEqual(len(steps), len(set(steps)) * 2)

    def test_snapshot_and_operators_outlive(self):
        run = oscillator().solve(0.2)
        now, small = run.snapshot(), run.linearize()
        modes, (M, C, K) = small.modes(), small.operators()
        ts = run.ts
        run = None
        gc.collect()
        self.assertAlmostEqual(now.time, 0.2)
        self.assertGreater(now.energy()[0] + 1., 0)
        del now, small
        gc.collect()
        self.assertEqual(len(modes[0].shape), M.getSize()[0])
        ts.destroy()

    def test_snapshot_of_a_closed_run(self):
        """What a snapshot and a linearization read stays until they are gone"""
        scene = oscillator()
        with scene.run() as run:
            now, small = run.solve(0.3).snapshot(), run.linearize()
        for _ in range(3):
            scene.run().solve(0.1)  # would take the memory
        self.assertAlmostEqual(now.value(h.time()), 0.3)
        self.assertGreater(now.energy()[0], 0)
        self.assertEqual(len(small.modes()), 4)  # two along the springs, and the free direction twice
        with self.assertRaisesRegex(ValueError, "closed"):
            now.take()

    def test_scene_in_a_cycle_with_its_callback(self):
        """A scene that its own callback refers to is found by the garbage collector"""
        class Model:
            def __init__(self):
                self.scene = oscillator(lambda x: -self.k * x)
                self.k = 40.
        model = Model()
        model.scene.run().close()
        watch = weakref.ref(model)
        del model
        gc.collect()
        self.assertIsNone(watch())

    def test_closed_and_dropped_in_any_order(self):
        scene = oscillator()
        with scene.run() as a:
            b = scene.run()
            a.solve(0.1)
        b.solve(0.1)
        self.assertEqual(a["x"][-1], b["x"][-1])
        now = b.snapshot()
        b.close()
        now.close()


class WhileSolving(unittest.TestCase):
    def test_close_and_solve_from_inside(self):
        """What a run calls back can neither close it nor solve it: an error, with which the run is as good as before"""
        for do, word in ((lambda r: r.close(), "close"), (lambda r: r.solve(3.), "solve"), (lambda r: r.load("x"), "load")):
            for where in ("event", "on_step", "callback"):
                held = []
                scene = oscillator(lambda x: (do(held[0]) if held else None, -40. * x)[1])
                run = scene.run(tolerance=1e-6)
                if where == "event":
                    run.event(h.time() - 0.1, do)
                elif where == "on_step":
                    run.on_step(do)
                else:
                    held.append(run)
                with self.assertRaisesRegex((RuntimeError, h.Error), word + r"\(\): the run is being solved.*after solve\(\)"):
                    run.solve(0.5)
                held.clear()
                self.assertLessEqual(run.time, 0.5)
                self.assertIn("run at t =", repr(run))
                run.close()
                self.assertEqual(repr(run), "<closed run>")

    def test_block_that_an_error_leaves(self):
        def fail(run):
            raise KeyError("from inside")
        for hook in (lambda r: r.event(h.time() - 0.1, fail), lambda r: r.on_step(fail)):
            with self.assertRaises((KeyError, h.Error)) as caught:
                with oscillator().run() as run:
                    hook(run)
                    run.solve(0.5)
            self.assertIn("from inside", str(caught.exception))
            self.assertEqual(repr(run), "<closed run>")

    def test_destroyed_by_hand(self):
        for hook in (lambda r, f: r.event(h.time() - 0.1, f), lambda r, f: r.on_step(f)):
            with oscillator().run() as run:
                hook(run, lambda r: r.ts.destroy() if r.ts else None)
                with self.assertRaisesRegex(ValueError, "closed"):
                    run.solve(0.5)


class Threads(unittest.TestCase):
    def test_one_at_a_time(self):
        """A second thread that solves, makes or asks a run is told so; after the first it may; what a run calls back may ask it"""
        for first in ("solve", "solve_mechanism"):
            said, inside = [], []
            runs = [oscillator().run(tolerance=1e-6) for _ in range(2)]

            def other():
                for call in (lambda: runs[1].solve(0.1), oscillator().run, lambda: h.solve_mechanism(lambda t, q, v, a: a + q, (0, 1), 1, 0), runs[0].snapshot,
                             runs[0].linearize, runs[0].sample, runs[1].equilibrium):
                    try:
                        call()
                        said.append("nothing")
                    except RuntimeError as error:
                        said.append(str(error))

            def begin(q):
                if not said:
                    thread = threading.Thread(target=other)
                    thread.start()
                    thread.join()
                inside.append(runs[0].snapshot().time)
                return q
            if first == "solve":
                runs[0].on_step(begin)
                runs[0].solve(0.1)
            else:
                h.solve_mechanism(lambda t, q, v, a: a + begin(q), (0, 1), 1, 0)
            self.assertEqual(len(said), 7)
            for text in said:
                self.assertRegex(text, r"^\S+\(\): another thread is making or solving a run.*processes")
            self.assertTrue(inside)
            thread = threading.Thread(target=lambda: runs[1].solve(0.1))
            thread.start()
            thread.join()
            self.assertEqual(runs[1].time, 0.1)

    def test_in_a_copy_of_the_process(self):
        """Made by another thread than the one that solves"""
        if not hasattr(os, "fork"):
            self.skipTest("no fork")
        run, status = oscillator().run(), []

        def copy():
            process = os.fork()
            if process == 0:
                os._exit(0 if h.solve_mechanism(lambda t, q, v, a: a + q, (0, 1), 1, 0).success else 1)
            status.append(os.waitpid(process, 0)[1])

        def begin(r):
            if not status:
                thread = threading.Thread(target=copy)
                thread.start()
                thread.join()
        run.on_step(begin)
        run.solve(0.1)
        self.assertEqual(status, [0])


class Within(unittest.TestCase):
    """Runs that are made and solved while another one is: what a controller predicts with"""

    def test_options_are_each_runs_own(self):
        scene, inner = oscillator(), []
        alone = scene.solve(1., tolerance=1e-5, options={"ts_hhtdae_order": 2})
        run = scene.run(tolerance=1e-5, options={"ts_hhtdae_order": 5})

        def predict(run):
            if not inner:
                inner.append(scene.solve(1., tolerance=1e-5, options={"ts_hhtdae_order": 2}))
                inner.append(scene.solve(1., tolerance=1e-5))
                inner.append(h.solve_mechanism(lambda t, q, v, a: [a[0] + 9 * q[0]], (0, 1), [1], [0], options={"ts_hhtdae_order": 2}))

        run.on_step(predict)
        run.solve(1.)
        self.assertEqual(inner[0].statistics.of_order, alone.statistics.of_order)
        for x in inner:
            self.assertEqual(sum(x.statistics.of_order[1:]), 0)
        self.assertGreater(sum(run.statistics.of_order[1:]), 0)

    def test_of_the_same_scene(self):
        """The formulas of both are the same, with a callback between them"""
        scene, nested, depth = h.Scene(), [False], []
        m = scene.add("b", h.PointMass(position=(1, 0, 0))).marker()
        x = h.displacement(m, "x")

        def one(t):
            if nested[0] and not depth:
                depth.append(1)
                scene.solve(0.3, tolerance=1e-3)
                depth.pop()
            return 1.

        scene.add("f", h.UserForce(m, force=(-4 * x * h.callback(one, h.time()), 0, 0)))
        scene.channel("x", x)
        ends = []
        for nested[0] in (False, True):
            ends.append(scene.solve(0.5, tolerance=1e-5)["x"][-1])
        self.assertEqual(ends[0], ends[1])


class Leaks(unittest.TestCase):
    def test_a_thousand_runs(self):
        """Memory after 1,000 runs is that after 100, but for less than a kilobyte a run"""
        scene = oscillator()

        def many(count):
            for _ in range(count):
                run = scene.run()
                run.solve(0.02)
                run.snapshot().value(h.kinetic_energy())
            gc.collect()
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

        many(50)
        before = many(50)
        self.assertLess(many(1000) - before, 1000)

    def test_scenes(self):
        def many(count):
            for _ in range(count):
                oscillator().run().solve(0.02)
            gc.collect()
            return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

        many(50)
        before = many(30)
        self.assertLess(many(200) - before, 400)


class Ends(unittest.TestCase):
    def script(self, text):
        return subprocess.run([sys.executable, "-B", "-c", text], capture_output=True, text=True, timeout=100, env=dict(os.environ))

    def test_programs_end_in_order(self):
        """With runs, snapshots and linearizations alive at the end, and in a cycle; without output of PETSc or a signal"""
        done = self.script("import hhtdae as h\n"
                           "s = h.Scene(gravity=(0, 0, -1))\n"
                           "b = s.add('b', h.PointMass())\n"
                           "s.channel('z', h.displacement(b.marker(), 2))\n"
                           "run = s.solve(1.)\n"
                           "now, small = run.snapshot(), run.linearize()\n"
                           "s.me = s; s.run2 = run\n"
                           "print('z', round(run['z'][-1], 9))\n")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "z -0.5\n", ""))

    def test_an_uncaught_error_is_a_traceback(self):
        done = self.script("import hhtdae as h\ns = h.Scene()\ns.add('rock', h.RigidBody(mass=-1))\ns.solve(1.)\n")
        self.assertEqual(done.returncode, 1)
        self.assertIn("body rock: mass is -1, must be positive", done.stderr.splitlines()[-1] + done.stderr)

    def test_rigid_scenes_load_no_slepc(self):
        done = self.script("import hhtdae as h\nfrom hhtdae import *\ns = h.Scene()\ns.add('b', h.PointMass())\ns.solve(0.1)\n"
                           "print('slepc' in open('/proc/self/maps').read())\n"
                           "print('flexible' in dir(h) or bool(h.flexible), 'slepc' in open('/proc/self/maps').read())\n")
        self.assertEqual(done.stdout.split()[0], "False", done.stderr)


if __name__ == "__main__":
    unittest.main()
