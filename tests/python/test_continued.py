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


if __name__ == "__main__":
    unittest.main()
