"""solve_mechanism: the scale of its differences, and what it says of arguments and functions that are wrong."""

import math
import os
import tempfile
import unittest
import warnings

import numpy as np

import hhtdae as h

G = 9.81


def swing(length, trace=False, **options):
    """A pendulum whose constraint is a distance, with the same period at every length"""
    root = h.sqrt if trace else math.sqrt
    return h.solve_mechanism(lambda t, q, v, a: [a[0], a[1] + G * length], (0, 1), [length, 0], [0, 0], constraints=lambda t, q: [root(q[0]**2 + q[1]**2) - length],
                             rtol=1e-7, atol=1e-7 * length, trace=trace, **options)


def stone(residual=lambda t, q, v, a: [a[0], a[1] + G], q0=(1., 0.), **options):
    return h.solve_mechanism(residual, (0, 1), q0, [0, 0], **options)


class Scales(unittest.TestCase):
    def test_lengths(self):
        """A millionth of a metre and a thousand kilometres: the motion is that of exact derivatives"""
        for length in (1e-6, 1e-3, 1., 1e6):
            a, b = swing(length), swing(length, trace=True)
            self.assertTrue(a.success, a.message)
            np.testing.assert_allclose(a.q[:, -1] / length, b.q[:, -1] / length, atol=3e-6)
            self.assertLess(a.statistics.newton, 1.2 * b.statistics.newton)

    def test_kinks(self):
        from hhtdae.differences import scales

        np.testing.assert_array_equal(scales(lambda x: np.array([abs(x[0]), x[1]**3]), [0., 0.2]), [1., 1.])
        self.assertLess(scales(lambda x: np.tanh(x / 1e-4), [0.])[0], 1e-2)


    def test_accelerations(self):
        """An oscillator of 1e9 rad/s, called and traced: the differences over accelerations of 1e18 do not drown"""
        w = 1e9
        runs = [h.solve_mechanism(lambda t, q, v, a: [a[0] + w * w * q[0]], (0, 12 / w), [1.], [0.], trace=trace) for trace in (False, True)]
        for s in runs:
            self.assertTrue(s.success, s.message)
            self.assertAlmostEqual(s.q[0, -1], np.cos(12.), delta=5e-3)
        self.assertLess(abs(runs[0].statistics.steps - runs[1].statistics.steps), 5)


class Arguments(unittest.TestCase):
    def test_tolerances(self):
        for name in ("rtol", "atol", "max_step", "first_step"):
            for wrong in (-1e-6, 0, float("nan"), "1e-6", [1e-6, 1e-6], True):
                with self.assertRaisesRegex(ValueError, name + " is .*positive"):
                    stone(**{name: wrong})
        self.assertTrue(stone(rtol=np.float32(1e-5), max_step=np.int64(1)).success)

    def test_options_nobody_asks_for(self):
        scene = h.Scene()
        scene.add("mass", h.PointMass())
        for solve in (lambda **k: stone(**k), lambda **k: scene.solve(1., **k)):
            with self.assertWarnsRegex(RuntimeWarning, "-ts_hhtdae_alhpa"):
                solve(options={"ts_hhtdae_alhpa": -0.1})
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                solve(options={"-ts_hhtdae_alpha": -0.1, "ts_max_steps": 1000, "snes_max_it": 20})

    def test_options_with_values_that_cannot_be(self):
        scene = h.Scene()
        scene.add("mass", h.PointMass())
        for solve in (lambda **k: stone(**k), lambda **k: scene.solve(1., **k)):
            for name, value, says in (("ts_hhtdae_alpha", 0.5, r"^alpha = 0.5 is not in \[-1/3, 0\]$"), ("ts_hhtdae_form", "best", "^Unknown option best for -ts_hhtdae_form"),
                                      ("ksp_type", "nosuch", "nosuch$")):
                with self.assertRaisesRegex(h.Error, says):
                    solve(options={name: value})

    def test_of_runs(self):
        scene = h.Scene()
        x = h.displacement(scene.add("mass", h.PointMass()).marker(), 0)
        run, seen = scene.run(), []
        for dt in (0, -0.1, float("nan"), "a"):
            with self.assertRaisesRegex(ValueError, "dt is"):
                list(run.step_by(dt, 1.))
        with self.assertRaisesRegex(ValueError, "in parts"):
            list(run.step_by(0.1, -1.))
        for tolerance in ("1e-3", float("inf"), 0):
            with self.assertRaisesRegex(ValueError, "tolerance is"):
                scene.run(tolerance=tolerance)
        with self.assertRaisesRegex(ValueError, "direction"):
            run.event(x, direction="up")
        with self.assertRaisesRegex(TypeError, "action"):
            run.event(x, action=3)
        run.on_step(lambda r: seen.append((r.steps, r.time)))
        list(run.step_by(np.float32(0.25), np.int64(1)))
        self.assertEqual(len(seen), run.steps)
        self.assertEqual(seen[-1], (run.steps, 1.))

    def test_ends_that_are_no_times(self):
        scene = h.Scene()
        scene.add("mass", h.PointMass())
        for end in (np.inf, np.nan):
            with self.assertRaisesRegex(ValueError, "until is"):
                scene.run().solve(end)
        with self.assertRaisesRegex(ValueError, "t_span .*finite"):
            h.solve_mechanism(lambda t, q, v, a: [a[0], a[1]], (0, np.inf), [0, 0], [0, 0])

    def test_values(self):
        with self.assertRaisesRegex(ValueError, "t_eval"):
            stone(t_eval=[0, float("nan"), 1])
        with self.assertRaisesRegex(ValueError, "finite"):
            stone(q0=[np.nan, 0])

    def test_messages(self):
        """Those of the library come as hhtdae.Error, and name the acceleration without mass; those of arguments which one it is"""
        with self.assertRaisesRegex(h.Error, r"without mass.* not depend on a\[1\]$") as caught:
            stone(lambda t, q, v, a: [a[0], 0 * a[1]])
        self.assertNotIn("TSSolve", str(caught.exception))
        for call, kind, text in ((lambda: stone(events=[3]), TypeError, "event 0 is 3"), (lambda: stone(args=3), TypeError, r"args is 3.*\(3,\)"),
                                 (lambda: h.solve_mechanism(lambda t, q, v, a: a, (0, 1, 2), [1], [0]), ValueError, "t_span")):
            with self.assertRaisesRegex(kind, text):
                call()

    def test_functions(self):
        for residual, text in ((lambda t, q, v, a: [a[0], np.nan], "residual.* row 1"), (lambda t, q, v, a: None, "residual"),
                               (lambda t, q, v, a: [a[0], "x"], "residual"), (lambda t, q, v, a: a + 1j, "residual.*complex")):
            with self.assertRaisesRegex(ValueError, text):
                stone(residual)
        with self.assertRaisesRegex(ValueError, "event 0 is not a number"):
            stone(events=lambda t, q, v: np.nan)

    def test_functions_that_write_into_their_arguments(self):
        def residual(t, q, v, a):
            r = [a[0] + q[0], a[1]]
            q[:] = v[:] = 0
            return r
        s = stone(residual)
        self.assertAlmostEqual(s.q[0, 0], 1.)
        self.assertAlmostEqual(s.q[0, -1], math.cos(1), delta=1e-3)

    def test_functions_that_return_the_same_array(self):
        """An array that a function fills at every call has other numbers the next time"""
        r, phi, psi, G1, K = np.zeros(1), np.zeros(1), np.zeros(1), np.zeros((1, 2)), np.zeros((1, 1))

        def spring(t, q, v, a):
            np.add(a, q, out=r)
            return r

        def rod(t, q):
            phi[0] = q[0]**2 + q[1]**2 - 1
            return phi

        def rod_gradient(t, q):
            G1[0] = 2 * q
            return G1

        def blade(t, q, v):
            psi[0] = v[0] * np.sin(q[2]) - v[1] * np.cos(q[2])
            return psi

        def matrices(t, q, v, a):
            K[0, 0] = 1.
            return K, 0 * K, K
        for jacobian in (None, matrices):
            s = h.solve_mechanism(spring, (0, 1), [1.], [0.], jacobian=jacobian)
            self.assertAlmostEqual(s.q[0, -1], math.cos(1), delta=1e-3)
        plain = stone(constraints=lambda t, q: [q[0]**2 + q[1]**2 - 1]).q[:, -1]
        for gradient in (None, rod_gradient):
            np.testing.assert_allclose(stone(constraints=rod, constraint_jacobian=gradient).q[:, -1], plain, atol=1e-4)
        s = h.solve_mechanism(lambda t, q, v, a: [a[0], a[1], a[2]], (0, 1), [0, 0, 0], [1, 0, 0.5], velocity_constraints=blade)
        np.testing.assert_allclose(s.q[:, -1], [2 * math.sin(0.5), 2 * (1 - math.cos(0.5)), 0.5], atol=1e-3)

    def test_rows_of_messages(self):
        """Rows that depend on one another are named as those of the user's function"""
        rod = lambda t, q: q[0]**2 + q[1]**2 - 1
        with self.assertRaisesRegex(h.Error, r"in rows 2, 3 depend on one another. .* Rows 2 \(constraints\(\)\[0\]\), 3 \(constraints\(\)\[1\]\)"):
            stone(constraints=lambda t, q: [rod(t, q), 2 * rod(t, q)])
        with self.assertRaisesRegex(h.Error, r"no coordinate that can move changes the constraint in row 3 \(constraints\(\)\[1\]\)"):
            stone(constraints=lambda t, q: [rod(t, q), t - 1])

    def test_names_of_rows(self):
        def torn(row, t_torn):
            def residual(t, q, v, a):
                f = [a[0], a[1] + G]
                if t > t_torn:
                    f[row] = math.nan
                return f
            return residual

        rod = dict(constraints=lambda t, q: [q[0]**2 + q[1]**2 - 1])
        self.assertIn(r"row 1 (q[1])", stone(torn(1, 0.1), **rod).message)
        scene = h.Scene()
        mass = scene.add("weight", h.PointMass())
        scene.add("wind", h.UserForce(mass.marker(), force=(h.callback(lambda t: math.nan if t > 0.1 else 0., h.time()), 0., 0.)))
        with self.assertRaisesRegex(h.Error, r"row 0 \(x of body weight; user force wind is not a number\)"):
            scene.solve(1.)

    def test_names_in_messages(self):
        """The library's messages name Python's functions"""
        scene = h.Scene()
        k = scene.parameter("k", 1.)
        b = scene.add("b", h.PointMass(position=(1 * k, 0, 0)))
        run = scene.solve(0.1)
        for call, text in ((run.equilibrium, r"^Run.equilibrium\(\): the run has begun.* Scene.run\(after=run\)"), (lambda: scene.set(nothing=1), r"^Scene.set\(\): there is no")):
            with self.assertRaisesRegex(h.Error, text):
                call()
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "checkpoint")
            run.save(file)
            scene.set(k=2.)
            with self.assertRaisesRegex(h.Error, r"set it by Scene.set\(\) before"):
                scene.run().load(file)
        scene = h.Scene()
        m = scene.add("b", h.PointMass()).marker()
        force = scene.add("f", h.UserForce(m, force=[1., 0, 0]))
        scene.add("g", h.UserForce(m, force=[h.force(force, 0), 0, 0]))
        with self.assertRaisesRegex(h.Error, "set state=True on it"):
            scene.set_up()

    def test_jacobian(self):
        """Compared with differences at the begin: a wrong mass matrix is an error, other derivatives that are not exact a warning; kinks are nobody's mistake"""
        turn = lambda t, q, v, a: [(2 + math.cos(q[0])) * a[0] + 5 * q[0] + 3 * v[0] - v[1]**2, a[1] + a[0] + 40 * q[1]**3 + 1000.]

        def exact(t, q, v, a):
            return [[5 - math.sin(q[0]) * a[0], 0.], [0., 120 * q[1]**2]], [[3., -2 * v[1]], [0., 0.]], [[2 + math.cos(q[0]), 0.], [1., 1.]]

        def solve(change=lambda K, C, M: (K, C, M), residual=turn, jacobian=exact, q0=(0.3, 0.2), **options):
            given = lambda *state: change(*map(np.array, jacobian(*state)))
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                h.solve_mechanism(residual, (0, 0.01), q0, [0.1, 0.4], jacobian=given, **options)
            return [str(w.message) for w in caught]

        self.assertEqual(solve(), [])
        with self.assertRaisesRegex(ValueError, r"derivatives by a, dF/da, is not that of residual\(\) at t = 0: in row 1, column [01] it says 2, differences say 1"):
            solve(lambda K, C, M: (K, C, 2 * M))
        with self.assertRaisesRegex(ValueError, "dF/da.* in row 1, column 0 it says 0, differences say 1"):
            solve(lambda K, C, M: (K, C, np.diag(np.diag(M))))
        self.assertRegex(solve(lambda K, C, M: (-K, C, M))[0], r"dF/dq, is not .* in row 0, column 0 it says -5.16.*, differences say 5.16.*; corrections will")
        self.assertRegex(solve(lambda K, C, M: (K, C.T, M))[0], r"dF/dv, is not .* in row [01], column [01] it says")
        self.assertRegex(solve(lambda K, C, M: (K * [[0, 1], [1, 1]], C, M))[0], r"dF/dq, is not .* in row 0, column 0 it says 0, differences say")
        with self.assertRaisesRegex(ValueError, "dF/dq.* it says nan"):
            solve(lambda K, C, M: (K * np.nan, C, M))
        with self.assertRaisesRegex(ValueError, "must be three matrices"):
            stone(jacobian=lambda t, q, v, a: np.eye(2))
        rod = dict(constraints=lambda t, q: [q[0]**2 + q[1]**2 - 1], velocity_constraints=lambda t, q, v: [v[0] - 0.1])
        self.assertEqual(solve(residual=lambda t, q, v, a: [a[0], a[1] + G], q0=(1., 0.), jacobian=lambda t, q, v, a: (np.zeros((2, 2)), np.zeros((2, 2)), np.eye(2)),
                               constraints=rod["constraints"]), [])
        kinks = lambda t, q, v, a: [a[0] + 1e3 * max(q[0], 0) + math.copysign(1., v[0] - 0.1), a[1] + abs(v[1] - 0.4) + math.sqrt(q[1])]
        self.assertEqual(solve(residual=kinks, jacobian=lambda t, q, v, a: ([[0, 0], [0, 0.5 / math.sqrt(q[1])]], [[0, 0], [0, 1]], np.eye(2)), q0=(0., 1e-3)), [])
        for length in (1e-6, 1e3):  # the pendulum in other units
            self.assertEqual(solve(residual=lambda t, q, v, a: [a[0], a[1] + G * length + 4 / length * q[1]**2], q0=(length, 0.5 * length), constraints=lambda t, q: [q[0] - length],
                                   jacobian=lambda t, q, v, a: ([[0, 0], [0, 8 / length * q[1]]], np.zeros((2, 2)), np.eye(2)), atol=1e-6 * length), [])

    def test_constraint_jacobian(self):
        rod = dict(constraints=lambda t, q: [q[0]**2 + q[1]**2 - 1])
        self.assertTrue(stone(constraint_jacobian=lambda t, q: [2 * q], **rod).success)
        with self.assertRaisesRegex(ValueError, "row 0, column 0 it says 1, differences say 2"):
            stone(constraint_jacobian=lambda t, q: [q], **rod)
        with self.assertRaisesRegex(ValueError, "shape"):
            h.solve_mechanism(lambda t, q, v, a: a, (0, 1), [1, 0, 0], [0, 0, 0], constraints=lambda t, q: [q[0] - 1, q[1]],
                              constraint_jacobian=lambda t, q: [[1, 0], [0, 1], [0, 0]])


if __name__ == "__main__":
    unittest.main()
