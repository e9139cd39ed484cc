"""Runs that go on: from checkpoints, after other runs, after changes of parameters. What is read of a state is the same in all of them."""

import os
import tempfile
import unittest

import numpy as np

import hhtdae as h

G = 9.81


def wheel(counted=True, planar=False):
    """A wheel that turns by 10 rad in a unit of time, and its angle"""
    scene = h.Scene(planar=planar)
    body = scene.rigid_body("wheel", angular_velocity=(0, 0, 10.))
    i, j = body.marker(), scene.ground.marker()
    scene.add("hinge", h.Revolute(i, j))
    angle = h.angle(i, j)
    if counted:
        scene.channel("angle", angle)
    return scene, angle, body


def double_pendulum():
    """Two rods that fall from the horizontal, a factor of the second one's weight, and the angle of the first"""
    scene = h.Scene(gravity=(0, -G, 0))
    load = scene.parameter("load", 0.)
    a = scene.rigid_body("a", mass=1, inertia=(.1, .1, .1), position=(.5, 0, 0))
    b = scene.rigid_body("b", mass=1, inertia=(.1, .1, .1), position=(1.5, 0, 0))
    scene.connect("pa", h.Revolute, a, scene.ground, (0, 0, 0))
    scene.connect("pb", h.Revolute, b, a, (1, 0, 0))
    scene.add("load", h.UserForce(b.marker(), force=[0, -load, 0]))
    angle = h.angle(a.marker(), scene.ground.marker())
    scene.channel("angle", angle)
    return scene, angle, load


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = os.path.join(folder.name, "checkpoint")


class Angles(Folder):
    """Full turns are those of the state that is read, whatever the run has counted before"""

    def test_with_what_counts(self):
        for planar in (False, True):
            scene, _, _ = wheel(planar=planar)
            scene.run(tolerance=1e-6).solve(2.).save(self.file)
            for before in ("nothing", "read at the start", "read later"):
                scene, angle, _ = wheel(planar=planar)
                run, hits = scene.run(tolerance=1e-6), []
                if before == "read at the start":
                    self.assertEqual(run.snapshot().value(angle), 0.)
                if before == "read later":
                    self.assertAlmostEqual(run.solve(3.9).snapshot().value(angle), 39., delta=1e-5)
                old = run.snapshot()
                run.event(angle - 22.5, lambda r: hits.append(r.time))
                run.load(self.file)
                old.value(angle)  # of the state before the checkpoint was read, which says nothing of the present one
                self.assertAlmostEqual(run.sample()["angle"], 20., delta=1e-5)
                self.assertAlmostEqual(run.snapshot().value(angle), 20., delta=1e-5, msg=before)
                self.assertAlmostEqual(run.solve(3.).snapshot().value(angle), 30., delta=1e-5, msg=before)
                np.testing.assert_allclose(hits, [2.25], atol=1e-5, err_msg=before)

    def test_counted_by_questions_alone(self):
        """The checkpoint has the turns that the run has counted since it was first asked, also of markers that are made later"""
        for late in (False, True):
            def model():
                scene, angle, body = wheel(counted=False)
                run = scene.run(tolerance=1e-6)
                return h.angle(body.marker(), scene.ground.marker()) if late else angle, run
            angle, run = model()
            run.snapshot().value(angle)
            run.solve(2.).save(self.file)
            run.solve(4.)
            self.assertAlmostEqual(run.load(self.file).snapshot().value(angle), 20., delta=1e-5)
            angle, run = model()
            self.assertAlmostEqual(run.load(self.file).snapshot().value(angle), 20., delta=1e-5)
            self.assertAlmostEqual(run.solve(3.).snapshot().value(angle), 30., delta=1e-5)

    def test_other_markers_of_the_same_number(self):
        """Of markers that are made after the first run the checkpoint's may be others"""
        scene, _, body = wheel(counted=False)
        run = scene.run(tolerance=1e-6)
        run.snapshot().value(h.angle(body.marker(), scene.ground.marker()))
        run.solve(2.).save(self.file)
        scene, _, body = wheel(counted=False)
        run = scene.run(tolerance=1e-6)
        other = h.angle(body.marker(axes=h.rotation((0, 0, 1), -1.)), scene.ground.marker())
        self.assertAlmostEqual(run.load(self.file).snapshot().value(other), 19. - 6 * np.pi, delta=1e-5)

    def test_counted_by_nobody(self):
        scene, angle, _ = wheel(counted=False)
        scene.run(tolerance=1e-6).solve(2.).save(self.file)
        for read in (False, True):
            scene, angle, _ = wheel(counted=False)
            run = scene.run(tolerance=1e-6)
            if read:
                run.snapshot().value(angle)
                run.solve(1.)
            first = run.load(self.file).snapshot().value(angle)
            self.assertAlmostEqual(first, 20. - 6 * np.pi, delta=1e-5)
            self.assertAlmostEqual(run.solve(3.).snapshot().value(angle), first + 10., delta=1e-5)


class Events(Folder):
    levels = (.3, .6, .9, 1.2, 1.5)

    def test_back_to_an_earlier_time(self):
        scene, angle, _ = wheel()
        run, hits = scene.run(tolerance=1e-6), []
        run.event(h.sin(angle) - .5, lambda r: hits.append(r.time), direction=1)
        run.solve(.3).save(self.file)
        run.solve(2.)
        self.assertEqual(len(hits), 4)
        first = hits[1:]
        hits.clear()
        run.load(self.file).solve(2.)
        self.assertEqual(hits, first)

    def passages(self, terminal, save, log):
        scene, angle, _ = double_pendulum()
        run = scene.run(tolerance=1e-6)
        for level in self.levels:
            def action(r, level=level):
                log.append((level, r.time))
                if save and not terminal:
                    r.save(self.file + "%g" % level)
            run.event(angle + level, action, terminal=terminal)
        return run

    def test_checkpoints_of_actions(self):
        log = []
        whole = self.passages(False, True, log).solve(1.)
        self.assertEqual([level for level, _ in log], list(self.levels))
        for k, level in enumerate(self.levels):
            mine = []
            run = self.passages(False, False, mine).load(self.file + "%g" % level).solve(1.)
            self.assertEqual(mine, log[k + 1:])
            self.assertEqual(run["angle"][-1], whole["angle"][-1])

    def test_checkpoints_of_ends(self):
        log = []
        run = self.passages(True, True, log)
        for level in self.levels:
            run.solve(1.).save(self.file + "%g" % level)
        self.assertEqual([level for level, _ in log], list(self.levels))
        for k, level in enumerate(self.levels[:-1]):
            mine = []
            self.passages(True, False, mine).load(self.file + "%g" % level).solve(1.)
            self.assertEqual(mine, log[k + 1:k + 2])

    def test_of_other_runs(self):
        """An event that the other run had not is a new one, though it has the same number"""
        scene = h.Scene(gravity=(0, 0, -G))
        ball = scene.add("ball", h.PointMass(position=(0, 0, 1.)))
        z = h.displacement(ball.marker(), 2)
        run = scene.run(tolerance=1e-6)
        run.event(z - .5, terminal=True)
        run.solve(1.).save(self.file)
        run, hits = scene.run(tolerance=1e-6), []
        run.event(z - (.5 - 1e-4), lambda r: hits.append(r.time))
        run.load(self.file).solve(.4)
        np.testing.assert_allclose(hits, [np.sqrt(2 * (.5 + 1e-4) / G)], atol=1e-6)

    def test_not_again(self):
        """run(after=) projects the positions, which may move back what has ended the run before"""
        for change in (0., .1):
            for level in np.linspace(.1, 1.5, 15):
                scene, angle, load = double_pendulum()
                run, hits = scene.run(tolerance=1e-6), []
                run.event(angle + level, terminal=True, direction=-1)
                run.solve(1.)
                load.set(change)
                on = scene.run(tolerance=1e-6, after=run)
                on.event(angle + level, lambda r: hits.append(r.time), direction=-1)
                on.solve(run.time + .05)
                self.assertEqual(hits, [], (change, level))

    def test_again_after_a_change(self):
        """A parameter raises an acceleration, which then falls through zero again"""
        for more in (1e-1, 1e-3, 1e-5):
            scene = h.Scene()
            p = scene.parameter("p", 0.2)
            m = scene.add("b", h.PointMass()).marker()
            scene.add("f", h.UserForce(m, force=[p - h.time(), 0, 0]))
            run, end = scene.run(tolerance=1e-6), h.acceleration(m, 0)
            run.event(end, terminal=True, direction=-1)
            run.solve(1.)
            p.set(.2 + more)
            run = scene.run(tolerance=1e-6, after=run)
            run.event(end, terminal=True, direction=-1)
            run.solve(1.)
            self.assertAlmostEqual(run.time, .2 + more, delta=1e-6 * more + 1e-12)

    def test_again_elsewhere(self):
        """A parameter moves the bodies to where the event is still to come"""
        scene = h.Scene(gravity=(0, 0, -G))
        up = scene.parameter("up", 0.)
        ball = scene.add("ball", h.PointMass(position=(0, 0, 1.)))
        lift = scene.add("lift", h.PointMass())
        scene.add("raised", h.TranslationalMotion(lift.marker(), scene.ground.marker(), up))
        scene.add("x", h.InLine(lift.marker(), scene.ground.marker()))
        height = h.displacement(ball.marker(), 2) + h.displacement(lift.marker(), 2)
        run, hits = scene.run(tolerance=1e-7), []
        run.event(height - .5, terminal=True)
        run.solve(1.)
        up.set(.1)
        scene.start(assembly="project")
        run = scene.run(tolerance=1e-7, after=run)
        run.event(height - .5, lambda r: hits.append(r.time))
        run.solve(.4)
        np.testing.assert_allclose(hits, [np.sqrt(2 * .6 / G)], atol=1e-5)

    def test_of_another_scene(self):
        scene, angle, _ = wheel()
        other, foreign, _ = wheel()
        run, hits = scene.run(tolerance=1e-6), []
        with self.assertRaisesRegex(ValueError, r"event\(\): <measure angle> is of another scene"):
            run.event(foreign - 1.)
        run.event(angle - 5., lambda r: hits.append(r.time))
        run.solve(1.)
        np.testing.assert_allclose(hits, [.5], atol=1e-6)


class Parameters(unittest.TestCase):
    def driven(self, **motion):
        """A rod that a motion turns about its end; its speed, and the force on the bearing"""
        scene = h.Scene()
        p = scene.parameter("p", 1.)
        rod = scene.rigid_body("rod", mass=1, inertia=(.1, .1, .1), position=(.5, 0, 0))
        i, j = rod.marker((-.5, 0, 0)), scene.ground.marker()
        bearing = scene.add("bearing", h.Revolute(i, j))
        scene.add("drive", h.RotationalMotion(i, j, motion["law"](p), of=motion.get("of", "displacement")))
        scene.channel("speed", h.angular_velocity(i, "z"))
        scene.channel("force", h.joint_force(bearing, "x", frame=i))
        scene.start(assembly="project")
        return scene, p, h.angular_velocity(i, "z"), h.joint_force(bearing, "x", frame=i)

    def test_velocities_that_motions_prescribe(self):
        """They jump with the parameter, and with them what is read at the present time"""
        for motion in (dict(law=lambda p: p, of="velocity"), dict(law=lambda p: p * (h.time() - .5))):
            scene, p, speed, force = self.driven(**motion)
            run = scene.run(tolerance=1e-7).solve(.5)
            self.assertAlmostEqual(run.snapshot().value(force), -.5, delta=1e-3)
            p.set(10.)
            now = run.snapshot()
            for value, sample in ((now.value(speed), run.sample()["speed"]), (now.value(force), run.sample()["force"])):
                self.assertEqual(value, sample)
            self.assertAlmostEqual(now.value(speed), 10., delta=1e-6)
            self.assertAlmostEqual(now.value(force), -50., delta=1e-2)
            run.solve(run.time + 1e-7)
            self.assertAlmostEqual(run.sample()["speed"], 10., delta=1e-6)
            self.assertAlmostEqual(run.sample()["force"], -50., delta=.1)

    def test_times_before_the_change(self):
        """A state within the last step has the parameters of that step, also when it is read later"""
        scene = h.Scene()
        torque = scene.parameter("torque", 2.)
        body = scene.rigid_body("body", inertia=(1, 1, 1))
        i, j = body.marker(), scene.ground.marker()
        scene.add("hinge", h.Revolute(i, j))
        motor = scene.add("motor", h.UserScalarForce(i, j, value=torque, rotational=True))
        values = {"acceleration": h.angular_acceleration(i, "z"), "torque": h.force(motor, 0)}
        for name, value in values.items():
            scene.channel(name, value)
        run = scene.run(tolerance=1e-6).solve(1.)
        middle = .5 * (run.ts.getPrevTime() + run.time)
        end = run.snapshot()
        torque.set(50.)
        for name, value in values.items():
            self.assertAlmostEqual(run.snapshot(middle).value(value), 2., delta=1e-9, msg=name)
            self.assertAlmostEqual(run.sample(middle)[name], 2., delta=1e-9, msg=name)
            self.assertAlmostEqual(end.value(value), 2., delta=1e-9, msg=name)
            self.assertAlmostEqual(run.snapshot().value(value), 50., delta=1e-9, msg=name)
            self.assertAlmostEqual(run.sample()[name], 50., delta=1e-9, msg=name)
        self.assertEqual(torque.get(), 50.)


if __name__ == "__main__":
    unittest.main()
