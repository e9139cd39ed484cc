"""The integrator on petsc4py's TS, and solve_mechanism: order, agreement of traced and called equations, output, events, messages."""

import math
import os
import pickle
import tempfile
import unittest

import numpy as np
from petsc4py import PETSc

import hhtdae as h
from hhtdae import integrator

G = 9.81


def residual(t, q, v, a):
    return [a[0], a[1] + G]


def rod(t, q):
    return [q[0]**2 + q[1]**2 - 1]


def angle_at(end, begin=math.pi / 2):
    """Angle from the vertical and its rate, by the classical Runge-Kutta method: 20,000 steps leave rounding"""
    n, p, w = 20000, begin, 0.
    s = end / n
    for _ in range(n):
        k1 = w, -G * math.sin(p)
        k2 = w + s / 2 * k1[1], -G * math.sin(p + s / 2 * k1[0])
        k3 = w + s / 2 * k2[1], -G * math.sin(p + s / 2 * k2[0])
        k4 = w + s * k3[1], -G * math.sin(p + s * k3[0])
        p += s / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        w += s / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
    return p, w


def pendulum(**options):
    return h.solve_mechanism(residual, (0, 2), [1, 0], [0, 0], constraints=rod, **options)


class Pendulum(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.angle, cls.rate = angle_at(2.)

    def error(self, s):
        return max(abs(s.q[0, -1] - math.sin(self.angle)), abs(s.q[1, -1] + math.cos(self.angle)))

    def test_order(self):
        """A hundredth of the tolerance makes the error of a method of order two about 100^(2/3) = 21 times smaller"""
        errors = [self.error(pendulum(rtol=tol, atol=tol, trace=True)) for tol in (1e-5, 1e-7, 1e-9)]
        self.assertLess(errors[2], 1e-5)
        for coarse, fine in zip(errors, errors[1:]):
            self.assertGreater(coarse / fine, 10)
            self.assertLess(coarse / fine, 60)

    def test_called_traced_and_given(self):
        """Differences, exact derivatives by hand, and traced equations: the same steps to rounding of differences"""
        jacobian = lambda t, q, v, a: (np.zeros((2, 2)), np.zeros((2, 2)), np.eye(2))
        runs = [pendulum(), pendulum(trace=True), pendulum(jacobian=jacobian, constraint_jacobian=lambda t, q: [2 * q])]
        for s in runs:
            self.assertTrue(s.success)
            self.assertLess(abs(s.statistics.steps - runs[0].statistics.steps), 5)
            np.testing.assert_allclose(s.q[:, -1], runs[0].q[:, -1], atol=2e-6)
            tension = self.rate**2 + G * math.cos(self.angle)  # the rod pulls with 2 lambda per unit of length
            self.assertAlmostEqual(2 * s.multipliers[0, -1], tension, delta=2e-2)

    def test_output(self):
        times = [0., 0.25, 1., 1.7, 2.]
        s = pendulum(t_eval=times, dense_output=True, trace=True)
        np.testing.assert_array_equal(s.t, times)
        self.assertEqual((s.q.shape, s.v.shape, s.a.shape, s.multipliers.shape), ((2, 5), (2, 5), (2, 5), (1, 5)))
        np.testing.assert_allclose(s.sol(s.t), s.q, atol=1e-6)
        np.testing.assert_allclose(s.sol.velocity(s.t), s.v, atol=2e-4)
        self.assertEqual(s.sol(0.3).shape, (2,))
        np.testing.assert_allclose(np.sum(s.q * s.v, axis=0), 0, atol=5e-4)
        np.testing.assert_allclose(s.a[0] + 2 * s.q[0] * s.multipliers[0], 0, atol=1e-4)  # as far as the corrector goes
        with self.assertRaisesRegex(ValueError, "known from"):
            s.sol(2.5)
        self.assertIn("statistics", repr(s))
        again = pickle.loads(pickle.dumps(s))
        np.testing.assert_array_equal(again.q, s.q)
        self.assertEqual(again.statistics, s.statistics)
        np.testing.assert_array_equal(again.sol(0.3), s.sol(0.3))

    def test_events(self):
        """The bottom is passed at a quarter of the period, 4 K(1/2) / sqrt(g); the ends of the swing are where the velocity is zero"""
        agm, b = 1., math.cos(math.pi / 4)
        for _ in range(6):
            agm, b = (agm + b) / 2, math.sqrt(agm * b)
        period = 2 * math.pi / agm / math.sqrt(G)
        bottom = lambda t, q, v: q[0]
        turn = lambda t, q, v: q[0] * v[1] - q[1] * v[0]
        s = pendulum(events=[bottom, turn], rtol=1e-8, atol=1e-8, trace=True)
        self.assertAlmostEqual(s.t_events[0][0], period / 4, delta=1e-5)
        self.assertAlmostEqual(s.t_events[1][-1], period / 2, delta=1e-4)
        np.testing.assert_allclose(s.q_events[0][0], [0, -1], atol=1e-5)
        bottom.terminal = True
        s = pendulum(events=bottom, rtol=1e-8, atol=1e-8, trace=True)
        self.assertEqual(s.status, 1)
        self.assertAlmostEqual(s.t[-1], period / 4, delta=1e-5)

    def test_events_that_are_conditions(self):
        """Passages of truth values are found both ways, upwards where they become true, as of scenes"""
        times = math.pi * (np.arange(6) + 0.5)
        for kind in (bool, np.bool_, np.array):
            events = [lambda t, q, v: kind(q[0] < 0) for _ in range(3)]
            events[1].direction, events[2].direction = 1, -1
            s = h.solve_mechanism(lambda t, q, v, a: [a[0] + q[0]], (0, 20), [1], [0], rtol=1e-8, atol=1e-8, events=events)
            for found, exact in zip(s.t_events, (times, times[::2], times[1::2])):
                np.testing.assert_allclose(found, exact, atol=1e-3)

    def test_sparse_jacobians(self):
        """Matrices of SciPy are as good as arrays"""
        try:
            from scipy import sparse
        except ImportError:
            self.skipTest("no scipy")
        given = lambda kind: pendulum(jacobian=lambda t, q, v, a: (kind((2, 2)), kind((2, 2)), kind(np.eye(2))), constraint_jacobian=lambda t, q: kind([2 * q]))
        plain = given(lambda x: np.zeros(x) if isinstance(x, tuple) else np.array(x))
        for kind in (sparse.csr_matrix, sparse.coo_matrix, sparse.csc_array):
            np.testing.assert_array_equal(given(kind).q, plain.q)

    def test_many_events_in_one_step(self):
        """A stone, whose fall takes few steps: all heights are found, in order, each where it is; the first terminal one ends the run"""
        heights = [0.9, 0.89, 0.5, 0.2, 0.1]
        events = [(lambda t, q, v, z=z: q[0] - z) for z in heights]
        events[3].terminal = True
        s = h.solve_mechanism(lambda t, q, v, a: [a[0] + G], (0, 1), [1.], [0.], events=events)
        for z, found in zip(heights[:4], s.t_events):
            np.testing.assert_allclose(found, [math.sqrt(2 * (1 - z) / G)], rtol=1e-9)
        self.assertEqual(len(s.t_events[4]), 0)
        self.assertEqual(s.t[-1], s.t_events[3][0])
        self.assertLess(s.statistics.steps, 30)

    def test_settings(self):
        s = pendulum(max_step=1e-3, first_step=1e-4, trace=True)
        self.assertLessEqual(s.statistics.h_max, 1e-3 * (1 + 1e-9))
        self.assertGreaterEqual(s.statistics.steps, 2000)
        s = pendulum(options={"ts_adapt_type": "none", "ts_dt": 0.01}, trace=True)
        self.assertEqual(s.statistics.steps, 200)
        self.assertFalse(PETSc.Options().hasName("ts_adapt_type"))
        s = pendulum(options={"ts_max_steps": 5}, trace=True)
        self.assertEqual((s.status, s.statistics.steps), (-1, 5))
        self.assertIn("largest number of steps", s.message)

    def test_projection(self):
        s = h.solve_mechanism(residual, (0, 0.1), [1.001, 0], [0.1, 0], constraints=rod, trace=True)
        self.assertAlmostEqual(s.q[0, 0], 1., delta=1e-9)
        self.assertAlmostEqual(s.v[0, 0], 0., delta=1e-9)

    def test_velocity_constraints(self):
        """A blade on a slope, which turns at a constant rate w: x = s sin(w t)^2, y = s (w t - sin(2 w t) / 2) with s = g / (2 w^2), down the slope and across"""
        g, w = 3., 2.
        motion = lambda t, q, v, a: [a[0] - g, a[1], 0.1 * a[2]]
        blade = lambda t, q, v: [v[1] * np.cos(q[2]) - v[0] * np.sin(q[2])]
        for trace in (False, True):
            s = h.solve_mechanism(motion, (0, 3), [0, 0, 0], [0, 0, w], velocity_constraints=blade, rtol=1e-8, atol=1e-8, trace=trace)
            self.assertTrue(s.success)
            x = w * s.t
            np.testing.assert_allclose(s.q, g / (2 * w * w) * np.array([np.sin(x)**2, x - np.sin(2 * x) / 2, x * 2 * w * w / g]), atol=5e-5)
            self.assertEqual(s.multipliers.shape[0], 1)
            self.assertAlmostEqual(blade(0, s.q[:, -1], s.v[:, -1])[0], 0, delta=1e-7)
        both = h.solve_mechanism(motion, (0, 1), [0, 0, 0], [0, 0, w], velocity_constraints=blade, constraints=lambda t, q: [q[2] - w * t], trace=True)
        np.testing.assert_allclose(both.q[0, -1], g / (2 * w * w) * np.sin(w)**2, atol=5e-4)
        self.assertEqual(both.multipliers.shape[0], 2)

    def test_scipy_manner_without_constraints(self):
        s = h.solve_mechanism(lambda t, q, v, a, k: a + k * q, (0, 1), [1.], [0.], args=(4.,), rtol=1e-9, atol=1e-9, trace=True)
        self.assertAlmostEqual(s.q[0, -1], math.cos(2.), delta=1e-5)
        self.assertEqual(s.multipliers.shape[0], 0)


class Mistakes(unittest.TestCase):
    def test_messages(self):
        for call, kind, text in (
                (lambda: h.solve_mechanism(residual, (2, 1), [1, 0], [0, 0]), ValueError, "end must come after"),
                (lambda: h.solve_mechanism(residual, (0, 1), [1, 0], [0]), ValueError, "q0 has 2 numbers and v0 1"),
                (lambda: h.solve_mechanism(lambda t, q, v, a: [1.], (0, 1), [1, 0], [0, 0]), ValueError, "residual"),
                (lambda: pendulum(t_eval=[1, 0.5]), ValueError, "must increase"),
                (lambda: h.solve_mechanism(lambda t, q, v, a: [a[0] if q[0] > 0 else a[1], a[1]], (0, 1), [1, 0], [0, 0], trace=True), TypeError, "where"),
                (lambda: pendulum(jacobian=lambda t, q, v, a: (1, 2, 3)), ValueError, "jacobian")):
            with self.assertRaisesRegex(kind, text):
                call()

    def test_exception_of_the_users(self):
        def broken(t, q, v, a):
            if t > 0.5:
                raise ZeroDivisionError("at half a second")
            return residual(t, q, v, a)
        with self.assertRaisesRegex(ZeroDivisionError, "half a second"):
            h.solve_mechanism(broken, (0, 1), [1, 0], [0, 0], constraints=rod)

        def half_way(t, q, v, a):
            if q[0] < 0.5:
                raise ZeroDivisionError("half way")
            return [a[0] + q[0]]
        for options in ({}, {"ts_error_if_step_fails": 0}):  # without an error of PETSc's, too
            with self.assertRaisesRegex(ZeroDivisionError, "half way"):
                h.solve_mechanism(half_way, (0, 2), [1.], [0.], max_step=0.1, options=options)

    def test_failure_is_a_result(self):
        """Forces that become infinite in finite time: what was reached, and why it went no further"""
        s = h.solve_mechanism(lambda t, q, v, a: [a[0] - 6 * q[0]**2], (0, 2), [1.], [2.], trace=True, options={"ts_max_reject": 20, "ts_max_snes_failures": 20})
        self.assertFalse(s.success)
        self.assertEqual(s.status, -1)
        self.assertRegex(s.message, "has failed at t = .*No step from t = ")
        self.assertLess(s.t[-1], 1.01)  # q = 1/(1 - t)^2
        self.assertGreater(s.t[-1], 0.9)


class OnTS(unittest.TestCase):
    def make(self):
        """Two masses on springs, and a rod between them that keeps their distance: x1, x2, lambda"""
        def f(ts, t, u, v, a, out):
            out.array = [a[0] + 100 * u[0] + u[2], 2 * a[1] - u[2], u[0] - u[1] + 1]

        def J(ts, t, u, v, a, sv, sa, J, P):
            P.setValues(range(3), range(3), [sa + 100, 0, 1, 0, 2 * sa, -1, 1, -1, 0])
            P.assemble()
            return True

        A = PETSc.Mat().createAIJ([3, 3], nnz=3, comm=PETSc.COMM_SELF)
        A.setValues(range(3), range(3), np.zeros(9))
        A.assemble()
        u, v = A.createVecRight(), A.createVecRight()
        u.array, v.array = [0.1, 1.1, 0], [0, 0, 0]
        ts = PETSc.TS().create(comm=PETSc.COMM_SELF)
        ts.setType("hhtdae")
        ts.setI2Function(f, u.duplicate())
        ts.setI2Jacobian(J, A)
        ts.setSolution2(u, v)
        ts.setMaxTime(1.)
        ts.setMaxSteps(10**6)
        ts.setExactFinalTime(PETSc.TS.ExactFinalTime.MATCHSTEP)
        ts.setTolerances(rtol=1e-8, atol=1e-8)
        return ts, u

    def test_setters_and_results(self):
        ts, u = self.make()
        integrator.set_alpha(ts, -0.1)
        integrator.set_form(ts, "second_order")
        self.assertEqual((integrator.get_alpha(ts), integrator.get_form(ts)), (-0.1, "second_order"))
        integrator.set_corrector_tolerance(ts, 1e-3)
        integrator.set_predictor_degree(ts, 2)
        integrator.set_reuse(ts, 2., 0.3, 1.2)
        integrator.set_start(ts, "project")
        integrator.set_role(ts, "coordinate", [0, 1])
        integrator.set_role(ts, "holonomic", [2])
        np.testing.assert_array_equal(integrator.get_role(ts, "holonomic").indices, [2])
        integrator.set_step_limit(ts, lambda ts, t, u, v, a: 0.005)
        seen = []
        integrator.set_coordinate_change(ts, lambda ts, t, u, v: seen.append(t) or False, lambda ts, t, u, v, a: None)
        ts.solve(u)
        w = math.sqrt(100 / 3.)
        self.assertAlmostEqual(u[0], 0.1 * math.cos(w), delta=1e-5)
        s = h.statistics(ts)
        self.assertEqual(s.steps, ts.getStepNumber())
        self.assertLessEqual(s.h_max, 0.005 * (1 + 1e-12))
        self.assertGreater(len(seen), 100)
        a = integrator.get_acceleration(ts)
        self.assertAlmostEqual(a[0], -w * w * u[0], delta=1e-3)
        t = ts.getTime() - 0.3 * ts.getTimeStep()
        q, v, _ = integrator.interpolate(ts, t)
        self.assertAlmostEqual(q[0], 0.1 * math.cos(w * t), delta=1e-5)
        q, v, a = integrator.evaluate_at(ts, t)
        self.assertAlmostEqual(q[2], 2 * a[1], delta=1e-9)
        self.assertAlmostEqual(v[1], -0.1 * w * math.sin(w * t), delta=1e-4)

    def test_checkpoint_vec(self):
        """It comes back with the state; None takes it out of checkpoints"""
        own = PETSc.Vec().createSeq(2, comm=PETSc.COMM_SELF)
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "checkpoint")
            ts, u = self.make()
            own.array = [3, 4]
            integrator.set_checkpoint_vec(ts, own)
            ts.setMaxTime(0.5)
            ts.solve(u)
            integrator.checkpoint_save(ts, file)
            own.array = [0, 0]
            again, x = self.make()
            integrator.set_checkpoint_vec(again, own)
            again.setUp()
            integrator.checkpoint_load(again, file)
            np.testing.assert_array_equal(own.array, [3, 4])
            np.testing.assert_array_equal(x.array, u.array)
            self.assertEqual(again.getTime(), ts.getTime())
            integrator.set_checkpoint_vec(again, None)
            with self.assertRaises(PETSc.Error):
                integrator.checkpoint_load(again, file)

    def test_radius(self):
        ts, u = self.make()
        integrator.set_radius(ts, 0.8)
        ts.solve(u)
        self.assertAlmostEqual(u[0], 0.1 * math.cos(math.sqrt(100 / 3.)), delta=1e-5)

    def test_order(self):
        """Steps of higher order, fewer of them, and counted by their order"""
        steps = {}
        for order in (2, 4, "auto"):
            ts, u = self.make()
            integrator.set_order(ts, order)
            self.assertEqual(integrator.get_order(ts), order)
            ts.solve(u)
            self.assertAlmostEqual(u[0], 0.1 * math.cos(math.sqrt(100 / 3.)), delta=1e-5)
            s = h.statistics(ts)
            self.assertEqual(sum(s.of_order), s.steps)
            steps[order] = s
        self.assertEqual(steps[2].of_order[1:], (0, 0, 0))
        self.assertGreater(steps[4].of_order[2], 0.5 * steps[4].steps)
        self.assertLess(max(steps[4].steps, steps["auto"].steps), 0.5 * steps[2].steps)
        with self.assertRaisesRegex(ValueError, "'auto'"):
            integrator.set_order(ts, 6)

    def test_nodes(self):
        """Three masses on springs, said to be the unknowns of one node, under the preconditioner for nodes and constraints"""
        A = PETSc.Mat().createAIJ([3, 3], nnz=3, comm=PETSc.COMM_SELF)
        A.setValues(range(3), range(3), np.zeros(9))
        A.assemble()
        k = np.diag([1., 4., 9.])

        def J(ts, t, u, v, a, sv, sa, J, P):
            P.setValues(range(3), range(3), sa * np.eye(3) + k)
            P.assemble()
            return True

        def f(ts, t, u, v, a, out):
            out.array = a.array_r + k @ u.array_r

        u, v, X = (A.createVecRight() for _ in range(3))
        u.array = 1.
        ts = PETSc.TS().create(comm=PETSc.COMM_SELF)
        ts.setType("hhtdae")
        ts.setI2Function(f, u.duplicate())
        ts.setI2Jacobian(J, A)
        ts.setSolution2(u, v)
        integrator.set_nodes(ts, [[0, 1, 2]], X)
        integrator.set_nodes(ts, None)
        integrator.set_nodes(ts, [[0, 1, 2]])
        ts.setMaxTime(1.)
        ts.setTolerances(rtol=1e-7, atol=1e-7)
        ts.getSNES().getKSP().setType("cg")
        ts.getSNES().getKSP().getPC().setType("hhtconstraint")
        ts.solve(u)
        np.testing.assert_allclose(integrator.interpolate(ts, 1.)[0].array, np.cos([1., 2., 3.]), atol=1e-4)
        integrator.set_nodes(ts, [])
        with self.assertRaises(h.Error):
            integrator.set_nodes(ts, [[0, 1]], X)

    def test_units_of_length(self):
        """Multipliers of the first steps of a swing through the lowest point, in metres, millimetres and micrometres"""
        for unit in 1., 1e3, 1e6:
            solution = h.solve_mechanism(lambda t, q, v, a: [a[0], a[1] + 9.81 * unit], (0, 0.05), [0, -unit], [5 * unit, 0],
                                         constraints=lambda t, q: [q[0]**2 + q[1]**2 - unit**2], trace=True)
            height = 1 + solution.q[1] / unit
            expected = (25 - 2 * 9.81 * height + 9.81 * (1 - height)) / 2  # (v^2 - g y)/(2 L^2), v by the energy
            np.testing.assert_allclose(solution.multipliers[0], expected, rtol=1e-2)
            self.assertAlmostEqual(solution.multipliers[0][0], expected[0], delta=1e-6)

    def test_rotations(self):
        """A sphere that turns freely: its attitude after two turns and a bit, gathered by the functions that take references"""
        def turn(x):
            angle = np.linalg.norm(x)
            return h.rotation(x, angle) if angle > 0 else np.eye(3)

        now, before, factors = [np.eye(3)], [np.eye(3)], []

        def refer(ts, u):
            before[0] = now[0]
            now[0] = turn(u.array_r) @ now[0]
            u.set(0)

        def back(ts):
            now[0] = before[0]

        def J(ts, t, u, v, a, sv, sa, J, P):
            factors.append(integrator.get_rotation_factor(ts)[0])
            P.zeroEntries()
            P.shift(sa)
            return True

        A = PETSc.Mat().createAIJ([3, 3], nnz=1, comm=PETSc.COMM_SELF)
        for k in range(3):
            A.setValue(k, k, 0.)
        A.assemble()
        u, v = A.createVecRight(), A.createVecRight()
        w = np.array([4., -7., 10.])
        v.array = w
        ts = PETSc.TS().create(comm=PETSc.COMM_SELF)
        ts.setType("hhtdae")
        ts.setI2Function(lambda ts, t, u, v, a, f: a.copy(f), u.duplicate())
        ts.setI2Jacobian(J, A)
        ts.setSolution2(u, v)
        ts.setMaxTime(1.)
        ts.setExactFinalTime(PETSc.TS.ExactFinalTime.MATCHSTEP)
        integrator.set_rotations(ts, [0], refer, back)
        integrator.set_step_limit(ts, lambda *state: 0.05)
        ts.solve(u)
        np.testing.assert_allclose(turn(ts.getSolution().array_r) @ now[0], turn(w), atol=1e-9)
        self.assertGreaterEqual(ts.getStepNumber(), 20)
        self.assertGreater(max(factors), 0)

    def test_wrong_values(self):
        ts, _ = self.make()
        with self.assertRaisesRegex(h.Error, "alpha"):
            integrator.set_alpha(ts, 3.)
        with self.assertRaisesRegex(ValueError, "must be one of coordinate"):
            integrator.set_role(ts, "pendulum", [0])
        with self.assertRaisesRegex(ValueError, "second_order"):
            integrator.set_form(ts, "third_order")
        with self.assertRaises(TypeError):
            integrator.set_alpha("no TS", 0.)


if __name__ == "__main__":
    unittest.main()
