"""Runs of one scene that begin in different ways: each is what it would be alone; derivatives by parameters; states that are not steady; descriptions that are interrupted."""

import unittest
import unittest.mock
import warnings

import numpy as np

import hhtdae as h


def arm(described=None):
    """A pendulum in millimetres, which the tolerance of angles makes slow"""
    scene = h.Scene(gravity=(0, 0, -9810.))
    rod = scene.add("rod", h.RigidBody(1e-3, [1., 1, 1], position=(500, 0, 0), rotation=h.rotation((0, 0, 1), 0.1)))
    scene.connect("pin", h.Revolute, rod, scene.ground, (0, 0, 0), axis=(0, 1, 0))
    i, j = rod.marker(), scene.ground.marker((0, 0, -2000.))
    spring = h.SpringDamper(i, j, stiffness=1e-6)
    scene.add("spring", spring if described is None else lambda: described.append(0) or spring)
    scene.channel("z", h.displacement(i, "z"))
    return scene


def solve(scene, options=None):
    return scene.solve(0.5, tolerance=1e-2, options=options)


class Starts(unittest.TestCase):
    def test_options(self):
        """Those of the set-up hold for the runs that they are given to, and the scene is set up again for no other reason"""
        described = []
        scene = arm(described)
        alone, others = solve(scene), 0
        count = len(described)
        for options, what in (({"scene_equilibrium": True}, lambda r: r["z"][-1]), ({"scene_angle_tol": 1e-6}, lambda r: r.steps), ({"scene_start_time": 0.2}, lambda r: r.times[0]),
                              ({"scene_rotations": "euler313"}, lambda r: r.ts.getSolution2()[0].array[4])):
            expected = what(solve(arm(), options))
            self.assertNotEqual(expected, what(alone))
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # that nobody has asked for an option
                for _ in range(2):
                    self.assertEqual(what(solve(scene, options)), expected)
                for _ in range(2):
                    np.testing.assert_array_equal(solve(scene).values, alone.values)
            others += 2
            self.assertEqual(len(described), count + others)

    def test_options_of_a_run_that_goes_on(self):
        scene = arm()
        run, other = (scene.run(tolerance=1e-4, options=o).solve(0.25) for o in (None, {"scene_rotations": "euler313"}))
        for before in (run, other):
            for options in (None, {"scene_rotations": "euler313"}, {"scene_angle_tol": 1e-6, "scene_equilibrium": True}):
                after = scene.run(tolerance=1e-4, after=before, options=options)
                self.assertEqual(after.time, 0.25)
                self.assertAlmostEqual(after.sample()["z"], before["z"][-1], delta=1e-5)
                self.assertAlmostEqual(after.solve(0.5)["z"][-1], arm().solve(0.5, tolerance=1e-4)["z"][-1], delta=1.)

    def test_start(self):
        """It holds for runs that are made from then on: the study of a tolerance needs one scene"""
        scene, runs = arm(), []
        for tolerance in (0., 1e-6, 0.):
            scene.start(angle_tol=tolerance)
            runs.append(scene.run(tolerance=1e-2))
        scene.start(time=3., assembly="project")
        self.assertEqual(scene.run().time, 3.)
        steps = [r.solve(0.5).steps for r in runs]
        self.assertEqual(steps[0], steps[2])
        self.assertGreater(steps[1], 3 * steps[0])
        scene.start(time=0., equilibrium=True)
        self.assertAlmostEqual(solve(scene)["z"][-1], -500., delta=1e-3)
        scene.start(equilibrium=False)
        np.testing.assert_array_equal(solve(scene).values, runs[0].values)


class Derivatives(unittest.TestCase):
    """By a parameter, as differences of results of runs: src/python/README.md"""

    def test_differences(self):
        scene, last = h.Scene(gravity=(0, 0, -9.81)), None
        k = scene.parameter("k", 100.)
        for n in range(2):
            last, before = scene.add("rod %d" % n, h.RigidBody(1., np.diag([0.1, 0.1, 0.01]), position=(n + 0.5, 0, 0))), last or scene.ground
            scene.connect("pin %d" % n, h.Revolute, last, before, (n, 0, 0), axis=(0, 1, 0))
        tip = last.marker((0.5, 0, 0))
        scene.add("spring", h.SpringDamper(tip, scene.ground.marker((1, 0, 1)), stiffness=k, damping=1.))
        height = h.displacement(tip, "z")

        def slope(c, step, **how):
            z = []
            for stiffness in (c * (1 + step), c):
                scene.set(k=stiffness)
                z.append(scene.solve(1., sample=None, **how).snapshot().value(height))
            return (z[0] - z[1]) / (c * step)

        values = np.linspace(100., 105., 3)
        exact = [(slope(c, 1e-3, tolerance=1e-9) + slope(c, -1e-3, tolerance=1e-9)) / 2 for c in values]
        fixed = {"ts_adapt_type": "none", "ts_dt": 1e-3, "ts_hhtdae_corrector_tolerance": 1e-5}
        for step, how, largest in ((1e-2, dict(tolerance=1e-7), 0.06), (1e-4, dict(tolerance=1e-7), 0.03), (1e-2, dict(options=fixed), 0.06), (1e-6, dict(options=fixed), 0.01)):
            for c, x in zip(values, exact):
                self.assertLess(abs(slope(c, step, **how) / x - 1), largest)


class Steady(unittest.TestCase):
    """response() warns where a state is neither in equilibrium nor steady"""

    def warned(self, scene, body, omega=3., axes=None, run=None):
        m = body.marker()
        small = (run or scene.run()).linearize(axes=axes)
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            for _ in range(2):
                small.response(h.Excitation.force(m, (0, 1, 0)), h.displacement(m, "y"), omega)
        return [str(w.message) for w in told]

    def pendulum(self, angle=0.5, speed=2.):
        scene = h.Scene(gravity=(9.81, 0, 0), planar=True)
        c, s = np.cos(angle), np.sin(angle)
        rod = scene.add("rod", h.RigidBody(1., np.eye(3), position=(c, s, 0), rotation=h.rotation((0, 0, 1), angle), angular_velocity=(0, 0, speed), velocity=(-s * speed, c * speed, 0)))
        scene.connect("pin", h.Revolute, rod, scene.ground, (0, 0, 0))
        return scene, rod

    def test_pendulum(self):
        for angle, speed in ((0.5, 2.), (0.5, 0.), (0., 2.)):  # in swing, where it turns back, at the bottom
            scene, rod = self.pendulum(angle, speed)
            told = self.warned(scene, rod)
            self.assertEqual(len(told), 2)
            self.assertRegex(told[0], "neither in equilibrium nor steady.*body rod.*state_space.*Run.equilibrium")
        self.assertEqual(self.warned(scene, rod, omega=1e4), [])
        self.assertEqual(self.warned(scene, rod, omega=[0., 3.], run=scene.run().equilibrium()), [])
        self.assertEqual(self.warned(*self.pendulum(0., 0.)), [])
        small = self.pendulum()[0].run().linearize()
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            small.modes()
            small.state_space([], [])
        with self.assertWarnsRegex(RuntimeWarning, r"modes\(count\): the state"):
            small.modes(1)
        with self.assertWarnsRegex(RuntimeWarning, "body rod"):  # horizontal: the motion that is asked for has the rate zero
            self.pendulum(np.pi / 2, 0.)[0].run().linearize().modes(1)

    def test_motion_without_a_rate(self):
        """A driven hub may stand at any angle, and is no slow motion beside which what a run leaves in accelerations counts"""
        scene, W, small = h.Scene(), np.array([0, 0, 5.]), 1e-5
        hub = scene.add("hub", h.RigidBody(1., np.eye(3), angular_velocity=W))
        scene.connect("pin", h.Revolute, hub, scene.ground, (0, 0, 0))
        scene.add("drive", h.RotationalMotion(hub.marker(), scene.ground.marker(), 5., of="velocity"))
        x = np.array([0.5 + 0.5 * np.cos(small), 0.5 * np.sin(small), 0])
        mast = scene.add("mast", h.RigidBody(1., np.eye(3), position=x, velocity=np.cross(W, x), rotation=h.rotation((0, 0, 1), small), angular_velocity=W))
        scene.connect("hinge", h.Revolute, mast, hub, (0.5, 0, 0))
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            hub_mode, lag = scene.run().linearize(axes=hub).modes(2)
        self.assertLess(abs(hub_mode.value), 1e-6)
        self.assertAlmostEqual(lag.value.imag, 5. * np.sqrt(0.25 / 1.25), delta=1e-6)

    def driveline(self, axis, damping=0.):
        """Three wheels on one axle that two springs couple, at rest"""
        scene, axes = h.Scene(), h.axes_along(axis)
        markers = []
        for k, J in enumerate((.15, .4, .05)):
            body = scene.rigid_body("b%d" % k, mass=1, inertia=(J,) * 3)
            markers.append(body.marker_at((0, 0, 0), axes))
            scene.add("r%d" % k, h.Revolute(markers[-1], scene.ground.marker(axes=axes)))
        for k, stiffness in enumerate((2e4, 8e3)):
            scene.add("s%d" % k, h.TorsionalSpringDamper(markers[k + 1], markers[k], stiffness=stiffness, damping=damping))
        return scene, markers

    def test_free_driveline(self):
        """It turns freely, a motion without a rate whatever rounding makes of it: twice zero; and it is in equilibrium"""
        rng = np.random.default_rng(0)
        for damping in (0., 1e-3):
            for axis in rng.normal(size=(15, 3)):
                modes = self.driveline(axis, damping)[0].run().linearize().modes()
                self.assertEqual(len(modes), 4)
                for mode in modes[:2]:
                    self.assertLess(abs(mode.value), 1e-4)
                    self.assertEqual(mode.value.imag, 0.)
                    self.assertGreater(np.abs(mode.shape).max(), 0.)
                np.testing.assert_allclose([mode.value.imag for mode in modes[2:]], [1.5e5**.5, (6.4e5 / 3)**.5], rtol=1e-6)
        for axis in ((1, 2, 3), (3, 1, -1)):
            scene, markers = self.driveline(axis)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                scene.run().linearize().modes(2)
                scene.run().linearize().response(h.Excitation.torque(markers[0], axis), h.angular_velocity(markers[2], "z", frame=markers[2]), [1e-3, 1.])

    def test_steady(self):
        """A round rotor from space, a mast on a hub from the hub, and free fall"""
        scene = h.Scene(gravity=(0, 0, -9.81))
        rotor = scene.add("rotor", h.RigidBody(1., [1, 1, 2.], angular_velocity=(0, 0, 100.)))
        post = scene.ground.marker()
        scene.add("bearing", h.Bushing(rotor.marker(), post, stiffness=[1e3] * 3, force=(0, 0, 9.81)))
        self.assertEqual(self.warned(scene, rotor), [])
        scene = h.Scene()
        hub = scene.add("hub", h.RigidBody(1., np.eye(3), angular_velocity=(0, 0, 5.)))
        mast = scene.add("mast", h.RigidBody(1., np.eye(3), position=(1., 0, 0), velocity=(0, 5., 0), angular_velocity=(0, 0, 5.)))
        scene.connect("pin", h.Revolute, hub, scene.ground, (0, 0, 0))
        scene.connect("hinge", h.Revolute, mast, hub, (0.5, 0, 0))
        self.assertEqual(self.warned(scene, mast, axes=hub), [])
        self.assertEqual(len(self.warned(scene, mast)), 2)
        scene = h.Scene(gravity=(0, 0, -9.81))
        self.assertEqual(self.warned(scene, scene.add("stone", h.PointMass(position=(1., 0, 0)))), [])


class Interrupted(unittest.TestCase):
    def test_descriptions(self):
        """An exception of a formula's evaluation, Ctrl-C say, is raised as it is, and is the cause of no later error"""
        scene = h.Scene()
        k = scene.parameter("k", 1.)
        body = scene.add("b", h.RigidBody(mass=-1.))
        marker = body.marker((1, 0, 0))
        for error in (KeyboardInterrupt, LookupError):
            for describe in (lambda: body.marker((k, 0, 0)), lambda: body.marker_at((k, 0, 0)), lambda: scene.set_gravity((0, 0, k))):
                with unittest.mock.patch("hhtdae.scene.plain", side_effect=error), self.assertRaises(error):
                    describe()
            for part in (h.PointMass(mass=k), h.RigidBody(mass=k), h.SpringDamper(marker, scene.ground.marker(), stiffness=k)):
                with unittest.mock.patch("hhtdae.spec.plain", side_effect=error), self.assertRaises(error):
                    scene.add("", part)
        class Slow:
            def __array__(self, *args, **named):
                raise KeyboardInterrupt

        with unittest.mock.patch("hhtdae.scene.plain", return_value=Slow()), self.assertRaises(KeyboardInterrupt):
            body.marker((k, 0, 0))  # while NumPy reads the numbers
        with self.assertRaises(KeyboardInterrupt):
            body.marker(Slow())
        with self.assertRaisesRegex(h.Error, "mass is -1") as caught:
            scene.set_up()
        self.assertIsNone(caught.exception.__cause__)

    def test_descriptions_that_are_repeated(self):
        """What was interrupted is not there, and may be described again"""
        scene = h.Scene()
        k = scene.parameter("k", 2.)
        with unittest.mock.patch("hhtdae.spec.plain", side_effect=KeyboardInterrupt), self.assertRaises(KeyboardInterrupt):
            scene.add("b", h.PointMass(mass=k))
        body = scene.add("b", h.PointMass(mass=k))
        with unittest.mock.patch("hhtdae.scene.plain", side_effect=KeyboardInterrupt), self.assertRaises(KeyboardInterrupt):
            scene.ground.marker((k, 0, 0))
        end, there = scene.ground.marker((k, 0, 0)), body.marker()
        with unittest.mock.patch("hhtdae.spec.plain", side_effect=KeyboardInterrupt), self.assertRaises(KeyboardInterrupt):
            scene.add("spring", h.SpringDamper(there, end, stiffness=k))
        scene.add("spring", h.SpringDamper(there, end, stiffness=k, length=1.))
        scene.channel("x", h.displacement(there, "x"))
        for value in (2., 3., 2.):
            scene.set(k=value)
            self.assertAlmostEqual(scene.solve(1., tolerance=1e-7)["x"][-1], (value - 1) * (1 - np.cos(1.)), delta=1e-4)


class Velocities(unittest.TestCase):
    """Run.set_velocity()"""

    def test_of_a_free_body(self):
        """In each kind of coordinates, before a run and within it, whatever the body has turned: what is not given stays"""
        for planar, rotations, point in ((True, "local", False), (True, "local", True), (False, "local", False), (False, "euler313", False), (False, "local", True)):
            scene, a = h.Scene(planar=planar), 1 - planar
            scene.start(rotations=rotations)
            scene.add("other", h.PointMass())
            w = (0.3 * a, -0.5 * a, 2.)
            body = scene.add("body", h.PointMass(position=(1, 2, 0), velocity=(1, 0, 0)) if point else h.RigidBody(2., (1, 2, 3.), center=(0.4, 0.1, 0), velocity=(1, 0, 0), angular_velocity=w))
            last = scene.add("last", h.PointMass(velocity=(0, 3, 0)))
            run = scene.run(tolerance=1e-8)
            for until, v, w in ((0.7, (3, -1, 2. * a), (1. * a, 2. * a, -3)), (1.4, (0, 5, 0), None), (2.1, None, (0, 0, 1)), (2.8, None, None)):
                if point and w and v is None:
                    continue
                before = run.snapshot().motion(body)
                run.set_velocity(body, v, None if point else w)
                after = run.snapshot().motion(body)
                np.testing.assert_allclose(after.velocity, before.velocity if v is None else v, atol=1e-12)
                np.testing.assert_allclose(after.position, before.position, atol=0)
                if not point:
                    np.testing.assert_allclose(after.angular_velocity, before.angular_velocity if w is None else w, atol=1e-12)
                at, kept = run.time, run.snapshot()
                run.solve(until)
                moved = run.snapshot()
                np.testing.assert_allclose(moved.motion(last).velocity, (0, 3, 0), atol=1e-9)
                self.assertAlmostEqual(moved.energy()[0], kept.energy()[0], delta=1e-3)
                if point:
                    np.testing.assert_allclose(moved.motion(body).position, after.position + (until - at) * after.velocity, atol=1e-9)

    def test_bounce(self):
        """A ball with restitution, and a pendulum that is thrown back at the bottom"""
        scene = h.Scene(planar=True, gravity=(0, -9.81, 0))
        ball = scene.add("ball", h.RigidBody(1., (1, 1, 1.), position=(0, 1, 0), velocity=(2, 0, 0), angular_velocity=(0, 0, 5)))
        run, seen = scene.run(tolerance=1e-6), []

        def bounce(r):
            v = r.snapshot().motion(ball).velocity
            seen.append(r.time)
            r.set_velocity(ball, (v[0], -0.8 * v[1], 0))
        run.event(h.displacement(ball.marker(), "y"), bounce, direction=-1)
        run.solve(2.)
        fall = np.sqrt(2 / 9.81)
        np.testing.assert_allclose(seen, fall * np.array([1, 2.6, 3.88]), atol=2e-5)
        self.assertAlmostEqual(run.snapshot().motion(ball).angular_velocity[2], 5, delta=1e-9)
        self.assertAlmostEqual(run.snapshot().motion(ball).position[0], 4, delta=1e-6)

        scene = h.Scene(gravity=(0, -9.81, 0))
        rod = scene.add("rod", h.RigidBody(1., (0.1, 0.1, 0.1), position=(0.5, 0, 0), rotation=h.rotation((0, 0, 1), 0.3)))
        pin = scene.connect("pin", h.Revolute, rod, scene.ground, (0, 0, 0))
        run, energies = scene.run(tolerance=1e-8), []

        def energy(r):
            return sum(r.snapshot().energy())

        def back(r):
            energies.append(energy(r))
            m = r.snapshot().motion(rod)
            r.set_velocity(rod, -m.velocity, -m.angular_velocity)
        run.event(h.displacement(rod.marker(), "x"), back, direction=-1)
        run.solve(1.5)
        self.assertGreaterEqual(len(energies), 2)
        np.testing.assert_allclose(energies + [energy(run)], 0, atol=1e-3)
        self.assertGreater(run.snapshot().motion(rod).position[0], -1e-6)
        self.assertIsNotNone(pin)

    def test_against_a_joint(self):
        """Velocities that a joint does not allow: those after a plastic impact"""
        scene = h.Scene()
        rod = scene.add("rod", h.RigidBody(2., (0.1, 0.1, 0.1), position=(0.5, 0, 0)))
        scene.connect("pin", h.Revolute, rod, scene.ground, (0, 0, 0))
        run = scene.run(tolerance=1e-8)
        run.set_velocity(rod, (7, 1, 0))
        run.solve(1e-3)
        self.assertAlmostEqual(run.snapshot().motion(rod).angular_velocity[2], 2 * 0.5 * 1 / (2 * 0.25 + 0.1), delta=1e-6)

    def test_mistakes(self):
        scene = h.Scene(planar=True)
        point = scene.add("point", h.PointMass())
        run = scene.run()
        for arguments, text in (((scene.ground, (1, 0, 0)), "not the ground"), ((point, (1, 0, 1)), "point leaves the plane"), ((point, None, (0, 0, 1)), "point is a point mass")):
            with self.assertRaisesRegex(h.Error, text):
                run.set_velocity(*arguments)


if __name__ == "__main__":
    unittest.main()
