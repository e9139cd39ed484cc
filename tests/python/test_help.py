"""What help() and type checkers see: every public name is documented, the stubs have the names of the modules, pickled results come back."""

import ast
import inspect
import os
import pickle
import pydoc
import re
import unittest

import numpy as np

import hhtdae as h
from hhtdae import _core

PACKAGE = os.path.dirname(h.__file__)


class Documentation(unittest.TestCase):
    def test_every_public_name_says_what_it_is(self):
        missing = []
        for name in h.__all__:
            x = getattr(h, name)
            if not (getattr(x, "__doc__", None) or "").strip():
                missing.append(name)
            if not inspect.isclass(x) or isinstance(x, type) and issubclass(x, Exception):
                continue
            for member, value in vars(x).items():
                if member.startswith("_") or not (inspect.isfunction(value) or isinstance(value, (property, classmethod, staticmethod))):
                    continue
                doc = value.fget.__doc__ if isinstance(value, property) else getattr(value, "__func__", value).__doc__
                if not doc and issubclass(x, h.Expression):
                    continue  # numpy's names for its functions
                if not doc:
                    missing.append("%s.%s" % (name, member))
        self.assertEqual(missing, [])
        self.assertEqual(len(h.__all__), len(set(h.__all__)))

    def test_help_of_an_element(self):
        text = pydoc.plain(pydoc.render_doc(h.SpringDamper))
        self.assertIn("stiffness", text)
        self.assertIn("Component: the tension", text)
        self.assertIn("length: ", text)

    def test_help_of_tolerances_and_threads(self):
        self.assertIn("angle_tol", h.Scene.run.__doc__)
        for x in (h, h.Run):
            self.assertIn("one thread at a time", re.sub(r"\s+", " ", x.__doc__))

    def test_stubs(self):
        modules = [_core]
        try:
            from hhtdae import _flexible

            modules.append(_flexible)
        except ImportError:
            pass
        for module in modules:
            with open(os.path.join(PACKAGE, module.__name__.split(".")[-1] + ".pyi")) as text:
                tree = ast.parse(text.read())
            told = {n.name for n in tree.body if isinstance(n, (ast.FunctionDef, ast.ClassDef))}
            told |= {n.target.id for n in tree.body if isinstance(n, ast.AnnAssign)}
            there = {name for name in dir(module) if not name.startswith("__")}
            self.assertEqual(told, there)


    def test_arguments_of_stubs(self):
        """As many as pybind11's documentation has, and of their names those that it knows"""
        with open(os.path.join(PACKAGE, "_core.pyi")) as text:
            tree = ast.parse(text.read())
        functions = [(_core, f) for f in tree.body if isinstance(f, ast.FunctionDef)]
        for c in tree.body:
            if isinstance(c, ast.ClassDef):
                functions += [(getattr(_core, c.name), f) for f in c.body if isinstance(f, ast.FunctionDef) and f.name != "__getattr__"
                              and not any(getattr(d, "id", "") == "property" for d in f.decorator_list)]
        self.assertGreater(len(functions), 50)
        for of, f in functions:
            head = (getattr(of, f.name).__doc__ or "").split("\n")[0]
            there = re.findall(r"(?:^|[(,] ?)(\w+): ", head[len(f.name):])
            told = [a.arg for a in f.args.args]
            self.assertEqual(len(told), len(there), "%s is declared with %s" % (head, told))
            for a, b in zip(told, there):
                if not b.startswith("arg"):
                    self.assertEqual(a, b, head)


class Pickles(unittest.TestCase):
    def test_results(self):
        s = h.solve_mechanism(lambda t, q, v, a: a + q, (0, 1), [1.], [0.], dense_output=True)
        again = pickle.loads(pickle.dumps(s))
        np.testing.assert_array_equal(again.q, s.q)
        self.assertEqual(again.sol(0.5), s.sol(0.5))
        self.assertEqual(again.statistics, s.statistics)
        error = pickle.loads(pickle.dumps(h.Error(62, "a message")))
        self.assertEqual(repr(error), "hhtdae.Error(62, 'a message')")
        self.assertEqual((str(error), error.ierr), ("a message", 62))
        scene = h.Scene()
        b = scene.add("b", h.PointMass(velocity=(1, 0, 0)))
        scene.channel("x", h.displacement(b.marker(), 0))
        run = scene.solve(1.)
        np.testing.assert_array_equal(pickle.loads(pickle.dumps(run.channels))["x"], run["x"])
        motion = pickle.loads(pickle.dumps(run.snapshot().motion(b)))
        np.testing.assert_allclose(motion.velocity, [1, 0, 0])
        with self.assertRaises(TypeError):
            pickle.dumps(scene)


if __name__ == "__main__":
    unittest.main()
