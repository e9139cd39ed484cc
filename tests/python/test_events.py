"""Events: each at its zero, and nothing sees what an event has taken back."""

import math
import os
import re
import tempfile
import unittest

import numpy as np

import hhtdae as h
from hhtdae.events import zero

G = 9.81


def ball(height=1.):
    scene = h.Scene(gravity=(0, 0, -G))
    b = scene.add("ball", h.PointMass(position=(0, 0, height)))
    z = h.displacement(b.marker(), 2)
    scene.channel("z", z)
    return scene, z, h.velocity(b.marker(), 2)


def bounces(height, part, count):
    """Times of the bounces of a ball that falls from a height"""
    t, v = math.sqrt(2 * height / G), math.sqrt(2 * height * G)
    times = []
    for _ in range(count):
        times.append(t)
        v *= part
        t += 2 * v / G
    return np.array(times)


class Zeros(unittest.TestCase):
    def test_close_to_an_end(self):
        for root in (1e-17, 1e-12, 1e-3, 0.5, 1 - 1e-12):
            for f in (lambda t: t - root, lambda t: (t - root)**3, lambda t: 1e8 * (t - root), lambda t: math.expm1(20 * (t - root))):
                t = zero(f, 0., f(0.), 1., f(1.))
                self.assertAlmostEqual(t, root, delta=1e-15)

    def test_zero_from_there_on(self):
        f = lambda t: max(0., 0.3 - t)
        self.assertAlmostEqual(zero(f, 0., f(0.), 1., f(1.)), 0.3, delta=1e-15)

    def test_of_equations(self):
        """Heights of a swing, where several are passed in one step, with those that lie next to its ends"""
        places = np.random.default_rng(1).uniform(-.9, .9, 60)
        s = h.solve_mechanism(lambda t, q, v, a: [a[0], a[1] + G], (0, 2), [1, 0], [0, 0], constraints=lambda t, q: [q[0]**2 + q[1]**2 - 1],
                              events=[(lambda t, q, v, x=x: q[0] - x) for x in places], trace=True)
        for x, q in zip(places, s.q_events):
            self.assertGreater(len(q), 0)
            np.testing.assert_allclose(q[:, 0], x, rtol=0, atol=1e-13)


class Conditions(unittest.TestCase):
    def test_begin_and_end(self):
        """A ball that is thrown is above 1.2 for a while"""
        times = [(3 - s * math.sqrt(9 - 2 * G * 0.2)) / G for s in (1, -1)]
        for formula, direction, wanted in ((lambda z: z > 1.2, 0, times), (lambda z: z > 1.2, 1, times[:1]), (lambda z: z > 1.2, -1, times[1:]),
                                           (lambda z: z < 1.2, 1, times[1:]), (lambda z: (z > 1.2) & (z < 5), 0, times)):
            scene = h.Scene(gravity=(0, 0, -G))
            b = scene.add("ball", h.PointMass(position=(0, 0, 1), velocity=(0, 0, 3)))
            run, seen = scene.run(tolerance=1e-8), []
            run.event(formula(h.displacement(b.marker(), 2)), lambda r: seen.append(r.time), direction=direction)
            run.solve(1.)
            np.testing.assert_allclose(seen, wanted, rtol=0, atol=1e-6)

    def test_no_number(self):
        scene, z, v = ball()
        run = scene.run(tolerance=1e-6)
        run.event(h.sqrt(z - 0.5))
        with self.assertRaisesRegex(ValueError, "event 0: its formula is not a number"):
            run.solve(1.)


class Bounces(unittest.TestCase):
    def test_at_the_floor(self):
        """All bounces at height zero, also those of which the next step would hold thousands"""
        for height, part, count in ((5., 0.9, 2), (0.1, 0.9, 10), (1., 0.8, 12), (0.1, 0.5, 20)):
            scene, z, _ = ball(height)
            run, seen = scene.run(tolerance=1e-6), []

            def bounce(r):
                U, V = r.ts.getSolution2()
                seen.append((r.time, U[2], V[2]))
                V.scale(-part)
                V.assemble()
            times = bounces(height, part, count + 1)
            run.event(z, bounce, direction=-1)
            run.solve(0.5 * (times[-1] + times[-2]))
            self.assertEqual(len(seen), count, (height, part))
            np.testing.assert_allclose([x[0] for x in seen], times[:-1], atol=2e-5)
            np.testing.assert_allclose([x[1] for x in seen], 0, atol=1e-12)
            self.assertLess(max(x[2] for x in seen), 0)

    def test_without_end(self):
        """Bounces pile up at a time, behind which there is no motion; the ball does not fall through the floor"""
        scene, z, _ = ball()
        run = scene.run(tolerance=1e-6)
        run.event(z, lambda r: r.ts.getSolution2()[1].scale(-0.5), direction=-1)
        with self.assertRaisesRegex(RuntimeError, "event 0 comes again and again at t = 1.35"):
            run.solve(3.)
        self.assertGreater(run["z"].min(), -1e-9)

    def test_jump_of_a_velocity(self):
        """The velocity is zero at the top of the flight; the impact, where it jumps from one sign to the other, is no passage"""
        scene, z, w = ball()
        run, tops = scene.run(tolerance=1e-7), []
        run.event(z, lambda r: r.ts.getSolution2()[1].scale(-0.8), direction=-1)
        run.event(w, lambda r: tops.append(r.time))
        run.solve(1.)
        fall = math.sqrt(2 / G)
        np.testing.assert_allclose(tops, [fall * 1.8], atol=1e-5)


def swing():
    """A pendulum of 1 m, thrown from the bottom with 6.5 m/s: the tension v^2 + g cos(th) of its rod falls through zero at 0.507258 s"""
    scene = h.Scene(gravity=(0, -G, 0))
    b = scene.add("b", h.RigidBody(mass=1, inertia=(1e-3,) * 3, position=(0, -1, 0), velocity=(6.5, 0, 0), angular_velocity=(0, 0, 6.5)))
    m = b.marker((0, 1, 0))
    return scene, h.joint_force(scene.add("p", h.Revolute(m, scene.ground.marker())), 1, frame=m)


class Reactions(unittest.TestCase):
    """Reactions and accelerations jump a little where an event begins the integrator's history anew"""

    def test_once_each(self):
        scene, T = swing()
        scene.channel("T", T)
        fine = scene.solve(3., tolerance=1e-8)
        passed = np.flatnonzero(np.diff(np.sign(fine["T"])))
        self.assertGreaterEqual(len(passed), 4)
        for tolerance in (1e-4, 1e-5, 1e-6, 1e-7):
            for direction in (0, -1, 1):
                run, seen = scene.run(tolerance=tolerance), []
                run.event(T, lambda r: seen.append(r.time), direction=direction)
                run.solve(3.)
                wanted = [fine.times[k] for k in passed if direction * fine["T"][k] <= 0]
                self.assertEqual(len(seen), len(wanted), (tolerance, direction))
                np.testing.assert_allclose(seen, wanted, atol=0.02 + 600 * tolerance)

    def test_terminal(self):
        """A run that goes on after its end there has passed, too"""
        scene, T = swing()
        run = scene.run(tolerance=1e-5)
        run.event(T, terminal=True)
        run.solve(0.8)
        self.assertAlmostEqual(run.time, 0.507258, delta=2e-3)
        run.solve(0.8)
        self.assertEqual(run.time, 0.8)

    def test_velocities_that_actions_change(self):
        """Passages of one direction, as close to each other as one likes: a velocity falls through zero, and an action, or somebody between two parts of
        the run, kicks it up again"""
        for kick in (1., 1e-2, 1e-4):
            scene, z, w = ball()
            run, seen = scene.run(tolerance=1e-6), []

            def up(r):
                r.ts.getSolution2()[1].setValue(2, kick)
                r.ts.getSolution2()[1].assemble()

            def action(r):
                seen.append(r.time)
                if len(seen) <= 5:
                    up(r)
            up(run)
            run.event(w, action, direction=-1)
            run.solve(6.5 * kick / G)
            np.testing.assert_allclose(seen, np.arange(1, 7) * kick / G, rtol=1e-6)
            run = scene.run(tolerance=1e-6)
            run.event(w, terminal=True, direction=-1)
            for k in range(1, 6):
                up(run)
                run.solve(run.time + 3 * kick / G)
                self.assertAlmostEqual(run.time, k * kick / G, delta=1e-6 * k * kick / G)

    def test_parameters_that_actions_change(self):
        """An acceleration falls with time, and a parameter raises it"""
        for more in (1e-1, 1e-3, 1e-5):
            scene = h.Scene()
            p = scene.parameter("p", 0.2)
            m = scene.add("b", h.PointMass()).marker()
            scene.add("f", h.UserForce(m, force=[p - h.time(), 0, 0]))
            run, seen = scene.run(tolerance=1e-6), []

            def action(r):
                seen.append(r.time)
                p.set(p.get() + more)
            run.event(h.acceleration(m, 0), action, direction=-1)
            run.solve(0.2 + 5.5 * more)
            np.testing.assert_allclose(seen, 0.2 + np.arange(6) * more, rtol=0, atol=1e-6 * more + 1e-12)

    def test_there_and_back(self):
        """A function that is on the other side for a moment only, again and again"""
        for depth in (1e-1, 1e-2, 1e-3):
            scene = h.Scene()
            m = scene.add("b", h.PointMass(position=(1, 0, 0))).marker()
            scene.add("f", h.UserForce(m, force=[-100 * h.displacement(m, 0), 0, 0]))
            run, seen = scene.run(tolerance=1e-8), []
            run.event(1 - depth - h.acceleration(m, 0) / 100, lambda r: seen.append(r.time))
            run.solve(3.)
            half, middles = math.acos(1 - depth) / 10, math.pi / 10 * np.arange(1, 10, 2)
            np.testing.assert_allclose(seen, np.sort(np.r_[middles - half, middles + half]), rtol=0, atol=2e-3)

    def test_first_event_while_the_run_is_solved(self):
        """Made by on_step() or by a callback, it has its action at every passage, as if there had been another event before"""
        for where in ("on_step", "callback"):
            scene, hits, armed = h.Scene(), [], []
            m = scene.add("mass", h.PointMass(position=(1, 0, 0))).marker()
            x = h.displacement(m, 0)

            def arm(time):
                if time > 1 and not armed:
                    armed.append(time)
                    run.event(x, action=lambda r: hits.append(r.time))
                return 0.

            scene.add("spring", h.UserForce(m, force=(-x + (h.callback(arm, h.time()) if where == "callback" else 0.), 0, 0)))
            run = scene.run(tolerance=1e-6)
            if where == "on_step":
                run.on_step(lambda r: arm(r.time))
            run.solve(10.)
            self.assertEqual(run.time, 10., where)
            np.testing.assert_allclose(hits, (np.arange(3) + 0.5) * math.pi, atol=2e-3, err_msg=where)

    def test_event_made_by_an_event(self):
        """A further event of a run does not make those before it forget"""
        scene, T = swing()
        run, seen = scene.run(tolerance=1e-5), []

        def action(r):
            seen.append(r.time)
            r.event(h.time() - 10.)
        run.event(T, action, direction=-1)
        run.solve(0.8)
        self.assertEqual(len(seen), 1)


class Checkpoints(unittest.TestCase):
    def test_resumed_bit_for_bit(self):
        """After an event, also where the run is begun anew after the checkpoint, and after one that has ended it"""
        def swing(terminal):
            scene = h.Scene(gravity=(0, -G, 0))
            load = scene.parameter("load", 0.)
            rod = scene.add("rod", h.RigidBody(inertia=h.inertia.box(1, (1, .1, .1)), position=(0.5, 0, 0)))
            scene.connect("pin", h.Revolute, rod, scene.ground, (0, 0, 0))
            tip = rod.marker((0.5, 0, 0))
            scene.add("load", h.UserForce(tip, force=[load, 0, 0]))
            scene.channel("x", h.displacement(tip, 0))
            run = scene.run(tolerance=1e-5)
            run.event(h.time() - 0.3, terminal=terminal)
            return run, load

        def on(run, load):
            load.set(3.)
            run.restart()
            return run.solve(1.)["x"][-1]
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "checkpoint")
            for terminal in (False, True):
                run, load = swing(terminal)
                run.solve(0.5)
                run.save(file)
                other, its_load = swing(terminal)
                self.assertEqual(on(other.load(file), its_load), on(run, load))


class Outputs(unittest.TestCase):
    def test_nothing_that_was_taken_back(self):
        """CSV, balance, animation, on_step and samples end at an event and go on behind it"""
        for dt in (0., 0.05):
            with tempfile.TemporaryDirectory() as folder:
                scene, z, _ = ball()
                scene.output(csv=os.path.join(folder, "x.csv"), balance=os.path.join(folder, "b.csv"), dt=dt, animation=os.path.join(folder, "a"))
                with scene.run(tolerance=1e-6) as run:
                    seen = []
                    run.on_step(lambda r: seen.append(r.time))
                    run.event(z, lambda r: r.ts.getSolution2()[1].scale(-0.8), direction=-1)
                    run.solve(1.5)
                    samples = run.times
                for name in ("x.csv", "b.csv"):
                    table = np.loadtxt(os.path.join(folder, name), delimiter=",", skiprows=1, usecols=range(2))
                    self.assertTrue(np.all(np.diff(table[:, 0]) > 0), name)
                    self.assertEqual(table[0, 0], 0)
                    if name == "x.csv":
                        self.assertGreater(table[:, 1].min(), -1e-9)
                        if dt:
                            np.testing.assert_allclose(table[:, 0], np.arange(31) * dt, atol=1e-9)
                with open(os.path.join(folder, "a.pvd")) as index:
                    frames = [float(t) for t in re.findall('timestep="([^"]*)"', index.read())]
                self.assertTrue(np.all(np.diff(frames) > 0))
                self.assertTrue(np.any(np.abs(np.array(frames) - math.sqrt(2 / G)) < 1e-5))
                self.assertTrue(np.all(np.diff(samples) > 0))
                self.assertTrue(np.all(np.diff(seen) >= 0))
                self.assertTrue(np.any(np.abs(np.array(seen) - math.sqrt(2 / G)) < 1e-5))

    def test_positions_that_parameters_ask_for(self):
        """A motion's displacement and a user constraint are parameters that are set between parts, or in on_step()"""
        for kind in ("motion", "constraint"):
            for where in ("step_by", "solve", "on_step"):
                scene = h.Scene()
                p = scene.parameter("p", 0.)
                rotor = scene.add("rotor", h.RigidBody(1, np.diag([.1, .1, .2])))
                i, j = rotor.marker(), scene.ground.marker()
                scene.add("pin", h.Revolute(i, j))
                angle = h.angle(i, j)
                scene.add("drive", h.RotationalMotion(i, j, lambda t: p + 0 * t) if kind == "motion" else h.UserConstraint([angle - p]))
                scene.channel("angle", angle)
                run = scene.run(tolerance=1e-7, options={"ts_adapt_dt_max": 0.05})
                if where == "step_by":
                    for k, t in enumerate(run.step_by(0.05, 0.5)):
                        p.set(0.1 * (k + 1))
                    expected = 0.9
                elif where == "solve":
                    for k in range(10):
                        run.solve(0.05 * (k + 1))
                        p.set(0.1 * (k + 1))
                    expected = 0.9
                else:
                    def jump(r):
                        if r.time > 0.2 and not p.get():
                            p.set(0.1)
                            r.restart()
                    run.on_step(jump)
                    run.solve(0.5)
                    expected = 0.1
                self.assertEqual(run.time, 0.5)
                self.assertAlmostEqual(run["angle"][-1], expected, delta=1e-9, msg=(kind, where))

    def test_terminal_event_ends_step_by(self):
        scene, z, _ = ball()
        run = scene.run(tolerance=1e-7)
        run.event(z - 0.5, terminal=True)
        times = list(run.step_by(0.1, until=1.))
        fall = math.sqrt(1 / G)
        np.testing.assert_allclose(times, [0.1, 0.2, 0.3, fall], atol=1e-6)
        self.assertEqual(run.time, times[-1])
        self.assertAlmostEqual(run["z"][-1], 0.5, delta=1e-12)
        self.assertAlmostEqual(run.sample()["z"], 0.5, delta=1e-12)


if __name__ == "__main__":
    unittest.main()
