"""Every example of examples/python, against the closed form or the reference it names."""

import contextlib
import importlib
import io
import json
import math
import os
import sys
import unittest

import hhtdae

HERE = os.path.dirname(os.path.abspath(__file__))
EXAMPLES = os.path.join(HERE, "..", "..", "examples", "python")
sys.path.insert(0, EXAMPLES)
HELPERS = {"beam_mesh"}

# Bounds of the absolute values of what main() returns; None: not bounded. (a, b): between a and b.
BOUNDS = {
    "pendulum": [1e-5],
    "time_stepper": [5e-5],
    "first_scene": [2e-4, (49.03, 49.06)],  # 5/2 m g at the bottom
    "slider_crank": [2e-4],
    "formulas": [2e-3, 1e-6],
    "callback": [2e-4, 1e-7],
    "sweep": [1e-4],
    "processes": [1e-4],
    "optimize": [(0.499, 0.501), 2e-4],
    "control": [(0.03, 0.09), 1e-3, 1e-3],
    "campbell": [1e-9],
    "response": [1e-9],
    "gyroscope": [1e-4, 2e-4],
    "rolling": [1e-6, 1e-6],
    "bouncing": [1e-2, 1e-3],
    "checkpoint": [0, 0],
    "chain": [1e-9, 1e-9, (-0.536, -0.535)],
    "flexible_beam": [2e-3, 2e-3, 5e-3],
    "flexible_modes": [5e-3, 1e-3],
    # the README's table: order two and the order chosen, for each tolerance, within a fifth
    "tolerances": [(0.8 * x, 1.2 * x) for x in (1.2e-1, 7.7e-2, 2.9e-2, 9.2e-3, 6.8e-3, 1.1e-3, 1.5e-3, 1.9e-4, 3.5e-4, 4.9e-5, 7.9e-5, 7.3e-6, 1.9e-5, 1.1e-6)],
}


class Examples(unittest.TestCase):
    def test_all_are_here(self):
        files = {name[:-3] for name in os.listdir(EXAMPLES) if name.endswith(".py")}
        self.assertEqual(files, set(BOUNDS) | HELPERS)


def bounded(name):
    def test(self):
        module = importlib.import_module(name)
        printed = io.StringIO()
        try:
            with contextlib.redirect_stdout(printed):
                result = module.main()
        except ImportError as error:
            self.skipTest(str(error))
        result = result if isinstance(result, tuple) else (result,)
        self.assertEqual(len(result), len(BOUNDS[name]))
        for value, bound in zip(result, BOUNDS[name]):
            low, high = bound if isinstance(bound, tuple) else (-bound, bound)
            self.assertTrue(low <= value <= high, "%s: %r is not from %r to %r\n%s" % (name, value, low, high, printed.getvalue()))
        self.assertTrue(printed.getvalue() or name == "chain")  # PETSc prints for all ranks
        self.assertTrue(module.__doc__)
    return test


for _name in BOUNDS:
    setattr(Examples, "test_" + _name, bounded(_name))


class Notebook(unittest.TestCase):
    def test_crane(self):
        """The notebook's cells, one after the other: the period of the rod with its box, and travels by it"""
        try:
            import matplotlib

            matplotlib.use("Agg")
        except ImportError:
            pass
        with open(os.path.join(EXAMPLES, "crane.ipynb")) as file:
            cells = json.load(file)["cells"]
        names = {}
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            for cell in cells:
                if cell["cell_type"] == "code":
                    source = "".join(cell["source"])
                    if source.startswith("scene.solve"):  # what a notebook shows below the cell
                        try:
                            self.assertIn("<iframe srcdoc=", eval(source, names)._repr_html_())
                        except hhtdae.Error as error:
                            self.assertIn("built without", str(error))
                        continue
                    exec(source, names)
        J = hhtdae.inertia.box(500, (0.5, 0.5, 0.5))[1, 1] + 500 * 2.**2
        self.assertAlmostEqual(names["period"], 2 * math.pi * math.sqrt(J / (500 * 9.81 * 2)), delta=1e-6)
        left = names["left"]
        self.assertLess(left[2.0], 0.2 * left[1.0])
        self.assertAlmostEqual(names["now"].motion(names["trolley"]).position[0], 2., delta=1e-8)
        self.assertIn("largest swing", printed.getvalue())


class Picture(unittest.TestCase):
    def test_plot_and_frame(self):
        """Axes for each unit, lines for each channel; a frame of pandas"""
        scene = hhtdae.Scene(gravity=(0, 0, -1))
        b = scene.add("b", hhtdae.PointMass())
        scene.channel("z", hhtdae.displacement(b.marker(), "z"), "m")
        scene.channel("v", hhtdae.velocity(b.marker(), "z"), "m/s")
        run = scene.solve(1., sample=0.25)
        try:
            import matplotlib
        except ImportError:
            self.skipTest("no matplotlib")
        matplotlib.use("Agg")
        axes = run.plot()
        self.assertEqual([a.get_ylabel() for a in axes], ["m", "m/s"])
        self.assertEqual(len(axes[0].lines[0].get_xdata()), 5)
        with self.assertRaisesRegex(KeyError, "zz"):
            run.plot("zz")
        try:
            import pandas
        except ImportError:
            return
        frame = run.frame()
        self.assertIsInstance(frame, pandas.DataFrame)
        self.assertEqual((list(frame.columns), frame.index.name, len(frame)), (["z", "v"], "time", 5))


if __name__ == "__main__":
    unittest.main()
