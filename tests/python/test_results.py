"""What a run leaves: pages for notebooks, results and scenes in other processes, tables and meshes for other packages."""

import html
import multiprocessing
import os
import pickle
import re
import sys
import tempfile
import types
import unittest

import numpy as np

import hhtdae as h


@h.model
def oscillator(mass=1., parts=False):
    """A mass on a spring along x"""
    scene = h.Scene()
    k = scene.parameter("k", 40.)
    b = scene.add("b", h.PointMass(mass=mass, position=(0.5, 0, 0)))
    m = b.marker()
    x = h.displacement(m, 0)
    scene.add("pull", h.UserForce(m, force=[-k * x, 0, 0]))
    scene.channel("x", x, "m")
    scene.channel("v", h.velocity(m, 0), "m/s")
    return (scene, b, m, k, x) if parts else scene


@h.model
def falling(settings, given=()):
    """A mass under gravity, with settings that the function itself changes"""
    scene = h.Scene(gravity=(0, -settings.pop("g"), 0))
    scene.channel("a", h.acceleration(scene.add("b", h.PointMass()).marker(), "y"))
    return scene


def swing(scene):
    return scene.solve(1., tolerance=1e-7)


def ask(given):
    scene, b, m, k, x = given
    k.set(20.)
    now = scene.solve(1., tolerance=1e-7).snapshot()
    return now.motion(b).position[0], now.motion(m).position[0], now.value(2 * x * k)


class Processes(unittest.TestCase):
    def test_scene_and_back(self):
        """Arguments, parameters and settings come along; the same bits come out"""
        scene = oscillator(2.)
        scene.set(k=30.)
        scene.start(tolerance=1e-5)
        again = pickle.loads(pickle.dumps(scene))
        self.assertEqual((again._start["tolerance"], again._parameters["k"].get()), (1e-5, 30.))
        np.testing.assert_array_equal(swing(again).values, swing(scene).values)
        self.assertAlmostEqual(swing(again)["x"][-1], 0.5 * np.cos(15**0.5), delta=1e-4)

    def test_workers(self):
        """Scenes to processes of a pool, results back, however they are started"""
        for how in ("fork", "spawn"):
            with multiprocessing.get_context(how).Pool(2) as pool:
                results = pool.map(swing, [oscillator(m) for m in (1., 4.)])
                asked = pool.map(ask, [oscillator(1., parts=True)])
            for r, w in zip(results, (40**0.5, 10**0.5)):
                self.assertIsInstance(r, h.Results)
                np.testing.assert_allclose(r["x"], 0.5 * np.cos(w * r.times), atol=5e-4)
                self.assertEqual((r.time, r.steps, r.units), (1., r.statistics.steps, {"x": "m", "v": "m/s"}))
            x = 0.5 * np.cos(20**0.5)
            np.testing.assert_allclose(np.array(asked[0]) / [1, 1, 40], [x, x, x], atol=5e-4)

    def test_arguments_are_those_of_the_call(self):
        """One dictionary for many scenes"""
        scenes = []
        for g in (1., 2.):
            settings = {"g": g, "more": [np.ones(2)]}
            settings["itself"] = settings
            scenes.append(falling(settings, given=settings["more"]))
            settings["more"][0][:] = 7.
            settings["g"] = 3.
        for scene, g in zip(scenes, (1., 2.)):
            again = pickle.loads(pickle.dumps(scene))
            self.assertAlmostEqual(again.solve(0.1)["a"][-1], -g, delta=1e-9)
            np.testing.assert_array_equal(again._recipe.keywords["given"][0], 1.)

    def test_what_cannot(self):
        with self.assertRaisesRegex(TypeError, "@hhtdae.model"):
            pickle.dumps(h.Scene())
        scene = oscillator()
        scene.ground.marker()
        with self.assertRaisesRegex(TypeError, "described further"):
            pickle.dumps(scene)
        with self.assertRaisesRegex(TypeError, "must return a scene"):
            h.model(lambda: 1)()

    def test_results_of_a_closed_run(self):
        with oscillator().solve(0.5) as run:
            left = run.results
        later = run.results
        np.testing.assert_array_equal(later.values, left.values)
        self.assertEqual((later.time, later.statistics), (0.5, left.statistics))
        self.assertIn("of x, v", repr(later))
        with self.assertRaisesRegex(KeyError, "x, v"):
            later["y"]
        with self.assertRaisesRegex(ValueError, "page=True"):
            later.page()


class Pages(unittest.TestCase):
    def page(self, run):
        try:
            return run.page()
        except ValueError:
            self.skipTest("the library was built without pages")

    def solve(self, *args, **keywords):
        try:
            return oscillator().solve(*args, **keywords)
        except h.Error as error:
            self.assertIn("built without", str(error))
            self.skipTest("the library was built without pages")

    def test_inline(self):
        """A frame that holds the whole page, and nothing that would end it"""
        run = self.solve(2., page=True)
        page = run.page(height=400)
        self.assertEqual(page.html.count('data-kind="frames">'), 4)  # 501 frames, 128 in a block
        self.assertIn('"title":"run"', page.html)
        shown = re.fullmatch(r'<iframe srcdoc="([^"]*)" style="[^"]*height: 400px[^"]*"[^>]*></iframe>', page._repr_html_())
        self.assertEqual(html.unescape(shown.group(1)), page.html)
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "page.html")
            page.save(file)
            with open(file, encoding="utf-8") as text:
                self.assertEqual(text.read(), page.html)
        again = pickle.loads(pickle.dumps(run))
        self.assertEqual(again.page().html, page.html)
        folder = os.path.dirname(run._page.file)
        self.assertTrue(os.path.exists(folder))
        del run
        self.assertFalse(os.path.exists(folder))

    def test_files_of_several_runs(self):
        """Each run has its own page, in a file of the user's choice; parts of a run are frames of the same page"""
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "parts.html")
            run = oscillator().run(page=file)
            try:
                for _ in run.step_by(0.1, until=1.):
                    pass
            except h.Error as error:
                self.assertIn("built without", str(error))
                self.skipTest("the library was built without pages")
            with open(file, encoding="utf-8") as text:
                self.assertEqual(text.read(), run.page().html)
            self.assertIn('"title":"parts.html"', run.page().html)
            self.assertLess(run.page().html.count('data-kind="frames">'), 25)
            scene = oscillator()
            scene.output(page_frames=10, page_title="a spring")
            one, other = scene.run(page=True), scene.run(page=True)
            for r in (one, other):
                r.solve(0.3)
            self.assertNotEqual(one._page.file, other._page.file)
            self.assertIn('"title":"a spring"', one.page().html)
            self.assertEqual(scene.solve(0.1).results._page, None)

    def test_none(self):
        with self.assertRaisesRegex(ValueError, "page=True"):
            oscillator().solve(0.1).page()
        with self.assertRaisesRegex(ValueError, "0xRRGGBB"):
            oscillator(1., True)[1].shape(h.Shape.sphere(1., colour="red"))
        _, b, _, _, _ = oscillator(1., True)
        for colour in (0xff8800, "#ff8800", None):
            b.shape(h.Shape.box((1, 1, 1), colour=colour))


class WithoutPackages(unittest.TestCase):
    def test_message(self):
        """What to install, where a package of another maker is missing"""
        run = oscillator().solve(0.1)
        for module, call in (("pandas", run.frame), ("matplotlib.pyplot", run.plot)):
            kept = {name: sys.modules[name] for name in list(sys.modules) if name == module or name == module.split(".")[0]}
            sys.modules[module] = None
            try:
                with self.assertRaisesRegex(ImportError, "python3-" + module.split(".")[0]):
                    call()
            finally:
                del sys.modules[module]
                sys.modules.update(kept)


class Mesh(types.SimpleNamespace):
    """In place of meshio.Mesh, where meshio is not installed"""

    def __init__(self, points, cells, **data):
        super().__init__(points=points, cells=cells, **data)


class Meshes(unittest.TestCase):
    def test_meshio(self):
        """Model, reduced body and whole body as meshes with what is known at their nodes"""
        try:
            from hhtdae import flexible
        except ImportError as error:
            self.skipTest(str(error))
        sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "python"))
        from beam_mesh import beam_mesh

        try:
            import meshio
        except ImportError:
            meshio = types.ModuleType("meshio")
            meshio.Mesh = Mesh
            sys.modules["meshio"] = meshio
            self.addCleanup(sys.modules.pop, "meshio")
        with tempfile.TemporaryDirectory() as folder:
            model = flexible.FeModel.from_mesh(beam_mesh(os.path.join(folder, "beam.msh"), 1., 0.05, 0.05), flexible.Material(2e11, 0., 8000.))
        mesh = model.to_meshio()
        self.assertIsInstance(mesh, meshio.Mesh)
        self.assertEqual((mesh.points.shape, sum(len(m) for m in mesh.cell_data["material"])), ((128, 3), 10))
        np.testing.assert_array_equal(mesh.point_sets["root"], model.sets["root"])
        body = flexible.reduce(model, [flexible.Attachment("root"), flexible.Attachment("tip")], modes=4, stress=True)
        eta = np.linspace(0., 1e-3, body.shape.shape[2])
        mesh = body.to_meshio(eta)
        np.testing.assert_allclose(mesh.point_data["displacement"], body.shape @ eta)
        np.testing.assert_allclose(mesh.point_data["von Mises"][body.stress_nodes], body.von_mises(eta))
        s = mesh.point_data["stress"][body.stress_nodes]
        mises = np.sqrt(0.5 * ((s[:, 0] - s[:, 1])**2 + (s[:, 1] - s[:, 2])**2 + (s[:, 2] - s[:, 0])**2) + 3 * (s[:, 3:]**2).sum(axis=1))
        np.testing.assert_allclose(mesh.point_data["von Mises"][body.stress_nodes], mises, rtol=1e-9)
        scene = h.Scene(gravity=(0, 0, -2.))
        R = h.rotation((0, 0, 1), 0.5)
        full = flexible.FullFeBody(scene, "beam", model, flexible.FullBody(position=(1, 2, 3), rotation=R))
        run = scene.solve(0.5, tolerance=1e-6)
        mesh = full.to_meshio(run)
        np.testing.assert_allclose(mesh.points, np.array([1, 2, 3]) + model.coordinates @ R.T, atol=1e-12)
        np.testing.assert_allclose(mesh.point_data["displacement"], np.tile([0, 0, -0.25], (128, 1)), atol=1e-6)  # it falls as a whole

    def test_surface(self):
        """A reduced body in a page: its mesh, with stress"""
        try:
            from hhtdae import flexible
        except ImportError as error:
            self.skipTest(str(error))
        sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "python"))
        from beam_mesh import beam_mesh

        with tempfile.TemporaryDirectory() as folder:
            model = flexible.FeModel.from_mesh(beam_mesh(os.path.join(folder, "beam.msh"), 1., 0.05, 0.05), flexible.Material(2e11, 0., 8000.))
        body = flexible.reduce(model, [flexible.Attachment("root"), flexible.Attachment("tip")], modes=4, stress=True)
        scene = h.Scene(gravity=(0, 0, -9.81))
        beam = scene.add("beam", h.FlexibleBody(body)).surface(body, "Pa")
        scene.add("clamp", h.Fixed(beam.attachment("root").marker(), scene.ground.marker()))
        try:
            text = scene.solve(0.05, page=True).page().html
        except h.Error as error:
            self.assertIn("built without", str(error))
            self.skipTest("the library was built without pages")
        self.assertEqual(text.count('data-kind="surface">'), 1)
        self.assertIn('"Pa"', text)
        with self.assertRaises(h.Error):
            scene = h.Scene()
            scene.add("beam", h.FlexibleBody(body)).surface(flexible.reduce(model, [flexible.Attachment("root")], modes=2, all_nodes=False))


if __name__ == "__main__":
    unittest.main()
