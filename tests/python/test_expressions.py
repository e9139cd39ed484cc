"""Formulas: values and derivatives of every operation against numpy and against differences, what cannot be traced, compiled sharing."""

import itertools
import math
import unittest

import numpy as np

import hhtdae as h
from hhtdae import _core
from hhtdae.expressions import Expression
from hhtdae.tracing import compile_tape, differentiate, ordered, time_function, trace

ONE = {"sin": np.sin, "cos": np.cos, "tan": np.tan, "arcsin": np.arcsin, "arccos": np.arccos, "arctan": np.arctan, "sinh": np.sinh, "cosh": np.cosh,
       "tanh": np.tanh, "exp": np.exp, "log": np.log, "log10": np.log10, "sqrt": np.sqrt, "cbrt": np.cbrt, "abs_": np.abs}
TWO = {"arctan2": np.arctan2, "hypot": np.hypot, "minimum": np.minimum, "maximum": np.maximum}
TABLE = ([-1., 0., 0.5, 2.], [0.3, -0.2, 0.4, 1.])
# In each of them x and y are between 0.1 and 0.9, where all are smooth but where they are meant not to be.
MIXED = {
    "rational": (lambda x, y: (x + 2 * y) / (3 - x * y) - 1 / x, None),
    "powers": (lambda x, y: x**3 + y**2 + x**y + 2**x + x**-1.5, None),
    "signs": (lambda x, y: -x + (+y) - abs(x - 2) * (1 - y), None),
    "where": (lambda x, y: h.where(x < y, x * x, y * x), lambda x, y: np.where(x < y, x * x, y * x)),
    "both": (lambda x, y: h.where((x < 0.5) & (y >= 0.3), x, h.where(~(x > 2) | (y == 7), 2 * y, 0.)),
             lambda x, y: x if x < 0.5 and y >= 0.3 else 2 * y),
    "step": (lambda x, y: h.step(x, 0., 1., y + 1, 3.), lambda x, y: 1 + 2 * (x / (y + 1))**2 * (3 - 2 * x / (y + 1))),
    "step5": (lambda x, y: h.step5(x, 0., 1., 1., y), lambda x, y: 1 + (y - 1) * x**3 * (10 - 15 * x + 6 * x * x)),
    "table": (lambda x, y: h.spline(*TABLE)(x - y) * x, lambda x, y: h.spline(*TABLE)(x - y) * x),
    "callback": (lambda x, y: h.callback(lambda u, v: math.sin(u) * v, x, y * y), lambda x, y: math.sin(x) * y * y),
    "callback with gradient": (lambda x, y: h.callback(lambda u, v: math.sin(u) * v, x, y * y, gradient=lambda u, v: (math.cos(u) * v, math.sin(u))),
                               lambda x, y: math.sin(x) * y * y),
}


def cases():
    for name, f in ONE.items():
        yield name, (lambda x, y, name=name: getattr(h, name)(x * y)), (lambda x, y, f=f: f(x * y))
    for name, f in TWO.items():
        yield name, (lambda x, y, name=name: getattr(h, name)(x, 2 * y)), (lambda x, y, f=f: f(x, 2 * y))
    for name, (f, plain) in MIXED.items():
        yield name, f, plain or f


class Operations(unittest.TestCase):
    def test_values_and_derivatives(self):
        """Forward differentiation in C++, symbolic differentiation, and differences agree"""
        for (name, f, plain), point in itertools.product(cases(), ((0.31, 0.72), (0.62, 0.23))):
            keep = []
            formula = trace(f, 2, name)
            tape = compile_tape([formula], {}, keep, 2)
            x = np.array(point)
            value, gradient = tape.differentiate(x)
            self.assertAlmostEqual(value, float(plain(*x)), delta=1e-14 * (1 + abs(value)), msg=name)
            self.assertAlmostEqual(tape(x)[0], value, delta=1e-14 * (1 + abs(value)), msg=name)
            for k in range(2):
                e = np.eye(2)[k] * 1e-5
                slope = (plain(*(x + e)) - plain(*(x - e))) / 2e-5
                self.assertAlmostEqual(gradient[k], slope, delta=2e-8 * (1 + abs(slope)), msg=name)
            if "callback" in name:
                continue
            d = differentiate([formula], [0, 1])
            symbolic = [compile_tape([d[0, k]], {}, keep, 2)(x)[0] if (0, k) in d else 0. for k in range(2)]
            np.testing.assert_allclose(symbolic, gradient, rtol=1e-12, atol=1e-13, err_msg=name)

    def test_derivatives_where_roots_are_zero(self):
        """As the kernels have them: drag, |v| v by a square root, from rest"""
        drag = h.solve_mechanism(lambda t, q, v, a: [a[0] + np.sqrt(v[0] * v[0] + v[1] * v[1]) * v[0], a[1] + 9.81 + np.sqrt(v[0] * v[0] + v[1] * v[1]) * v[1]],
                                 (0, 2), [0, 0], [0, 0], rtol=1e-7, atol=1e-7, trace=True)
        self.assertTrue(drag.success, drag.message)
        self.assertAlmostEqual(drag.q[1, -1], -np.log(np.cosh(np.sqrt(9.81) * 2)), delta=1e-4)
        for f in (lambda x: abs(x) ** 0.5 * x, lambda x: x * (x * x) ** 0.25):
            still = h.solve_mechanism(lambda t, q, v, a: [a[0] + f(q[0])], (0, 1), [0], [0], trace=True)
            self.assertTrue(still.success, still.message)

    def test_differences(self):
        """A callback without derivatives: arguments in any unit, tables, kinks, short humps, noise; four calls for each argument where it is smooth"""
        def slope(f, x):
            count = [0]

            def counted(u):
                count[0] += 1
                return f(u)
            tape = compile_tape([h.callback(counted, Expression("argument", (), 0))], {}, keep := [], 1)
            return tape.differentiate(np.array([x]))[1][0], count[0]

        for unit in (1e6, 1., 1e-3, 1e-6, 1e-9):
            for x in (0., 0.3, 1., 2.):
                self.assertAlmostEqual(slope(lambda u: (7 if unit <= 1 else 0) + math.sin(u / unit), x * unit)[0] * unit, math.cos(x), delta=1e-5, msg=str((unit, x)))
                self.assertAlmostEqual(slope(lambda u: math.tanh(u / unit), x * unit)[0] * unit, 1 - math.tanh(x)**2, delta=1e-5, msg=str((unit, x)))
            grid = np.linspace(-5, 5, 101)
            self.assertAlmostEqual(slope(lambda u: np.interp(u / unit, grid, grid**2), 0.43 * unit)[0] * unit, 0.9, delta=1e-6)
            self.assertAlmostEqual(slope(lambda u: max(u / unit, 0.)**1.5, 0.4 * unit)[0] * unit, 1.5 * 0.4**0.5, delta=1e-5)
            self.assertAlmostEqual(slope(lambda u: max(0., 1 - abs(u / unit)), 0.4 * unit)[0] * unit, -1., delta=1e-5)
        self.assertLess(abs(slope(lambda u: u * math.sqrt(abs(u)), 0.)[0]), 1e-5)
        for x, scale in itertools.product((0.2, 0.7, 3.), (1., 1e6)):
            self.assertEqual(slope(lambda u: 3 + scale * math.sin(u), x)[1], 5)
        for size, kept in ((1e-13, 1e-6), (1e-10, 1e-3), (1e-8, 2e-2)):
            noise = np.random.default_rng(5)
            for x in (0.2, 0.7, 3.):
                found, count = slope(lambda u: math.sin(u) + size * noise.standard_normal(), x)
                self.assertAlmostEqual(found, math.cos(x), delta=kept)
        self.assertAlmostEqual(slope(lambda u: float(np.float32(math.sin(u))), 0.7)[0], math.cos(0.7), delta=0.05)
        self.assertTrue(math.isnan(slope(lambda u: math.nan, 0.7)[0]))

    def test_time_derivatives(self):
        """First and second derivatives of traced functions of time"""
        for f in (lambda t: np.sin(3 * t) * t, lambda t: h.step5(t, 0., 1., 2., 3.), lambda t: h.spline(*TABLE)(t * t), lambda t: h.where(t > 0.5, t**3, t),
                  lambda t: h.exp(-t) / (1 + t), h.harmonic(2., 3., 0.1, 0.2), h.polynomial([1, 2, 3]), h.time()**2):
            g = time_function(f, [])
            for t in (0.3, 0.8):
                y, d = g(t), 1e-4
                self.assertAlmostEqual(y[1], (g(t + d)[0] - g(t - d)[0]) / (2 * d), delta=2e-6)
                self.assertAlmostEqual(y[2], (g(t + d)[1] - g(t - d)[1]) / (2 * d), delta=2e-6)

    def test_time_values(self):
        """A function that gives its own derivatives, in a motion; one that gives two numbers is told"""
        f = h.time_values(lambda t: (t**3, 3 * t**2, 6 * t))
        self.assertEqual(time_function(f, [])(2.), (8., 12., 12.))
        scene = h.Scene()
        b = scene.add("b", h.PointMass(mass=2.))
        rail = scene.ground.marker()
        drive = scene.add("drive", h.TranslationalMotion(b.marker(), rail, f, axis=0))
        scene.channel("x", h.displacement(b.marker(), 0))
        scene.channel("force", h.joint_force(drive, 0))
        run = scene.solve(1., tolerance=1e-8)
        self.assertAlmostEqual(run["x"][-1], 1., delta=1e-9)
        self.assertAlmostEqual(run.sample()["force"], 12., delta=1e-2)
        short = h.time_values(lambda t: (t, 1.))
        with self.assertRaisesRegex(RuntimeError, "must return its value and its first and second derivative"):
            time_function(short, [])(0.5)

    def test_numpy(self):
        """numpy's functions, mixed arrays, matrix products"""
        def f(x, y):
            v = np.array([x, y])
            M = np.array([[2., 1.], [0.5, 3.]])
            return v @ (M @ v) + np.sum(np.sin(v)) + np.dot(M[0], v) * x - np.float64(2) * np.arctan2(x, y)

        tape = compile_tape([trace(f, 2, "f")], {}, [], 2)
        self.assertAlmostEqual(tape(np.array([0.3, 0.4]))[0], f(0.3, 0.4), delta=1e-15)

    def test_sharing_and_constants(self):
        """What is written twice is evaluated once; what is known is computed at once"""
        f = trace(lambda x, y: h.sin(x * y) + 2 * h.sin(x * y) + 0 * y + (h.cos(0.) - 1), 2, "f")
        self.assertLessEqual(len(compile_tape([f], {}, [], 2)), 7)
        self.assertEqual(h.sin(0.5), math.sin(0.5))
        np.testing.assert_allclose(np.asarray(h.sqrt(np.array([1., 4.])), dtype=float), [1, 2])

    def test_all_operations_are_known(self):
        """Each operation of the C++ part is one that some formula above uses"""
        used = set()
        for _, f, _ in cases():
            used |= {n.op for n in ordered([trace(f, 2, "f")])}
        beside = {"parameter", "table_rate", "table_curvature"}
        self.assertEqual(set(_core.operations) - used - beside, set())


class Arrays(unittest.TestCase):
    def test_of_numbers(self):
        """Arrays and lists of numbers give arrays of numbers"""
        for y, expected in ((h.sin([0., 1.]), np.sin([0., 1.])), (h.maximum((1, 5), 3), [3, 5]), (h.hypot(np.array([[3.], [5.]]), [4., 12.]), np.hypot([[3], [5]], [4, 12])),
                            (h.where(np.array([True, False]), 1., [2., 3.]), [1., 3.]), (h.step([-1, 0.5, 2], 0, 1., 1, 3.), [1, 2, 3]),
                            (h.step5(np.array([0.5]), 0, 0, 1, 1), [0.5])):
            self.assertEqual(np.asarray(y).dtype, float)
            np.testing.assert_allclose(y, expected)
        for y, expected in ((h.where(True, 1, 2), 1), (h.step(0.5, 0, 0, 1, 1), 0.5), (h.cos(0), 1), (h.sqrt(np.float64(4)), 2)):
            self.assertIsInstance(y, float)
            self.assertEqual(y, expected)

    def test_of_formulas(self):
        solve = lambda f, **k: h.solve_mechanism(lambda t, q, v, a: f(q) + a, (0, 1), [1., -0.5], [0., 0.], **k).q[:, -1]
        for f, plain in ((lambda q: h.where([x > 0 for x in q], q, 2 * q), lambda q: np.where(q > 0, q, 2 * q)), (lambda q: h.maximum(q, 0.), lambda q: np.maximum(q, 0.)),
                         (lambda q: h.step(q, -1, 0, [1., 2.], 1), lambda q: np.array([h.step(q[0], -1, 0, 1, 1), h.step(q[1], -1, 0, 2, 1)])),
                         (lambda q: h.arctan2(1., q + 2), lambda q: np.arctan2(1., q + 2))):
            np.testing.assert_allclose(solve(f, trace=True), solve(plain), atol=1e-6)
        for f, word in ((lambda q: np.maximum(q, 0.), r"hhtdae\.maximum\(\)"), (lambda q: np.fabs(q), "hhtdae's functions"), (lambda q: np.arctan2(1., q), "hhtdae's functions")):
            with self.assertRaisesRegex(TypeError, word):
                solve(f, trace=True)

    def test_tables_in_constraints(self):
        """A bead on a curve that is a table; the forces of its constraint have the table's second derivative"""
        x = np.linspace(-2, 2, 41)
        curve = h.spline(x, 0.5 * x**2)
        solve = lambda **k: h.solve_mechanism(lambda t, q, v, a: [a[0], a[1] + 9.81], (0, 1), [1., curve(1.)], [0, 0], constraints=lambda t, q: [q[1] - curve(q[0])], **k)
        np.testing.assert_allclose(solve(trace=True).q[:, -1], solve().q[:, -1], atol=1e-5)


class Mistakes(unittest.TestCase):
    def test_what_cannot_be_traced_says_what_to_do(self):
        for f, word in ((lambda x: 1 if x > 0 else 2, "where"), (lambda x: math.sin(x), "math"), (lambda x: max(x, 1), "maximum"),
                        (lambda x: "three", "no number"), (lambda x: np.floor(x), "floor")):
            with self.assertRaises(TypeError) as caught:
                trace(f, 1, "the law")
            self.assertIn(word, str(caught.exception))

    def test_parameters_are_not_frozen(self):
        """Where a formula of parameters cannot follow them it is refused"""
        scene = h.Scene()
        p = scene.parameter("p", 0.)
        b = scene.add("b", h.RigidBody())
        for freeze in (lambda: math.cos(p), lambda: float(2 * p), lambda: h.axes_along((h.sin(p), h.cos(p), 0)),
                       lambda: scene.connect("pin", h.Revolute, b, scene.ground, (0, 0, 0), axis=(h.sin(p), h.cos(p), 0))):
            with self.assertRaisesRegex(TypeError, "frozen at its present value"):
                freeze()

    def test_functions_of_time(self):
        with self.assertRaisesRegex(ValueError, "must increase"):
            h.spline([0, 0], [1, 2])
        with self.assertRaisesRegex(ValueError, "must end after it begins"):
            h.step(h.time(), 1., 0., 1., 2.)
        scene = h.Scene()
        b = scene.add("b", h.PointMass())
        with self.assertRaisesRegex(TypeError, "not of other measures"):
            time_function(h.displacement(b.marker(), 0), [])
        with self.assertRaisesRegex(ValueError, "component"):
            h.displacement(b.marker(), "w")


if __name__ == "__main__":
    unittest.main()
