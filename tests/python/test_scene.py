"""Scenes: every kind of element with the defaults of C++, bodies, parameters, runs, channels, queries, analyses, small motions, messages."""

import math
import os
import pathlib
import tempfile
import unittest
import warnings

import numpy as np

import hhtdae as h
from hhtdae import _core, elements, spec
from hhtdae.expressions import Expression
from hhtdae.tracing import compile_tape


def pendulum(tip=(1., 0., 0.), **fields):
    scene = h.Scene(gravity=(0, -9.81, 0))
    rod = scene.add("rod", h.RigidBody(mass=2., inertia=h.inertia.box(2., (1, .1, .1)), position=(0.5, 0, 0), **fields))
    pin = scene.connect("pin", h.Revolute, rod, scene.ground, (0, 0, 0))
    return scene, rod, pin


class Elements(unittest.TestCase):
    def test_python_and_cpp_have_the_same_kinds_fields_and_defaults(self):
        kinds = _core.kinds()
        self.assertEqual(set(kinds), set(elements.ELEMENTS))
        for name, defaults in kinds.items():
            given = {}
            for f in spec.fields(getattr(h, name)):
                plain = f.default if f.default is not spec.field().default else f.default_factory() if callable(f.default_factory) else None
                given[f.name] = plain._fields({}) if isinstance(plain, spec.Spec) else plain
            self.assertEqual(set(given), set(defaults), name)
            for field, value in defaults.items():
                if value is None or given[field] is None:
                    self.assertIsNone(given[field], "%s.%s" % (name, field))
                elif isinstance(value, dict):
                    self.assertEqual(given[field], value, "%s.%s" % (name, field))
                else:
                    np.testing.assert_array_equal(given[field], value, "%s.%s" % (name, field))

    def test_every_kind_enters_a_scene(self):
        """What C++ refuses of it is told by the error of set_up, in which no kind is unknown and no field misread"""
        scene = h.Scene()
        a, b, c = (scene.add(n, h.RigidBody(position=p)) for n, p in zip("abc", ((0, 0, 0), (1, 0, 0), (2, 0, 0))))
        i, j = b.marker(), a.marker()
        k = c.marker()
        pin = scene.add("hinge", h.Revolute(i, j))
        special = {
            "Coupler": lambda: h.Coupler([h.Term(i, j), h.Term(k, i, rotation=False, factor=2.)]), "Gear": lambda: h.Gear(i, j, k, i, ratio=2.),
            "RackAndPinion": lambda: h.RackAndPinion(i, j, k, i), "GearMesh": lambda: h.GearMesh(i, j, k, j, a.marker()),
            "RackMesh": lambda: h.RackMesh(i, j, k, j, a.marker()), "PointOnCurve": lambda: h.PointOnCurve(i, j, [(0, 0, 0), (1, 0, 0), (2, 1, 0)]),
            "UserConstraint": lambda: h.UserConstraint([h.displacement(i, 0) - 1]), "RotationalMotion": lambda: h.RotationalMotion(i, j, lambda t: t * t),
            "TranslationalMotion": lambda: h.TranslationalMotion(i, j, h.harmonic(1, 2), of="velocity", axis=0),
            "NonlinearSpring": lambda: h.NonlinearSpring(i, j, lambda l, v: l - 1 + v), "JointFriction": lambda: h.JointFriction(pin, 0.1, radius=0.1),
            "NonlinearTorsionalSpring": lambda: h.NonlinearTorsionalSpring(i, j, lambda p, w: -h.sin(p)),
            "UserForce": lambda: h.UserForce(i, force=[1, 2, h.time()]), "UserScalarForce": lambda: h.UserScalarForce(i, j, h.sin(h.time())),
            "ModalLoad": lambda: h.ModalLoad(b, "wind", h.time()), "NodeContact": lambda: h.NodeContact(b, j)}
        for count, name in enumerate(elements.ELEMENTS):
            e = scene.add("my " + name, special.get(name, lambda: getattr(h, name)(i, j))())
            self.assertEqual(e._id, pin._id + 1 + count)
        with self.assertRaises(h.Error):
            scene.set_up()  # so much at once is no mechanism

    def test_ground_acceleration(self):
        """A free body falls behind the ground by half its acceleration times the square of time"""
        scene = h.Scene()
        body = scene.add("body", h.RigidBody())
        scene.ground_acceleration(2., z=lambda t: 0 * t + 4)
        for c, name in enumerate("xyz"):
            scene.channel(name, h.displacement(body.marker(), c))
        last = scene.solve(0.5, tolerance=1e-8).sample()
        np.testing.assert_allclose([last[name] for name in "xyz"], [-0.25, 0, -0.5], atol=1e-6)

    def test_parameters_after_ground_acceleration(self):
        """It stays when they change"""
        scene = h.Scene()
        scene.ground_acceleration(2.)
        mass = scene.parameter("mass", 1.)
        body = scene.add("body", h.PointMass(mass=mass))
        scene.channel("x", h.displacement(body.marker(), 0))
        for value in (1., 3.):
            scene.set(mass=value)
            self.assertAlmostEqual(scene.solve(1.)["x"][-1], -1., delta=1e-9)

    def test_names(self):
        """A part without a name has the one by which messages call it; no two parts have the same"""
        scene = h.Scene()
        a, b = scene.rigid_body(""), scene.add("", lambda: h.PointMass(position=(1, 0, 0)))
        pin = scene.connect("", h.Spherical, a, scene.ground, (0, 0, 0))
        spring = scene.add("", h.SpringDamper(a.marker(), b.marker(), stiffness=1.))
        time, decay = scene.variable("", h.time()), scene.state("", lambda x: -x, 1.)
        self.assertEqual([x.name for x in (a, b, pin, spring, time, decay)], ["body 0", "body 1", "spherical 0", "spring damper 1", "variable 0", "state 0"])
        scene.add("body 1", h.PointMass(position=(2, 0, 0)))
        scene.add("spherical 0", h.SpringDamper(a.marker(), b.marker(), stiffness=1.))
        with self.assertRaisesRegex(h.Error, "(?s)body body 1: the name is given more than once.*element spherical 0: the name"):
            scene.set_up()

    def test_view(self):
        scene, rod, pin = pendulum()
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "view")
            scene.view(file)
            with open(file) as text:
                self.assertRegex(text.read(), "1 degrees? of freedom")

    def test_wrong_fields(self):
        scene, rod, pin = pendulum()
        i, j = rod.marker(), scene.ground.marker()
        for spec, kind, text in ((h.SpringDamper(i, j, stiffness="hard"), TypeError, "SpringDamper s: stiffness must be a number, is 'hard'"),
                                 (h.Bushing(i, j, stiffness=(1, 2)), ValueError, "stiffness must be three numbers"),
                                 (h.Revolute(i, "ground"), TypeError, "Revolute s: j must be a scene's marker, is 'ground'"),
                                 (h.RotationalMotion(i, j, 0., of="jerk"), ValueError, "must be 'displacement'"),
                                 (h.NonlinearSpring(i, j, lambda l, v: 1 if l > 1 else 0), TypeError, "hhtdae.where"),
                                 (42, TypeError, "no body, joint")):
            with self.assertRaisesRegex(kind, text):
                scene.add("s", spec)


    def test_none_and_wrong_types(self):
        """Where a number is wanted, nothing else is taken for one, or for the default: the message names element and field"""
        scene, rod, pin = pendulum()
        i, j = rod.marker(), scene.ground.marker()
        for spec, text in ((h.SpringDamper(i, j, stiffness=None), "SpringDamper s: stiffness is None.*default"),
                           (h.SpherePlane(i, j, law=None), "SpherePlane s: law is None.*default"),
                           (h.SpherePlane(i, j, law=h.ContactLaw(friction=None)), "SpherePlane s: law: friction is None"),
                           (h.Coupler([h.Term(i, j), h.Term(i, j, factor=None)]), "Coupler s: term 1: factor is None"),
                           (h.TranslationalMotion(i, j, None), "TranslationalMotion s: function is None, must be a value$"),
                           (h.NonlinearSpring(i, j, None), "NonlinearSpring s: tension is None"),
                           (h.UserConstraint(None), "UserConstraint s: rows is None"),
                           (h.PointOnCurve(i, j, None), "PointOnCurve s: points is None"),
                           (h.RigidBody(mass=None), "RigidBody s: mass is None"),
                           (h.PointMass(position=None), "PointMass s: position is None"),
                           (h.PointMass(mass="3"), "s: mass must be a number, is '3'"),
                           (h.RotationalMotion(i, j, 0., of=3), "of must be a text, is 3"),
                           (h.SpringDamper(i, j, stiffness=1 + h.time()), "SpringDamper s: stiffness is a formula of the state or of time.*parameters"),
                           (h.UserForce(i, force=[1, "2", 3]), "UserForce s: force: '2' is no number and no formula")):
            with self.assertRaisesRegex(TypeError, text):
                scene.add("s", spec)
        for call, text in ((lambda: rod.marker((h.displacement(i, 0), 0, 0), name="tip"), "marker tip: position is a formula of the state"),
                           (lambda: scene.set_gravity((0, h.time(), 0)), "gravity is a formula"),
                           (lambda: scene.add(None, h.RigidBody()), "the name is None, must be a text"),
                           (lambda: scene.channel(3, h.time()), r"Scene.channel\(\): the name is 3"),
                           (lambda: h.Scene().parameter(None, 1.), r"Scene.parameter\(\): the name is None"),
                           (lambda: scene.variable("V", 1., None), "variable V: its initial value is None"),
                           (lambda: scene.output(dt="1"), r"output\(\): dt is '1', must be a number"),
                           (lambda: scene.set(k="1"), "parameter k is '1'")):
            with self.assertRaisesRegex(TypeError, text):
                call()
        for index in (3, -1, 10**12, 1., None):
            with self.assertRaisesRegex(ValueError, "component is"):
                h.displacement(i, index)
            if index != 3:
                with self.assertRaisesRegex(ValueError, "row is"):
                    h.multiplier(pin, index)
        scene.add("free", h.UserForce(i, None, None, [0, 0, 0], None))
        run = scene.run()
        for call in (run.snapshot, run.linearize, run.sample, run.equilibrium, run.assemble, run.solve, lambda t: list(run.step_by(0.1, t))):
            with self.assertRaisesRegex(TypeError, "is 'a', must be a number"):
                call("a")
        with self.assertRaisesRegex(TypeError, "until is None"):
            run.solve(None)

    def test_parameters_of_another_scene(self):
        other = h.Scene().parameter("k", 3.)
        scene, rod, pin = pendulum()
        i, j = rod.marker(), scene.ground.marker()
        x = h.displacement(i, 0)
        run = scene.run()
        scene, rod, pin = pendulum()
        i, j = rod.marker(), scene.ground.marker()
        for call in (lambda: scene.add("s", h.SpringDamper(i, j, stiffness=2 * other)), lambda: scene.add("b", h.RigidBody(mass=other)),
                     lambda: scene.add("s", h.SpherePlane(i, j, law=h.ContactLaw(friction=other))),
                     lambda: scene.add("s", h.Coupler([h.Term(i, j, factor=other), h.Term(i, j)])),
                     lambda: scene.add("s", h.NonlinearSpring(i, j, lambda l, v: other * l)), lambda: scene.add("s", h.UserForce(i, force=[other * x, 0, 0])),
                     lambda: scene.add("s", h.RotationalMotion(i, j, lambda t: other * t)), lambda: scene.add("s", h.RotationalMotion(i, j, other * h.time())),
                     lambda: scene.add("s", lambda: h.SpringDamper(i, j, stiffness=other)),
                     lambda: scene.ground_acceleration(x=lambda t: other * t), lambda: scene.set_gravity((0, 0, -other)),
                     lambda: rod.marker((other, 0, 0)), lambda: rod.marker(axes=[[other, 0, 0], [0, 1, 0], [0, 0, 1]]),
                     lambda: scene.variable("V", other * x), lambda: scene.state("X", lambda own: -other * own, 1.), lambda: scene.channel("c", other * x),
                     lambda: run.event(x - other), lambda: run.snapshot().value(other * h.time())):
            with self.assertRaisesRegex((ValueError, RuntimeError), "parameter k is of another scene"):
                call()
                scene.set_up()
        own = h.Scene()
        k = own.parameter("k", 3.)
        k.set(4.)
        own.add("b", h.RigidBody(mass=k))
        own.set_up()

    def test_laws_of_more_than_their_arguments(self):
        scene, rod, pin = pendulum()
        i, j = rod.marker(), scene.ground.marker()
        V = scene.variable("V", 1.)
        for law in (lambda l, v: -l * h.time(), lambda l, v: -l * h.value(V), lambda l, v: h.velocity(i, 0)):
            with self.assertRaisesRegex(TypeError, "NonlinearSpring s: tension: a force law depends on its two arguments.*UserScalarForce"):
                scene.add("s", h.NonlinearSpring(i, j, law))
        for motion in (lambda t: h.sin(h.time()), lambda t: t * h.value(V)):
            with self.assertRaisesRegex(TypeError, "RotationalMotion m: function: a function of time depends on its argument.*use the argument"):
                scene.add("m", h.RotationalMotion(i, j, motion))
        with self.assertRaisesRegex(TypeError, "a function of time depends on"):
            scene.ground_acceleration(x=lambda t: h.time())


class Runs(unittest.TestCase):
    def test_pendulum(self):
        """Energy, channels, sampling, statistics, the closed form of small swings"""
        scene, rod, pin = pendulum()
        tip = rod.marker((0.5, 0, 0))
        scene.channel("angle", h.angle(rod.marker(), scene.ground.marker()), "rad")
        scene.channel("energy", h.kinetic_energy() + h.potential_energy(), "J")
        scene.channel("height", h.displacement(tip, "y"), "m")
        run = scene.solve(1., tolerance=1e-8)
        self.assertEqual(len(run.times), run.steps + 1)
        self.assertEqual(run.statistics.steps, run.steps)
        self.assertEqual((run.times[0], run.times[-1]), (0., 1.))
        self.assertLess(np.ptp(run["energy"]), 2e-4)
        np.testing.assert_allclose(run["height"], np.sin(run["angle"]), atol=1e-9)
        self.assertEqual(set(run.channels), {"time", "angle", "energy", "height"})
        even = scene.solve(1., tolerance=1e-8, sample=0.1)
        np.testing.assert_allclose(even.times, np.arange(11) / 10, atol=1e-12)
        np.testing.assert_allclose(even["angle"], np.interp(even.times, run.times, run["angle"]), atol=2e-4)
        with self.assertRaisesRegex(KeyError, "angle, energy, height"):
            run["angel"]
        self.assertAlmostEqual(run.sample()["angle"], run["angle"][-1])
        self.assertEqual(len(scene.solve(0.1, sample=None).times), 0)

    def test_samples_from_another_time(self):
        """Samples are the start and whole multiples of their distance behind it, before zero too"""
        for begin in (-1., -0.05, 0.3):
            scene, rod, pin = pendulum()
            scene.channel("angle", h.angle(rod.marker(), scene.ground.marker()), "rad")
            scene.start(time=begin)
            first = math.floor(begin / 0.1 + 1e-9) + 1
            wanted = [begin] + [k / 10 for k in range(first, round(10 * begin + 5) + 1) if k / 10 <= begin + 0.5 + 1e-9]
            np.testing.assert_allclose(scene.solve(begin + 0.5, sample=0.1).times, wanted, atol=1e-12)

    def test_samples_beyond_32_bits(self):
        scene = h.Scene()
        ball = scene.add("ball", h.PointMass(velocity=(2, 0, 0)))
        scene.channel("x", h.displacement(ball.marker(), 0))
        scene.start(time=1.7e9)
        run = scene.run(sample=0.125).solve(1.7e9 + 1)
        np.testing.assert_array_equal(run.times, 1.7e9 + 0.125 * np.arange(9))
        np.testing.assert_allclose(run["x"], 0.25 * np.arange(9), atol=1e-6)

    def test_parts_and_copies(self):
        """A run in parts, one that goes on from another, a checkpoint"""
        scene, rod, pin = pendulum()
        scene.channel("angle", h.angle(rod.marker(), scene.ground.marker()), "rad")
        whole = scene.solve(1., tolerance=1e-8)
        parts = scene.run(tolerance=1e-8)
        times = list(parts.step_by(0.3, until=1.))
        np.testing.assert_allclose(times, [0.3, 0.6, 0.9, 1.])
        self.assertTrue(np.all(np.diff(parts.times) > 0))
        self.assertAlmostEqual(parts["angle"][-1], whole["angle"][-1], delta=2e-6)
        self.assertEqual(parts.statistics.restarts, 1)
        half = scene.solve(0.5, tolerance=1e-8)
        on = scene.run(tolerance=1e-8, after=half).solve(1.)
        self.assertAlmostEqual(on["angle"][-1], whole["angle"][-1], delta=2e-5)
        self.assertEqual(on.times[0], 0.5)
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "half")
            half.save(file)
            again = scene.run(tolerance=1e-8).load(file)
            a, b = again.solve(1.), half.solve(1.)
            self.assertEqual(again.times[0], 0.5)
            self.assertEqual(a["angle"][-1], b["angle"][-1])
        with self.assertRaisesRegex(ValueError, "cannot go back"):
            whole.solve(0.5)

    def test_checkpoints(self):
        """A loaded run is at the checkpoint at once: for snapshots, in parts, with events and files of results; wrong files are told by load()"""
        scene, rod, pin = pendulum()
        angle = h.angle(rod.marker(), scene.ground.marker())
        scene.channel("angle", angle, "rad")
        with tempfile.TemporaryDirectory() as folder:
            file, table = os.path.join(folder, "half"), os.path.join(folder, "x.csv")
            scene.output(csv=table, dt=0.1)
            half = scene.solve(0.55, tolerance=1e-8)
            half.save(file)
            here = half["angle"][-1]
            on = half.solve(1.)
            with open(table) as text:
                rows = text.read()
            load = lambda: scene.run(tolerance=1e-8).load(file)
            run = load()
            self.assertEqual(run.time, 0.55)
            self.assertEqual(run.snapshot().value(angle), here)
            self.assertEqual(run.solve(1.)["angle"][-1], on["angle"][-1])
            with open(table) as text:
                self.assertEqual(text.read(), rows)
            scene.output(csv="")
            run = load()
            np.testing.assert_allclose(list(run.step_by(0.25, 1.)), [0.8, 1.])
            self.assertAlmostEqual(run["angle"][-1], on["angle"][-1], delta=1e-5)
            run = load().solve(0.55)
            self.assertEqual(run.solve(1.)["angle"][-1], on["angle"][-1])
            with self.assertRaisesRegex(ValueError, "cannot go back"):
                load().solve(0.5)
            run, seen = load(), []
            run.event(h.time() - 0.7, lambda r: seen.append(r.time))
            run.solve(1.)
            np.testing.assert_allclose(seen, [0.7])
            with self.assertRaisesRegex(h.Error, "Cannot open the checkpoint"):
                scene.run().load(file + " that is not there")
            with open(file + " of others", "w") as text:
                text.write("not a checkpoint" * 100)
            with self.assertRaisesRegex(h.Error, "not a checkpoint"):
                scene.run().load(file + " of others")
            other = h.Scene()
            other.add("rod", h.PointMass())
            with self.assertRaises(h.Error):
                other.run().load(file)

    def test_samples_after_a_checkpoint(self):
        """What was recorded beyond the checkpoint's time is gone, and with another load on the way from there other values come in its place"""
        with tempfile.TemporaryDirectory() as folder:
            for sample in (0., 0.05):
                scene = h.Scene()
                push = scene.parameter("push", 0.)
                m = scene.add("ball", h.PointMass(velocity=(1, 0, 0))).marker()
                scene.add("push", h.UserForce(m, force=[push, 0, 0]))
                scene.channel("x", h.displacement(m, 0))
                run, file = scene.run(sample=sample), os.path.join(folder, "state")
                run.solve(0.5).save(file)
                before = run.times
                run.solve(1.)
                run.load(file)
                np.testing.assert_array_equal(run.times, before)
                scene.set(push=2.)
                run.restart()
                run.solve(1.)
                np.testing.assert_allclose(run["x"], run.times + np.maximum(run.times - 0.5, 0)**2, atol=1e-6)
                self.assertTrue(np.all(np.diff(run.times) > 0))

    def test_parameters_between_two_parts(self):
        """A spring that becomes four times as stiff at rest at its longest: the acceleration is right at once; a run that goes on from a checkpoint begins anew, too"""
        def spring():
            scene = h.Scene()
            k = scene.parameter("k", 1.)
            m = scene.add("mass", h.PointMass(position=(1, 0, 0))).marker()
            x = h.displacement(m, "x")
            scene.add("spring", h.UserForce(m, force=[-k * x, 0, 0]))
            scene.channel("x", x)
            return scene, scene.run(tolerance=1e-9)
        scene, run = spring()
        run.solve(2 * np.pi)
        scene.set(k=4.)
        n = len(run.times)
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "state")
            run.save(file)
            run.solve(2 * np.pi + 2)
            other, again = spring()
            other.set(k=4.)
            again.load(file)
            again.solve(2 * np.pi + 2)
        np.testing.assert_allclose(run["x"][n:], np.cos(2 * (run.times[n:] - 2 * np.pi)), atol=1.5e-5)
        self.assertEqual(run["x"][-1], again["x"][-1])
        np.testing.assert_array_equal(run.times[n:], again.times[1:])

    def test_a_motion_that_jumps_between_two_parts(self):
        """Positions go to the nearest that meet it, or the error names it and no step is made"""
        for options in ({}, {"ts_hhtdae_start": "report"}):
            scene = h.Scene(planar=True)
            w = scene.parameter("w", 10.)
            disc = scene.add("disc", h.RigidBody(1, np.eye(3), angular_velocity=(0, 0, 10.)))
            scene.connect("pin", h.Revolute, disc, scene.ground, (0, 0, 0))
            i, j = disc.marker(), scene.ground.marker()
            scene.add("drive", h.RotationalMotion(i, j, lambda t: w * t))
            scene.channel("angle", h.angle(i, j))
            run = scene.run(tolerance=1e-6, options=options).solve(10.)
            scene.set(w=10.1)
            n = run.steps
            if options:
                with self.assertRaisesRegex(h.Error, r"At t = 10. the positions violate the constraints, which have been changed.*the largest violation is 1, in row .*drive"):
                    run.solve(10.5)
                self.assertEqual(run.steps, n)
            else:
                run.solve(10.5)
                np.testing.assert_allclose(run["angle"][n + 1:], 10.1 * run.times[n + 1:], atol=1e-8)

    def test_events(self):
        """A stone that falls through 0.5 m, and one that a switch at 0.75 m makes weightless"""
        def stone():
            scene = h.Scene()
            g = scene.parameter("g", 9.81)
            b = scene.add("stone", h.PointMass(position=(0, 0, 1)))
            m = b.marker()
            scene.add("weight", h.UserForce(m, force=[0, 0, -g]))
            z = h.displacement(m, 2)
            scene.channel("z", z)
            return scene, g, z
        scene, g, z = stone()
        run, seen = scene.run(tolerance=1e-7), []
        run.event(z - 0.75, action=lambda r: seen.append(r.time), direction=-1)
        run.event(z - 0.5, terminal=True)
        run.event(z - 0.8, action=lambda r: seen.append(-1.), direction=1)
        run.solve(1.)
        self.assertEqual(len(seen), 1)
        self.assertAlmostEqual(seen[0], np.sqrt(2 * 0.25 / 9.81), delta=1e-6)
        self.assertAlmostEqual(run.time, np.sqrt(1 / 9.81), delta=1e-6)
        scene, g, z = stone()
        run = scene.run(tolerance=1e-7)

        run.event(z - 0.75, action=lambda r: g.set(0))
        run.solve(0.5)
        fall = np.sqrt(2 * 0.25 / 9.81)
        self.assertAlmostEqual(run["z"][-1], 0.75 - 9.81 * fall * (0.5 - fall), delta=1e-5)
        self.assertTrue(np.all(np.diff(run.times) > 0))
        self.assertTrue(np.any(abs(run.times - fall) < 1e-6))

    def test_events_of_a_top(self):
        """Rotations in space go on through events in which nothing is done"""
        def top():
            scene = h.Scene(gravity=(0, 0, -9.81))
            scene.start(assembly="project")
            body = scene.add("top", h.RigidBody(0.5, np.diag([2e-3, 3e-3, 1e-3]), position=(0.1, 0.02, 0.3), angular_velocity=(3, 20, 7)))
            scene.connect("tip", h.Spherical, body, scene.ground, (0.1, 0.02, 0.2))
            at = body.marker((0.05, 0.02, 0.1))
            for c in "xyz":
                scene.channel(c, h.displacement(at, c))
            scene.channel("turns", h.angle(at, scene.ground.marker()))
            return scene, h.displacement(at, "z")
        scene, z = top()
        plain = scene.solve(1., tolerance=1e-7)
        scene, z = top()
        run, heights = scene.run(tolerance=1e-7), []
        run.event(z - 0.29, action=lambda r: heights.append(r.snapshot().value(z)))
        run.solve(1.)
        self.assertEqual(len(heights), 4)
        np.testing.assert_allclose(heights, 0.29, atol=1e-9)
        for name in ("x", "y", "z", "turns"):
            self.assertAlmostEqual(run[name][-1], plain[name][-1], delta=2e-5)  # their errors at this tolerance are 4e-5
        self.assertEqual(run.statistics.restarts, 5)

    def test_bounces(self):
        """A ball that an action throws back with 0.8 of its velocity; samples at multiples of a time"""
        scene = h.Scene(gravity=(0, 0, -10.))
        b = scene.add("ball", h.PointMass(position=(0, 0, 1.25)))
        z = h.displacement(b.marker(), 2)
        scene.channel("z", z)
        run, times = scene.run(tolerance=1e-8, sample=0.1), []

        def bounce(r):
            times.append(r.time)
            _, v = r.ts.getSolution2()
            v.scale(-0.8)
        run.event(z, action=bounce, direction=-1)
        run.solve(2.5)
        np.testing.assert_allclose(times, [0.5, 1.3, 1.94, 2.452], atol=1e-5)  # 0.5 s up to the floor, then 2 v / g
        np.testing.assert_allclose(run.times, np.arange(26) / 10, atol=1e-12)
        self.assertAlmostEqual(run["z"][9], 4 * 0.4 - 5 * 0.4**2, delta=1e-5)
        self.assertGreater(run["z"].min(), -1e-9)

    def test_gravity_before_parameters(self):
        """Gravity that is given with the scene stays when parameters change"""
        scene = h.Scene(gravity=(0, 0, -10.))
        m = scene.parameter("m", 2.)
        b = scene.add("b", h.PointMass(mass=m))
        scene.channel("z", h.displacement(b.marker(), 2))
        for mass in (2., 3., 2.):
            scene.set(m=mass)
            self.assertAlmostEqual(scene.solve(1.)["z"][-1], -5., delta=1e-9)
        other = h.Scene()
        other.channel("t", h.time())
        with self.assertRaisesRegex(ValueError, "parameter m came too late"):
            other.parameter("m", 1.)

    def test_what_comes_too_late(self):
        """After the set-up every call that describes something raises, and neither the scene nor its runs are changed"""
        scene = h.Scene(gravity=(0, 0, -10.))
        ball = scene.add("ball", h.PointMass())
        z = h.displacement(ball.marker(), 2)
        scene.channel("z", z)
        run = scene.run().solve(0.5)
        for name, late in (("channel v", lambda: scene.channel("v", z)), ("other", lambda: scene.add("other", h.PointMass())), ("a shape of ball", lambda: ball.shape(h.Shape.sphere(1.))),
                           ("variable V", lambda: scene.variable("V", z)), ("state x", lambda: scene.state("x", z, 0.)), ("gravity", lambda: scene.set_gravity((0, 0, 0)))):
            with self.assertRaisesRegex(RuntimeError, name + " came too late"):
                late()
        self.assertEqual(run.solve(1.).sample()["z"], run["z"][-1])
        self.assertAlmostEqual(run["z"][-1], -5., delta=1e-9)
        self.assertAlmostEqual(scene.solve(1.)["z"][-1], -5., delta=1e-9)
        self.assertAlmostEqual(run.snapshot().value(h.displacement(ball.marker(), 2)), -5., delta=1e-9)  # markers of questions may come at any time

    def test_channels_of_another_ts_type(self):
        scene = h.Scene(gravity=(0, 0, -2.))
        scene.channel("z", h.displacement(scene.add("ball", h.PointMass()).marker(), 2))
        run = scene.run(options={"ts_type": "alpha2", "ts_dt": 0.1, "ts_adapt_type": "none"}).solve(1.)
        self.assertAlmostEqual(run["z"][-1], -1., delta=1e-6)
        self.assertEqual(run.times[0], 0.)

    def test_motions_with_parameters(self):
        """What a function of time takes of parameters changes from run to run"""
        scene = h.Scene()
        a, w = scene.parameter("a", 1.), scene.parameter("w", 2.)
        m = scene.add("b", h.RigidBody()).marker()
        scene.add("guide", h.Translational(m, scene.ground.marker()))
        scene.add("drive", h.TranslationalMotion(m, scene.ground.marker(), h.harmonic(2 * a, w, offset=0.5)))
        scene.start(assembly="project")
        for amplitude, omega in ((1., 2.), (0.3, 5.)):
            scene.set(a=amplitude, w=omega)
            now = scene.run().kinematics(0.4).snapshot()
            self.assertAlmostEqual(now.motion(m).position[2], 0.5 + 2 * amplitude * np.sin(omega * 0.4), delta=1e-9)
            self.assertAlmostEqual(now.motion(m).velocity[2], 2 * amplitude * omega * np.cos(omega * 0.4), delta=1e-7)
        p = h.polynomial([a, 2 * a, 3.])
        self.assertAlmostEqual(p(h.sqrt(a * a)).get(), 0.3 + 0.6 * 0.3 + 3 * 0.09)
        with self.assertRaisesRegex(TypeError, "points of a spline are numbers"):
            h.spline([0, 1], [a, 2])
        with self.assertRaisesRegex(TypeError, "initial value is .*must be a number"):
            scene.state("x", 1., a)

    def test_what_is_changed_after_it_was_given(self):
        """Bodies, elements, positions and gravity are what they were when they were given, also where parameters have changed since then"""
        scene = h.Scene()
        k = scene.parameter("k", 1.)
        gravity = [0., 0., -k]
        scene.set_gravity(gravity)
        gravity[2] = 7.
        place = np.array([3. * k, 0., 0.])
        body = h.RigidBody(position=place)
        b = scene.add("b", body)
        place[0], body.mass = k, 5.
        at = [k * 1., 0., 0.]
        marker = b.marker(at)
        at[0] = 5.
        spring = h.SpringDamper(b.marker(), scene.ground.marker(), stiffness=k, length=1.)
        element = scene.add("spring", spring)
        spring.length, spring.i = 2., None
        scene.channel("f", h.force(element, 0))
        scene.channel("x", h.displacement(marker, "x"))
        scene.channel("a", h.acceleration(b.marker(), "z"))
        before = scene.run().sample()
        scene.set(k=2.)
        scene.run().close()
        scene.set(k=1.)
        self.assertEqual(scene.run().sample(), before)
        np.testing.assert_allclose(np.abs(list(before.values()) if isinstance(before, dict) else before), [2., 4., 1.], atol=1e-9)

    def test_parameters(self):
        """Formulas of parameters in bodies, markers, elements and gravity; functions that describe; elements that may be missing"""
        scene = h.Scene()
        k, m, g, there = (scene.parameter(n, x) for n, x in (("k", 100.), ("m", 2.), ("g", 9.81), ("there", 1.)))
        scene.set_gravity((0, 0, -g))
        b = scene.add("b", h.PointMass(mass=2 * m, position=(0, 0, 0.1 * k / 100)))
        anchor = scene.ground.marker((0, 0, 0.01 * k))
        scene.add("spring", h.SpringDamper(b.marker(), anchor, stiffness=k, length=0.))
        guard = scene.ground.marker((0.5, 0, 0))
        on = b.marker()
        scene.add("extra", lambda: h.SpringDamper(on, guard, stiffness=k.get(), length=0.) if there.get() else None)
        for stiffness, mass, gravity, extra in ((100., 2., 9.81, 1), (400., 3., 1.6, 0), (100., 2., 9.81, 1)):
            scene.set(k=stiffness, m=mass, g=gravity, there=extra)
            with scene.run().equilibrium() as run:
                z, x = (run.snapshot().motion(b).position[i] for i in (2, 0))
            if extra:
                self.assertAlmostEqual(z, 0.5 * 0.01 * stiffness - 2 * mass * gravity / (2 * stiffness), delta=1e-9)
                self.assertAlmostEqual(x, 0.25, delta=1e-9)
            else:
                self.assertAlmostEqual(z, 0.01 * stiffness - 2 * mass * gravity / stiffness, delta=1e-9)
        self.assertEqual(k.get(), 100.)
        k.set(50)
        self.assertEqual(k.get(), 50.)
        with self.assertRaisesRegex(h.Error, "there is no parameter wheel"):
            scene.set(wheel=1)

    def test_parameters_in_moments_of_inertia(self):
        """A bar of another length and mass is what it is when described with these numbers"""
        def spin(scene, length, mass, **values):
            bars = [h.RigidBody(mass=mass, inertia=h.inertia.about(h.inertia.box(mass, (length, 0.1, 0.2)), 0, (0, 0, 0)), position=(length / 2, 0, 0)),
                    h.RigidBody(mass=2 * mass, inertia=h.inertia.ellipsoid(2 * mass, (0.1, length, 0.1)), position=(length, 0, 0))]
            bar = scene.add("bar", h.composed(bars))
            scene.connect("pin", h.Revolute, bar, scene.ground, (0, 0, 0))
            scene.connect("handle", h.Spherical, scene.add("rod", h.RigidBody(mass, h.inertia.rod(mass, length) + np.diag([0, 0, 1e-3]), position=(length, 0, 0))), bar, (length, 0, 0))
            scene.channel("spin", h.angular_velocity(bar.marker(), "z"))
            return scene, scene.solve(0.7, tolerance=1e-5, **values)["spin"][-1]

        scene = h.Scene(gravity=(0, -9.81, 0))
        L, m = scene.parameter("L", 1.), scene.parameter("m", 2.)
        scene, first = spin(scene, L, m)
        self.assertEqual(first, spin(h.Scene(gravity=(0, -9.81, 0)), 1., 2.)[1])
        scene.set(L=0.4, m=5)
        other = scene.solve(0.7, tolerance=1e-5)["spin"][-1]
        self.assertEqual(other, spin(h.Scene(gravity=(0, -9.81, 0)), 0.4, 5.)[1])
        self.assertGreater(abs(other - first), 1)

    def test_states_variables_and_callbacks(self):
        """x' = -3 x with a variable y = x^2, and a force that pulls a mass by a Python function as by a formula"""
        finals = []
        for force in (lambda u, v: -20 * h.sin(u) - v, lambda u, v: h.callback(lambda a, b: -20 * math.sin(a) - b, u, v)):
            scene = h.Scene()
            x = scene.state("x", lambda own: -3 * own, 2.)
            y = scene.variable("y", h.value(x)**2)
            b = scene.add("b", h.PointMass(position=(0.5, 0, 0)))
            m = b.marker()
            scene.add("pull", h.UserForce(m, force=[force(h.displacement(m, 0), h.velocity(m, 0)), 0, 0]))
            scene.channel("y", h.value(y))
            scene.channel("x", h.displacement(m, 0))
            run = scene.solve(1., tolerance=1e-8)
            self.assertAlmostEqual(run["y"][-1], 4 * math.exp(-6), delta=1e-6)
            finals.append((run["x"][-1], run.steps))
        self.assertAlmostEqual(finals[0][0], finals[1][0], delta=1e-8)
        self.assertEqual(finals[0][1], finals[1][1])

    def test_equilibrium_beside_integrals(self):
        """A state that nothing reads keeps its value; an integral in a feedback loop takes the one that brings the deviation to zero; a clock in one never rests"""
        def hung(rate, reads):
            scene = h.Scene(gravity=(0, 0, -9.81))
            m = scene.add("b", h.PointMass(mass=2, position=(0, 0, 0.5))).marker()
            z = h.displacement(m, "z")
            x = scene.state("x", rate(z), 0.25)
            scene.add("spring", h.UserForce(m, force=[-400 * h.displacement(m, "x"), -400 * h.displacement(m, "y"), -400 * z + (h.value(x) if reads else 0)]))
            now = scene.run().equilibrium().snapshot()
            return now.value(z), now.value(h.value(x))
        np.testing.assert_allclose(hung(lambda z: z * z, False), [-2 * 9.81 / 400, 0.25], atol=1e-8)
        np.testing.assert_allclose(hung(lambda z: 0 * z + 1, False), [-2 * 9.81 / 400, 0.25], atol=1e-8)
        np.testing.assert_allclose(hung(lambda z: 10 * (0.1 - z), True), [0.1, 40 + 2 * 9.81], rtol=1e-6)
        with self.assertRaisesRegex(h.Error, "stop what never rests"):
            hung(lambda z: 0 * z + 1, True)

    def test_states_of_one_another(self):
        """An observer of a mass on a spring, which sees its displacement alone and knows nothing of where it began"""
        scene = h.Scene()
        m = scene.add("b", h.PointMass(position=(0.5, 0, 0))).marker()
        scene.add("spring", h.UserForce(m, force=[-4 * h.displacement(m, 0), 0, 0]))
        x, v = scene.states(["x", "v"], lambda z: [z[1] + 6 * (h.displacement(m, 0) - z[0]), -4 * z[0] + 5 * (h.displacement(m, 0) - z[0])], [0, 0])
        for name, value in (("x", x), ("v", v)):
            scene.channel(name, h.value(value))
        run = scene.solve(3., tolerance=1e-8)
        # errors e' = (A - L C) e with eigenvalues -3, -3: e = (0.5 - 1.5 t, ...) exp(-3 t), as e(0) = (0.5, 0) and e_x' = e_v - 6 e_x
        self.assertAlmostEqual(0.5 * math.cos(6) - run["x"][-1], (0.5 - 1.5 * 3) * math.exp(-9), delta=1e-5)
        self.assertAlmostEqual(-math.sin(6) - run["v"][-1], -4.5 * 3 * math.exp(-9), delta=1e-4)
        with self.assertRaisesRegex(ValueError, "2 names, 1 rates, 2 initial values"):
            h.Scene().states(["a", "b"], lambda z: [z[0]], [0, 0])

    def test_states_beside_motions_of_accelerations(self):
        """Their speeds are states, too: what a rate is given is its own state, and none is described twice"""
        for parameters in (False, True):
            scene = h.Scene()
            p = scene.parameter("p", 1.) if parameters else None
            wheel = scene.rigid_body("wheel", mass=1)
            i, j = wheel.marker(), scene.ground.marker()
            scene.add("bearing", h.Revolute(i, j))
            scene.add("drive", h.RotationalMotion(i, j, lambda t: 0 * t + 1, of="acceleration"))
            scene.channel("x", h.value(scene.state("x", lambda x: -x, 1.)))
            for value in (1., 2.) if parameters else (1.,):
                if parameters:
                    p.set(value)
                run = scene.run(tolerance=1e-7, sample=.5).solve(1)
                self.assertAlmostEqual(run["x"][-1], math.exp(-1), delta=1e-4)

    def test_states_after_a_motion_that_was_refused(self):
        """It has no state, so that the next one is the first"""
        scene = h.Scene()
        wheel = scene.rigid_body("wheel", mass=1)
        with self.assertRaises(TypeError):
            scene.add("drive", h.RotationalMotion(wheel, scene.ground, lambda t: 0 * t + 1, of="acceleration"))
        x, y = scene.states(["x", "y"], lambda z: [-z[0], 0 * z[1]], [1., 3.])
        scene.channel("x", h.value(x))
        scene.channel("z", h.value(scene.state("z", lambda z: -2 * z, 1.)))
        run = scene.solve(1., tolerance=1e-7)
        self.assertAlmostEqual(run["x"][-1], math.exp(-1), delta=1e-4)
        self.assertAlmostEqual(run["z"][-1], math.exp(-2), delta=1e-4)

    def test_channel_of_many_measures(self):
        """A channel needs no derivatives, and so may have more measures than there is room for derivatives"""
        scene = h.Scene()
        markers = [scene.add("b%d" % k, h.PointMass(position=(k, 0, 0), velocity=(1, 0, 0))).marker() for k in range(40)]
        scene.channel("sum", sum(h.displacement(m, 0) for m in markers))
        self.assertAlmostEqual(scene.solve(0.1)["sum"][-1], 780 + 4., delta=1e-9)

    def test_options_and_output(self):
        scene, rod, pin = pendulum()
        scene.channel("angle", h.angle(rod.marker(), scene.ground.marker()), "rad")
        run = scene.run(options={"ts_adapt_type": "none", "ts_dt": 0.01}).solve(0.2)
        self.assertEqual(run.steps, 20)
        self.assertEqual(run.ts.getType(), "hhtdae")
        self.assertTrue(run.ts.getSNES().getKSP().getPC().getType())
        steps = []
        with scene.run() as run, tempfile.TemporaryDirectory() as folder:
            run.on_step(lambda r: steps.append(r.time))
            scene.output(csv=os.path.join(folder, "x.csv"), dt=0.05)
            run.solve(0.2)
            scene.output(csv="")
            table = np.loadtxt(os.path.join(folder, "x.csv"), delimiter=",", skiprows=1)
            np.testing.assert_allclose(table[:, 0], [0, 0.05, 0.1, 0.15, 0.2], atol=1e-12)
            self.assertAlmostEqual(table[-1, 1], run["angle"][-1], delta=1e-9)
            self.assertEqual(len(steps), run.steps)
        self.assertEqual(repr(run), "<closed run>")
        with self.assertRaisesRegex(ValueError, "closed"):
            run.solve(1.)
        with self.assertRaisesRegex(TypeError, "there are file, csv"):
            scene.output(table="x")
        with self.assertRaisesRegex(ValueError, "page_frames"):
            scene.output(page_frames=0)
        with self.assertRaisesRegex(ValueError, "must be one of report"):
            scene.start(assembly="maybe")

    def test_what_is_refused_changes_nothing(self):
        scene, rod, pin = pendulum()
        for call, error, words in ((lambda: scene.output(page_frames=-3), ValueError, "page_frames"),
                                   (lambda: scene.output(csv=3), TypeError, r"output\(\): csv is 3, must be a string"),
                                   (lambda: scene.output(balance=2), TypeError, "balance is 2"),
                                   (lambda: scene.output(dt=-1.), ValueError, r"output\(\): dt is -1"),
                                   (lambda: scene.output(page_nodes=1.5), TypeError, "page_nodes is 1.5, must be a whole number"),
                                   (lambda: scene.start(tolerance="a"), TypeError, r"start\(\): tolerance is 'a'"),
                                   (lambda: scene.start(tolerance=-1.), ValueError, r"start\(\): tolerance is -1"),
                                   (lambda: scene.start(time=None), TypeError, "time is None"),
                                   (lambda: scene.start(view="yes"), TypeError, "view is 'yes', must be True or False"),
                                   (lambda: scene.start(tolerance=1e-3, assembly="maybe"), ValueError, "assembly is 'maybe'")):
            before = dict(scene._start), dict(scene._output)
            with self.assertRaisesRegex(error, words):
                call()
            self.assertEqual((scene._start, scene._output), before)
        for balance, kept in ((np.bool_(True), True), (np.bool_(False), False), (pathlib.Path("b.csv"), "b.csv")):
            scene.output(balance=balance)
            self.assertIs(type(scene._output["balance"]), type(kept))
            self.assertEqual(scene._output["balance"], kept)
        scene.output(dt=0.1, balance=False)
        scene.start(view=False, time=-1.)
        self.assertEqual(scene.solve(-0.9).time, -0.9)

    def test_two_writers_of_one_file(self):
        """Neither two runs, one of which goes on later, nor two kinds of results"""
        scene, rod, pin = pendulum()
        scene.channel("y", h.displacement(rod.marker(), 1), "m")
        with tempfile.TemporaryDirectory() as folder:
            scene.output(csv=os.path.join(folder, "a.csv"))
            first = scene.solve(0.1)
            second = scene.run().solve(0.15)
            second.solve(0.2)
            with self.assertRaisesRegex(h.Error, "a.csv has .* bytes.*another run"):
                first.solve(0.2)
            scene.output(balance=os.path.join(folder, "a.csv"))
            with self.assertRaisesRegex(h.Error, "a.csv has .* bytes.*another output"):
                run = scene.solve(0.1)
                run.solve(0.2)

    def test_page(self):
        """A page with its frames, where the library has pages"""
        scene = h.Scene(gravity=(0, 0, -1))
        scene.add("falling", h.PointMass())
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "page.html")
            scene.output(page=file, page_title="a fall", page_frames=10)
            try:
                scene.solve(1.)
            except h.Error as error:
                self.assertIn("built without", str(error))
                self.skipTest("the library was built without pages")
            with open(file) as page:
                text = page.read()
        self.assertIn('"title":"a fall"', text)
        self.assertEqual(text.count('data-kind="frames">'), 1)


class Questions(unittest.TestCase):
    def test_element_moment(self):
        """A rod held fast bears its weight: channel, snapshot, and the moment that a lever makes of it; on a body that the element does not act on it is an error"""
        scene = h.Scene(gravity=(0, -10., 0))
        rod, other = scene.add("rod", h.RigidBody(mass=2., position=(0.5, 0, 0))), scene.add("other", h.RigidBody())
        root, far = rod.marker((-0.5, 0, 0)), other.marker()
        clamp = scene.add("clamp", h.Fixed(root, scene.ground.marker()))
        scene.channel("moment", h.element_moment(clamp, root, "z"))
        run = scene.solve(0.1)
        np.testing.assert_allclose(run["moment"], 10., rtol=1e-9)
        now = run.snapshot()
        self.assertAlmostEqual(now.load(clamp, root).moment[2], 10., delta=1e-9)
        self.assertAlmostEqual(now.value(h.element_moment(clamp, root, 2)), 10., delta=1e-9)
        np.testing.assert_array_equal(now.load(clamp, far).moment, 0)
        with self.assertRaisesRegex(h.Error, "clamp does not act on other"):
            now.value(h.element_moment(clamp, far, 2))

    def test_snapshot(self):
        """A rod that swings: accelerations, reactions by Newton's law, energies, formulas, angles"""
        scene, rod, pin = pendulum()
        tip, foot = rod.marker((0.5, 0, 0), name="tip"), scene.ground.marker()
        run = scene.solve(0.7, tolerance=1e-8)
        with run.snapshot(0.7 - 0.4 * run.ts.getTimeStep()) as now:
            self.assertLess(now.time, 0.7)
            x, c = now.motion(tip), now.motion(rod)
            w = x.angular_velocity[2]
            np.testing.assert_allclose(x.velocity, np.cross(x.angular_velocity, x.position), atol=2e-5)
            np.testing.assert_allclose(x.acceleration, np.cross(x.angular_acceleration, x.position) - w * w * x.position, atol=1e-5)
            np.testing.assert_allclose(now.load(pin, tip).force, 2. * (c.acceleration + [0, 9.81, 0]), atol=1e-6)
            kinetic, potential = now.energy()
            self.assertAlmostEqual(kinetic, 0.5 * (2. * c.velocity @ c.velocity + h.inertia.box(2., (1, .1, .1))[2, 2] * w * w), delta=1e-9)
            self.assertAlmostEqual(now.value(h.displacement(tip, 0)**2 + h.displacement(tip, 1)**2), 1., delta=1e-8)
            self.assertAlmostEqual(now.value(h.kinetic_energy()), kinetic)
            angle = now.value(h.angle(tip, foot))
            np.testing.assert_allclose(x.axes, h.rotation((0, 0, 1), angle), atol=1e-9)
            np.testing.assert_allclose(x.bryant(), [0, 0, angle], atol=1e-9)
            np.testing.assert_allclose(h.rotation((0, 0, 1), x.euler()[0]), x.axes, atol=1e-9)
            relative = now.relative_motion(foot, tip)
            np.testing.assert_allclose(relative.position, [-1, 0, 0], atol=1e-9)
            np.testing.assert_allclose(now.motion(foot, axes=tip).axes, x.axes.T, atol=1e-9)
        with self.assertRaisesRegex(ValueError, "closed"):
            now.energy()

    def test_kinematics_and_equilibrium(self):
        """A rod that a motion turns: the torque of inverse dynamics; a rod on a torsional spring: its angle at rest"""
        scene, rod, pin = pendulum()
        i, j = rod.marker((-0.5, 0, 0)), scene.ground.marker()
        drive = scene.add("drive", h.RotationalMotion(i, j, lambda t: 0.5 * t**2))
        scene.start(assembly="project")
        run = scene.run().kinematics(1.)
        now = run.snapshot()
        J = h.inertia.box(2., (1, .1, .1))[2, 2] + 2 * 0.25
        self.assertAlmostEqual(now.load(drive, i).moment[2], J * 1. + 2 * 9.81 * 0.5 * math.cos(0.5), delta=1e-6)
        self.assertAlmostEqual(now.motion(i).angular_velocity[2], 1., delta=1e-9)
        scene, rod, pin = pendulum()
        scene.add("spring", h.TorsionalSpringDamper(rod.marker(), scene.ground.marker(), stiffness=30.))
        now = scene.run().equilibrium().snapshot()
        axes = now.motion(rod).axes
        p = math.atan2(axes[1, 0], axes[0, 0])
        self.assertAlmostEqual(-30. * p, 2 * 9.81 * 0.5 * math.cos(p), delta=1e-8)

    def test_inconsistent_start(self):
        """The message says what to call; with it analyses find the velocities that the motion asks for"""
        scene, rod, pin = pendulum()
        i = rod.marker((-0.5, 0, 0))
        scene.add("drive", h.RotationalMotion(i, scene.ground.marker(), lambda t: 3 * t))
        with self.assertRaisesRegex(h.Error, r"drive: velocities violate it by 3(.|\n)*scene\.start\(assembly=\"project\"\)"):
            scene.run()
        scene.start(assembly="project")
        for analysis in (h.Run.kinematics, h.Run.assemble):
            self.assertAlmostEqual(analysis(scene.run()).snapshot().motion(i).angular_velocity[2], 3., delta=1e-6)

    def test_linearization_at_rest(self):
        """Static equilibrium under a motion that moves: velocities are those of rest, linearize() says so; assemble() gives the others"""
        for motion, moves in ((lambda t: 5 * t, True), (lambda t: 5 * t**2, False)):
            scene = h.Scene(gravity=(0, -9.81, 0))
            rotor = scene.add("rotor", h.RigidBody(1, np.eye(3), angular_velocity=(0, 0, 5. * moves)))
            scene.add("bearing", h.Bushing(rotor.marker(), scene.ground.marker(), stiffness=(1e4,) * 3, torsional_stiffness=(1e4, 1e4, 0)))
            scene.add("drive", h.RotationalMotion(rotor.marker(), scene.ground.marker(), motion))
            run = scene.run().equilibrium()
            with warnings.catch_warnings(record=True) as told:
                warnings.simplefilter("always")
                run.linearize()
                self.assertEqual(len(told), moves)
                run.assemble().linearize()
            self.assertEqual(len(told), moves)
            self.assertAlmostEqual(run.snapshot().motion(rotor).angular_velocity[2], 5. * moves)
            self.assertAlmostEqual(run.snapshot().motion(rotor).position[1], -9.81e-4)
            for warning in told:
                self.assertRegex(str(warning.message), r"at rest at t = 0, although motions move them.*Run.assemble\(\)")

    def test_response_beside_a_free_motion(self):
        """A shaft that nothing keeps from turning: a force across it has a response at 0 rad/s, a torque has none"""
        scene = h.Scene()
        shaft = scene.add("shaft", h.RigidBody(2., np.diag([.2, .2, .1]), angular_velocity=(0, 0, 30.)))
        scene.add("bearing", h.Bushing(shaft.marker(), scene.ground.marker(), stiffness=(1e5, 1e5, 1e5), torsional_stiffness=(1e4, 1e4, 0), damping=(10, 10, 10)))
        m, small = shaft.marker(), scene.run().linearize()
        x = small.response(h.Excitation.force(m, (1, 0, 0)), h.displacement(m, "x"), [0., 100., 0.])
        np.testing.assert_allclose(x, [1e-5, 1 / (1e5 - 2e4 + 1000j), 1e-5], rtol=1e-9)
        with self.assertRaisesRegex(h.Error, "no solution at 0. rad/s .*nothing holds is pushed"):
            small.response(h.Excitation.torque(m, (0, 0, 1)), h.displacement(m, "x"), [0.])

    def test_linearization(self):
        """A mass on a damped spring: mode, frequency response, minimal coordinates, operators"""
        scene = h.Scene()
        b = scene.add("b", h.RigidBody(mass=2.))
        m, g = b.marker(), scene.ground.marker()
        scene.add("guide", h.Translational(m, g))
        k, c = 50., 3.
        top = scene.ground.marker((0, 0, 1))
        scene.add("spring", h.SpringDamper(m, top, stiffness=k, damping=c))
        small = scene.run().linearize()
        modes = small.modes()
        self.assertEqual(len(modes), 1)
        with tempfile.TemporaryDirectory() as folder:
            small.animate(modes[0], os.path.join(folder, "mode"), 0.1, frames=5)
            with open(os.path.join(folder, "mode.pvd")) as text:
                frames = [line.split('file="')[1].split('"')[0] for line in text if "file=" in line]
            self.assertEqual(len(frames), 5)
            self.assertTrue(all(os.path.exists(os.path.join(folder, name)) for name in frames))
        self.assertAlmostEqual(modes[0].frequency, math.sqrt(k / 2) / (2 * math.pi), delta=1e-9)
        self.assertAlmostEqual(modes[0].damping_ratio, c / (2 * math.sqrt(2 * k)), delta=1e-9)
        self.assertIn("Hz", repr(modes[0]))
        part = small.part(modes[0], b)
        self.assertAlmostEqual(abs(part.displacement[2]), 1., delta=1e-9)
        self.assertAlmostEqual(part.share, 1., delta=1e-9)
        self.assertAlmostEqual(abs(small.value(modes[0], h.displacement(m, 2))), 1., delta=1e-9)
        w = np.array([1., 5., 20.])
        push = h.Excitation.force(m, (0, 0, 1))
        with self.assertRaisesRegex(TypeError, "is no Excitation"):
            small.response([push], h.displacement(m, 2), w)
        np.testing.assert_allclose(small.response(h.Excitation.ground_acceleration((0, 0, 1)), h.displacement(m, 2), w), -2 / (k - 2 * w**2 + 1j * w * c), rtol=1e-8)
        np.testing.assert_allclose(small.response(push, h.displacement(m, 2), w), 1 / (k - 2 * w**2 + 1j * w * c), rtol=1e-9)
        A, B, C, D = small.state_space([push], [h.displacement(m, 2)])
        self.assertEqual((A.shape, B.shape, C.shape, D.shape), ((2, 2), (2, 1), (1, 2), (1, 1)))
        for x in w:
            H = (C @ np.linalg.solve(1j * x * np.eye(2) - A, B) + D)[0, 0]
            self.assertAlmostEqual(H, 1 / (k - 2 * x**2 + 1j * x * c), delta=1e-9)
        M, _, K = small.operators()
        self.assertEqual(M.getSize(), K.getSize())
        small.close()
        self.assertGreater(K.norm(), 1.)  # a copy, which stays


class Mistakes(unittest.TestCase):
    def test_all_parameters_or_none(self):
        scene = h.Scene()
        a, b = scene.parameter("a", 1.), scene.parameter("b", 2.)
        for wrong in (dict(a=10., c=1.), dict(a=20., b="x"), dict(a=30., b=None)):
            with self.assertRaises((h.Error, TypeError, ValueError)):
                scene.set(**wrong)
            self.assertEqual((a.get(), b.get()), (1., 2.))

    def test_times_of_a_run_that_has_not_begun(self):
        scene = h.Scene()
        scene.add("ball", h.PointMass())
        run = scene.run()
        run.snapshot(0.)
        for what in (run.snapshot, run.linearize, run.sample):
            with self.assertRaisesRegex(h.Error, "has not begun"):
                what(5.)

    def test_numbers_are_no_flags(self):
        """As the third argument of a term, which is whether it is an angle, and not its factor"""
        scene = h.Scene(planar=True)
        a, b = scene.rigid_body("a", inertia=(0, 0, 1.)), scene.rigid_body("b", inertia=(0, 0, 1.))
        with self.assertRaisesRegex(TypeError, "rotation must be True or False, not 1.0"):
            scene.add("c", h.Coupler([h.Term(a.marker(), scene.ground.marker(), 1.), h.Term(b.marker(), scene.ground.marker(), -3.)]))
        with self.assertRaisesRegex(TypeError, "planar must be True or False"):
            h.Scene(planar=3.)
        scene.add("c", h.Coupler([h.Term(a.marker(), scene.ground.marker(), np.bool_(True)), h.Term(b.marker(), scene.ground.marker(), factor=-3.)]))

    def test_directions_of_no_length(self):
        with self.assertRaisesRegex(ValueError, "axes_along"):
            h.axes_along((0, 0, 0))
        with self.assertRaisesRegex(ValueError, "rotation"):
            h.rotation((0, 0, 0), 1.)

    def test_what_counts_turns_cannot_come_in_a_run(self):
        scene = h.Scene(planar=True)
        lock = scene.parameter("lock", 1.)
        a, b = scene.rigid_body("a", inertia=(0, 0, 2.), angular_velocity=(0, 0, 1.)), scene.rigid_body("b", inertia=(0, 0, 1.))
        g, ma, mb = scene.ground.marker(), a.marker(), b.marker()
        scene.add("ra", h.Revolute(ma, g))
        scene.add("rb", h.Revolute(mb, g))
        scene.add("clutch", lambda: h.Coupler([h.Term(ma, g), h.Term(mb, g, factor=-1.)]) if lock.get() else None)
        scene.set(lock=0.)
        run = scene.run(tolerance=1e-6).solve(1.)
        scene.set(lock=1.)
        scene.start(assembly="project")
        with self.assertRaisesRegex(Exception, "clutch"):
            scene.run(after=run).solve(2.)

    def test_all_that_is_wrong_is_told(self):
        scene = h.Scene()
        b = scene.add("beam", h.RigidBody(mass=-1., inertia=(1, 1, 5)))
        scene.add("loop", h.Revolute(b.marker(), b.marker()))
        with self.assertRaises(h.Error) as caught:
            scene.run()
        text = str(caught.exception)
        for word in ("body beam: mass is -1", "principal moments", "loop"):
            self.assertIn(word, text)
        self.assertTrue(caught.exception.trace)
        self.assertGreater(caught.exception.ierr, 0)

    def test_runs_that_cannot_be(self):
        scene, rod, pin = pendulum()
        centre = rod.marker()
        scene.channel("x", h.displacement(centre, 0))
        run = scene.run(tolerance=1e-6, options={"ts_max_steps": 3})
        self.assertEqual((run.values.shape, len(run["x"]), run.solve(0.).time), ((0, 1), 0, 0.))
        with self.assertWarnsRegex(RuntimeWarning, "largest number of steps"):
            run.solve(5.)
        self.assertEqual(run.steps, 3)
        fresh = scene.run()
        self.assertAlmostEqual(fresh.sample()["x"], fresh.snapshot().value(h.displacement(centre, 0)))
        with self.assertRaisesRegex(h.Error, "has not begun"):
            fresh.sample(1.)
        with self.assertRaisesRegex(ValueError, "tolerance is -1"):
            scene.run(tolerance=-1)
        with self.assertRaisesRegex(h.Error, "no such file"):
            scene.run().load("no such file").solve(1.)
        with self.assertRaisesRegex(TypeError, "must be one of hhtdae.flexible"):
            h.Scene().add("f", h.FlexibleBody(None))

    def test_a_run_that_fails(self):
        """A force that becomes infinite: the library's message, and what was recorded until then"""
        scene = h.Scene()
        m = scene.add("b", h.PointMass(position=(1, 0, 0), velocity=(2, 0, 0))).marker()
        x = h.displacement(m, 0)
        scene.add("f", h.UserForce(m, force=[6 * x**2, 0, 0]))  # x = 1/(1 - t)^2
        scene.channel("x", x)
        run = scene.run(tolerance=1e-5)
        with self.assertRaisesRegex(h.Error, "No step from t = .* succeeded"):
            run.solve(2.)
        self.assertLess(run.time, 1.01)
        self.assertGreater(run["x"][-1], 1e3)
        run = scene.run(tolerance=1e-5, options={"ts_error_if_step_fails": 0})
        with self.assertWarnsRegex(RuntimeWarning, "the run has failed at t = "):
            run.solve(2.)

    def test_foreign_handles(self):
        one, other = h.Scene(), h.Scene()
        a, b = one.add("a", h.PointMass()), other.add("b", h.PointMass())
        one.add("spring", h.SpringDamper(a.marker(), b.marker(), stiffness=1.))
        with self.assertRaisesRegex(h.Error, "not a marker of this scene"):
            one.run()

    def test_handles_of_another_kind(self):
        scene, rod, pin = pendulum()
        i, j = rod.marker(), scene.ground.marker()
        x = scene.state("x", 1., 0.)
        for call, text in ((lambda: scene.add("s", h.SpringDamper(rod, j)), "i must be a scene's marker, is <Body rod>"),
                           (lambda: scene.add("s", h.JointFriction(i, 0.1)), "joint must be a scene's element, is <Marker on rod>"),
                           (lambda: scene.channel("c", h.displacement(rod, 0)), "marker i must be a scene's marker"),
                           (lambda: h.joint_force(rod, 0), "<Body rod> is no element of a scene"),
                           (lambda: h.value(i), "is no variable and no state"), (lambda: h.modal(i, 0), "is no body"),
                           (lambda: scene.line(rod), "must be a scene's marker")):
            with self.assertRaisesRegex(TypeError, text):
                call()
        scene.channel("c", h.value(x))
        now = scene.solve(0.1).snapshot()
        with self.assertRaisesRegex(TypeError, "element must be a scene's element"):
            now.load(rod, i)
        with self.assertRaisesRegex(ValueError, "time between samples"):
            scene.run(sample=-1)

    def test_things_of_another_kind(self):
        """What is asked for is told where a text, a function or a single thing is given in place of it"""
        scene, rod, pin = pendulum()
        m, w = rod.marker(), h.displacement(rod.marker(), "x")
        push, count = h.Excitation.force(m, (1, 0, 0)), scene._elements
        small = scene.run().linearize()
        other, b, _ = pendulum()
        for call, error, words in ((lambda: b.shape("box"), TypeError, r"a shape of rod is 'box', must be Shape.box"),
                                   (lambda: other.connect("q", h.Revolute, b, other.ground, (0, 0, 0), axis="z"), ValueError, r"connect\(\): axis must be a direction, .*not 'z'"),
                                   (lambda: other.add("q", h.UserForce(b.marker(), force=lambda t: [t, 0, 0])), TypeError, "UserForce q: force: must be a list of formulas, .*function"),
                                   (lambda: other.add("q", h.UserForce(b.marker(), moment=h.time())), TypeError, "UserForce q: moment: must be a list of formulas"),
                                   (lambda: small.state_space(push, [w]), TypeError, "inputs is Excitation.*must be a list"),
                                   (lambda: small.state_space([push], w), TypeError, "outputs is .*must be a list"),
                                   (lambda: small.modes(1.5), TypeError, "count is 1.5, must be a whole number"),
                                   (lambda: small.modes(2, "a"), TypeError, "shift is 'a', must be a number"),
                                   (lambda: small.modes(3), h.Error, "the scene has 1 degree of freedom")):
            with self.assertRaisesRegex(error, words):
                call()
        self.assertEqual(other._elements, count)

    def test_words_of_python(self):
        """Names in messages are those of Python; options are told whose values are none; a channel without a name has one"""
        scene, rod, pin = pendulum()
        with self.assertRaisesRegex(TypeError, "channel q: 'x' is no number and no formula"):
            scene.channel("q", "x")
        with self.assertRaisesRegex(h.Error, "option -ts_hhtdae_alpha: Input string abc has no numeric value"):
            scene.run(options={"ts_hhtdae_alpha": "abc"})
        with self.assertRaisesRegex(TypeError, "a Universal needs z axes that are perpendicular"):
            scene.connect("u", h.Universal, rod, scene.ground, (0, 0, 0))
        scene, rod, pin = pendulum()
        scene.channel("t", h.time())
        scene.channel("", h.time())
        with tempfile.TemporaryDirectory() as folder:
            scene.output(csv=os.path.join(folder, "run.csv"), dt=0.1)
            self.assertEqual(list(scene.solve(0.1).channels), ["time", "t", "channel 1"])
            with open(os.path.join(folder, "run.csv")) as table:
                self.assertIn("channel 1", table.readline())
        scene, rod, pin = pendulum()
        scene.add("u", h.Universal(rod.marker((-0.5, 0, 0)), scene.ground.marker()))
        with self.assertRaisesRegex(h.Error, "universal u: not met by 1: z of marker i has to be perpendicular to z of marker j, and is parallel to it"):
            scene.run()

    def test_markers_that_cannot_be(self):
        """The error names the body, and which condition is not met"""
        for position, axes, words in (((0, np.nan, 0), None, r"position is \(0, nan, 0\), must be finite"), ((0, 0, 0), 3 * np.eye(3), r"axes are not orthonormal: the columns' lengths are \(3, 3, 3\)"),
                                      ((0, 0, 0), np.diag([1, 1, -1]), "axes are left-handed"), ((0, 0, 0), np.full((3, 3), np.inf), "axes are not finite")):
            scene, rod, pin = pendulum()
            rod.marker(position, axes)
            with self.assertRaisesRegex(h.Error, "marker 2 on rod: its " + words):
                scene.set_up()

    def test_exceptions_of_callbacks(self):
        scene = h.Scene()
        b = scene.add("b", h.PointMass())
        m = b.marker()

        def law(x):
            raise LookupError("no such table")
        scene.add("pull", h.UserForce(m, force=[h.callback(law, h.displacement(m, 0)), 0, 0]))
        with self.assertRaisesRegex(h.Error, "pull.*LookupError: no such table") as caught:
            scene.solve(1.)
        self.assertIsInstance(caught.exception.__cause__, LookupError)

    def test_exceptions_of_functions_between_runs(self):
        """They come as they are where Python asks for a value, and are the cause of nothing that follows"""
        scene = h.Scene()
        m = scene.add("b", h.PointMass()).marker()
        now = scene.run().snapshot()

        def law(x):
            raise LookupError("no such table")
        table = _core.TimeFunction.values(law)
        tape = compile_tape([h.callback(law, Expression("argument", (), 0))], {}, keep := [], 1)
        for call in (lambda: now.value(2 * h.callback(law, h.displacement(m, 0))), lambda: table(1.), lambda: tape(np.zeros(1)), lambda: tape.differentiate(np.zeros(1))):
            with self.assertRaisesRegex(LookupError, "no such table"):
                call()
            with self.assertRaises(h.Error) as caught:
                scene.set(nothing=1)
            self.assertIsNone(caught.exception.__cause__)

    def test_exceptions_of_monitors_and_interrupts(self):
        scene, rod, pin = pendulum()
        run = scene.run()
        run.on_step(lambda r: 1 / 0)
        with self.assertRaises(ZeroDivisionError):
            run.solve(1.)
        import signal
        import threading

        run = scene.run(options={"ts_adapt_type": "none", "ts_dt": 1e-6})
        threading.Timer(0.2, lambda: signal.raise_signal(signal.SIGINT)).start()
        with self.assertRaises(KeyboardInterrupt):
            run.solve(1e3)


class Controllers(unittest.TestCase):
    def test_held_between_samples(self):
        """A force that is set every 0.1 s; between the samples the motion is known exactly"""
        scene = h.Scene()
        u = scene.parameter("u", -10.)
        m = scene.add("b", h.PointMass(position=(1, 0, 0))).marker()
        scene.add("f", h.UserForce(m, force=(u, 0, 0)))
        x, v, hold, worst = 1., 0., -10., 0.
        run = scene.run(tolerance=1e-4)
        for t in run.step_by(0.1, 3.):
            x, v = x + 0.1 * v + 0.005 * hold, v + 0.1 * hold
            now = run.snapshot()
            worst = max(worst, abs(now.value(h.displacement(m, "x")) - x))
            hold = -10 * x - 2 * v
            u.set(hold)
        self.assertLess(worst, 1e-12)


if __name__ == "__main__":
    unittest.main()
