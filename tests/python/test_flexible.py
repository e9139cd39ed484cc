"""Flexible bodies: mesh and matrices, reduction against beam theory, files, stress, bodies in scenes, whole models."""

import os
import pickle
import sys
import tempfile
import unittest
import warnings

import numpy as np
from petsc4py import PETSc

import hhtdae as h

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "python"))
from beam_mesh import beam_mesh, clamped_free

try:
    from hhtdae import flexible
except ImportError as error:
    print("skipped: the package was built without SLEPc:", error)
    raise SystemExit(0)

L, D, E, NU, RHO = 1., 0.05, 2e11, 0., 8000.
STEEL = flexible.Material(E, NU, RHO)
MASS = RHO * L * D * D


class Beam(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.model = flexible.FeModel.from_mesh(beam_mesh(os.path.join(cls.folder.name, "beam.msh"), L, D, D), STEEL)
        cls.body = flexible.reduce(cls.model, [flexible.Attachment("root"), flexible.Attachment("tip")], modes=6, stress=True)

    def test_model(self):
        m = self.model
        self.assertEqual((m.nodes, m.own, m.first), (128, 128, 0))
        self.assertEqual(m.coordinates.shape, (128, 3))
        self.assertLessEqual({"root", "tip"}, set(m.sets))
        np.testing.assert_array_equal(m.select(lambda x, y, z: x < 1e-9), m.sets["root"])
        self.assertEqual(m.K.getSize(), (384, 384))
        x = m.M.createVecRight()
        x.array = np.tile([1., 0, 0], m.nodes)
        self.assertAlmostEqual(x.dot(m.M * x), MASS, delta=1e-9 * MASS)
        cells = m.elements.cells()
        self.assertEqual({k: v.shape for k, v in cells.items()}, {"hexahedron20": (10, 20)})
        edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]  # VTK's order
        for cell in cells["hexahedron20"]:
            for k, (p, q) in enumerate(edges):
                np.testing.assert_allclose(m.coordinates[cell[8 + k]], (m.coordinates[cell[p]] + m.coordinates[cell[q]]) / 2, atol=1e-12)

    def test_reduction(self):
        """Mass, centre, inertia of a bar; the first mode of the body clamped in a scene against beam theory"""
        modal = self.body.modal()
        self.assertAlmostEqual(modal.mass, MASS, delta=1e-9 * MASS)
        np.testing.assert_allclose(modal.center, [0.5, 0, 0], atol=1e-9)
        self.assertAlmostEqual(modal.inertia[2, 2], MASS * (L**2 + D**2) / 12, delta=1e-6)
        np.testing.assert_allclose(modal.omega, 2 * np.pi * self.body.frequencies, rtol=1e-12)
        self.assertEqual(self.body.shape.shape, (128, 3, len(modal.omega)))
        np.testing.assert_allclose(modal.attachments["tip"], [1, 0, 0], atol=1e-9)
        self.assertLess(self.body.residuals[0], 0.1)  # that of a free beam, among modes fixed at its ends
        scene = h.Scene()
        b = scene.add("beam", h.FlexibleBody(modal))
        scene.add("clamp", h.Fixed(b.attachment("root").marker(), scene.ground.marker()))
        small = scene.run().linearize()
        first = small.modes()[0]
        self.assertAlmostEqual(first.frequency, clamped_free(L, D, D, E, RHO), delta=0.01 * first.frequency)
        slow = small.modes(2, shift=500.)
        self.assertAlmostEqual(slow[0].frequency, first.frequency, delta=1e-6 * first.frequency)
        with self.assertRaisesRegex(TypeError, "damping is True"):
            scene.add("damped", h.FlexibleBody(modal, damping=True))
        with self.assertRaisesRegex(h.Error, "attachment"):
            scene = h.Scene()
            b = scene.add("beam", h.FlexibleBody(modal))
            scene.connect("pin", h.Fixed, b, scene.ground, (0, 0, 0))
            scene.run()

    def test_kept_nodes_and_loads(self):
        """A pressure on the tip pulls on a node of it as its resultant does, and nodes touch a plane"""
        node = int(self.model.label[self.model.sets["tip"][0]])
        body = flexible.reduce(self.model, [flexible.Attachment("root")], modes=12, node_sets=["tip"], nodes=[1], pressures={"pull": ("tip", False)},
                               nodal_loads={"push": {node: (0, 0, -3.)}})
        scene = h.Scene()
        b = scene.add("beam", h.FlexibleBody(body.modal()))
        scene.add("clamp", h.Fixed(b.attachment("root").marker(), scene.ground.marker()))
        load = scene.add("load", h.ModalLoad(b, "pull", -1e6))
        scene.add("push", h.ModalLoad(b, "push", h.time() * 0))
        scene.add("touch", h.NodeContact(b, scene.ground.marker((0, 0, -1))))
        marker = b.node(node).marker()
        now = scene.run().equilibrium().snapshot()
        moved = now.motion(marker).position - self.model.coordinates[self.model.sets["tip"][0]]
        self.assertAlmostEqual(moved[0], 1e6 / E * L, delta=0.2e6 / E * L)  # the first of the modes along the axis: 8 / pi^2
        self.assertEqual(load.name, "load")
        with self.assertRaisesRegex(h.Error, "has not kept node 999"):
            scene = h.Scene()
            scene.add("beam", h.FlexibleBody(body.modal())).node(999)
            scene.run()

    def test_loads_of_a_body_balance(self):
        """Clamp, force at the tip, pressure, contact and weight at rest, all about the clamp; what acts on another attachment is not zero but an error"""
        body = flexible.reduce(self.model, [flexible.Attachment("root"), flexible.Attachment("tip", tie="average")], modes=12, node_sets=["tip"], pressures={"pull": ("tip", False)})
        scene = h.Scene(gravity=(0, 0, -9.81))
        b = scene.add("beam", h.FlexibleBody(body.modal()))
        root, tip = b.attachment("root").marker(), b.attachment("tip").marker()
        clamp = scene.add("clamp", h.Fixed(root, scene.ground.marker()))
        force = scene.add("force", h.UserForce(tip, force=[0, 20., -300.]))
        pull = scene.add("pull", h.ModalLoad(b, "pull", -1e5))
        touch = scene.add("touch", h.NodeContact(b, scene.ground.marker((0, 0, -D / 2 - 1e-4)), law=h.ContactLaw(stiffness=1e6)))
        scene.channel("touch", h.element_force(touch, tip, "z"))
        run = scene.run().equilibrium()
        now = run.snapshot()
        loads = [now.load(clamp, root), now.load(pull, root), now.load(touch, root)]
        at_tip, arm = now.load(force, tip), now.motion(tip).position
        weight = np.array([0, 0, -9.81 * MASS])
        self.assertGreater(loads[2].force[2], 10.)
        self.assertAlmostEqual(run.sample()["touch"], loads[2].force[2], delta=1e-9)
        np.testing.assert_allclose(now.load(touch, tip).force, loads[2].force, atol=1e-9)
        np.testing.assert_allclose(sum(x.force for x in loads) + at_tip.force + weight, 0, atol=1e-6)
        centre = np.array([0.5, 0, now.motion(b).position[2]])
        moment = sum(x.moment for x in loads) + at_tip.moment + np.cross(arm, at_tip.force) + np.cross(centre, weight)
        np.testing.assert_allclose(moment, 0, atol=2e-3 * 300)
        with self.assertRaisesRegex(h.Error, "acts on beam.tip, not on beam.root"):
            now.load(force, root)

    def test_stress_of_another_model(self):
        """As many nodes, elsewhere"""
        body = flexible.reduce(self.model, [flexible.Attachment("root")], modes=4)
        other = flexible.FeModel.from_mesh(beam_mesh(os.path.join(self.folder.name, "longer.msh"), 1.2 * L, D, D), STEEL)
        with self.assertRaisesRegex(h.Error, "the model that was reduced"):
            body.add_stress_modes(other)
        body.add_stress_modes(self.model)

    def test_deflection_and_stress(self):
        """A force at the tip: F L^3 / (3 E I) and, half way, the stress of the outer fibre; fields and files"""
        scene = h.Scene()
        b = scene.add("beam", h.FlexibleBody(self.body, damping=0.02))
        scene.add("clamp", h.Fixed(b.attachment("root").marker(), scene.ground.marker()))
        tip = b.attachment("tip").marker()
        scene.add("load", h.UserForce(tip, force=[0, 0, -1000.]))
        now = scene.run().equilibrium().snapshot()
        I = D**4 / 12
        self.assertAlmostEqual(now.motion(tip).position[2], -1000 * L**3 / (3 * E * I), delta=0.01 * 1000 * L**3 / (3 * E * I))
        eta = now.modes(b)
        stress = self.body.von_mises(eta)
        x = self.body.coordinates[self.body.stress_nodes]
        middle = np.flatnonzero((abs(x[:, 0] - 0.5) < 1e-9) & (abs(abs(x[:, 2]) - D / 2) < 1e-9))
        np.testing.assert_allclose(stress[middle], 1000 * 0.5 * (D / 2) / I, rtol=0.02)
        self.assertEqual(self.body.stress.shape[1:], (6, len(eta)))
        xx = self.body.stress[middle] @ eta
        np.testing.assert_allclose(abs(xx[:, 0]), stress[middle], rtol=0.02)
        spots = flexible.HotSpots(self.body)
        spots.add(0., 0 * eta)
        spots.add(1., eta)
        highest = spots.highest(2, 0.1)
        self.assertEqual(highest[0].time, 1.)
        self.assertAlmostEqual(highest[0].stress, stress.max(), delta=1e-6 * stress.max())
        self.assertGreater(np.linalg.norm(highest[0].position - highest[1].position), 0.1 * (1 - 1e-9))
        file = os.path.join(self.folder.name, "field.vtu")
        self.body.write_field(eta, file, origin=(1, 0, 0))
        self.assertGreater(os.path.getsize(file), 1000)

    def test_files(self):
        file = os.path.join(self.folder.name, "beam.h5")
        try:
            self.body.save(file)
        except h.Error as error:
            self.skipTest(str(error))
        again = flexible.ReducedBody.load(file)
        np.testing.assert_array_equal(again.frequencies, self.body.frequencies)
        np.testing.assert_array_equal(again.shape, self.body.shape)
        np.testing.assert_array_equal(flexible.load_modal_body(file).omega, self.body.modal().omega)
        with self.assertRaises(h.Error):
            flexible.ReducedBody.load(file + " that is not there")

    def test_pickle(self):
        """The bytes of the file: modes and stress are the same to the last bit"""
        try:
            again = pickle.loads(pickle.dumps(self.body))
        except h.Error as error:  # no HDF5
            self.skipTest(str(error))
        np.testing.assert_array_equal(again.frequencies, self.body.frequencies)
        np.testing.assert_array_equal(again.shape, self.body.shape)
        np.testing.assert_array_equal(again.stress, self.body.stress)

    def test_matrices_in_memory(self):
        """K and M as scipy has them: the same body"""
        try:
            import scipy.sparse
        except ImportError:
            self.skipTest("no scipy")
        K, M = (scipy.sparse.csr_matrix(A.getValuesCSR()[::-1], shape=A.getSize()) for A in (self.model.K, self.model.M))
        model = flexible.FeModel.from_matrices(K, M, self.model.coordinates)
        model.add_set("root", self.model.sets["root"]).add_set("tip", self.model.sets["tip"])
        body = flexible.reduce(model, [flexible.Attachment("root"), flexible.Attachment("tip")], modes=6)
        np.testing.assert_allclose(body.frequencies, self.body.frequencies, rtol=1e-7)

    def test_matrices_in_files(self):
        """K and M in Matrix Market's format, nodes and sets as lines of text: the same body; and as PETSc writes them"""
        names = {name: os.path.join(self.folder.name, "own." + name) for name in ("K", "M", "nodes", "sets")}
        for name, A in (("K", self.model.K), ("M", self.model.M)):
            rows, columns, values = A.getValuesCSR()
            with open(names[name], "w") as text:
                print("%%%%MatrixMarket matrix coordinate real general\n%d %d %d" % (*A.getSize(), len(values)), file=text)
                for i in range(A.getSize()[0]):
                    for k in range(rows[i], rows[i + 1]):
                        print(i + 1, columns[k] + 1, "%.17g" % values[k], file=text)
        with open(names["nodes"], "w") as text:
            for label, x in zip(self.model.label, self.model.coordinates):
                print(label, *("%.17g" % c for c in x), file=text)
        with open(names["sets"], "w") as text:
            for name in ("root", "tip"):
                print(name, *self.model.label[self.model.sets[name]], file=text)
        model = flexible.FeModel.from_files(names["K"], names["M"], names["nodes"], names["sets"])
        np.testing.assert_array_equal(model.label[model.sets["tip"]], self.model.label[self.model.sets["tip"]])
        body = flexible.reduce(model, [flexible.Attachment("root"), flexible.Attachment("tip")], modes=6)
        np.testing.assert_allclose(body.frequencies, self.body.frequencies, rtol=1e-7)
        for name, A in (("K", self.model.K), ("M", self.model.M)):
            viewer = PETSc.Viewer().createBinary(names[name] + ".petsc", "w", comm=self.model.comm)
            A.view(viewer)
            viewer.destroy()
        model = flexible.FeModel.from_files(names["K"] + ".petsc", names["M"] + ".petsc", names["nodes"], names["sets"])
        self.assertLess((model.K - self.model.K).norm(), 1e-12 * self.model.K.norm())

    def test_matrices_with_entries_in_parts(self):
        """As element matrices leave them: scipy adds what stands at one place"""
        try:
            import scipy.sparse
        except ImportError:
            self.skipTest("no scipy")
        parts = scipy.sparse.csr_matrix(([1., 2., 3., 4., 5., 6.], [0, 0, 1, 2, 2, 2], [0, 2, 3, 6]), shape=(3, 3))
        own = flexible.FeModel.from_matrices(parts, parts, np.zeros((1, 3))).K
        np.testing.assert_array_equal(own.getValues(range(3), range(3)), parts.toarray())
        self.assertEqual(parts.nnz, 6, "the user's is as it was")

    def test_refused_whole_model(self):
        """What was refused is not described again with other parameters, and its model may go"""
        scene = h.Scene()
        scene.parameter("p", 1.)
        with self.assertRaisesRegex(h.Error, "need elements"):
            flexible.FullFeBody(scene, "beam", flexible.FeModel.from_matrices(self.model.K, self.model.M, self.model.coordinates), flexible.FullBody())
        flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(law="small"))
        scene.set(p=2.)
        scene.run()

    def test_sets_by_condition(self):
        """An array of True and False names the nodes where it is True"""
        model = flexible.FeModel.from_matrices(self.model.K, self.model.M, self.model.coordinates)
        model.add_set("root", model.coordinates[:, 0] < 1e-9)
        np.testing.assert_array_equal(model.sets["root"], self.model.sets["root"])
        with self.assertRaisesRegex(ValueError, "each of the 128 own nodes"):
            model.add_set("short", [True, False])
        with self.assertRaisesRegex(TypeError, "set half: nodes must be integers"):
            model.add_set("half", [0.5])

    def test_late_attachment(self):
        """One that is asked for after the run was made is no body of it"""
        scene = h.Scene()
        b = scene.add("beam", h.FlexibleBody(self.body))
        scene.add("clamp", h.Fixed(b.attachment("root").marker(), scene.ground.marker()))
        now = scene.run().snapshot()
        with self.assertRaisesRegex(h.Error, "beam.tip came too late"):
            now.motion(b.attachment("tip").marker())

    def test_whole_model(self):
        """A free beam that falls: each node by g t^2 / 2"""
        scene = h.Scene(gravity=(0, 0, -9.81))
        whole = flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(law="small", attachments=[flexible.Attachment("tip")]))
        scene.channel("z", h.displacement(whole.attachment("tip").marker(), 2))
        run = scene.solve(0.01, tolerance=1e-6)
        np.testing.assert_allclose(whole.positions(run)[:, 2] - self.model.coordinates[:, 2], -0.5 * 9.81 * 0.01**2, atol=1e-8)
        self.assertAlmostEqual(run["z"][-1], -0.5 * 9.81 * 0.01**2, delta=1e-8)

    def test_whole_model_before_the_first_step(self):
        """Nodes, fields and meshes where no step has been made: at the start, and in the shape of static equilibrium"""
        scene = h.Scene(gravity=(0, 0, -9.81))
        whole = flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(law="small", attachments=[flexible.Attachment("root"), flexible.Attachment("tip", tie="average")]))
        scene.add("clamp", h.Fixed(whole.attachment("root").marker(), scene.ground.marker()))
        tip = whole.attachment("tip").marker()
        np.testing.assert_allclose(whole.positions(scene.run()), self.model.coordinates, atol=1e-14)
        run = scene.run().equilibrium()
        moved = whole.positions(run) - self.model.coordinates
        sag = run.snapshot().motion(tip).position[2]
        self.assertAlmostEqual(sag, -9.81 * MASS * L**3 / (8 * E * D**4 / 12), delta=0.02 * abs(sag))
        self.assertAlmostEqual(moved[self.model.sets["tip"], 2].mean(), sag, delta=1e-9 * abs(sag))
        file = os.path.join(self.folder.name, "static.vtu")
        whole.write_field(run, file)
        self.assertGreater(os.path.getsize(file), 1000)
        with self.assertRaisesRegex(h.Error, "There is no step"):
            whole.positions(run, 0.1)

    def test_weights_in_the_order_of_labels(self):
        """The default position of an average is the weighted centroid"""
        order = np.argsort(self.model.label[self.model.sets["tip"]])
        weights = np.linspace(1, 5, len(order))
        body = flexible.reduce(self.model, [flexible.Attachment("tip", tie="average", weights=weights)], modes=4)
        x = self.model.coordinates[self.model.sets["tip"][order]]
        np.testing.assert_allclose(body.modal().attachments["tip"], weights @ x / weights.sum(), atol=1e-12)

    def test_unknown_attachment(self):
        """Of a whole model, by the body's name and with the attachments that there are"""
        scene = h.Scene()
        whole = flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(attachments=[flexible.Attachment("root"), flexible.Attachment("tip")]))
        whole.attachment("middle").marker()
        with self.assertRaisesRegex(h.Error, "beam: it has no attachment middle, but root, tip"):
            scene.run()

    def test_response_of_a_stiff_body(self):
        """Near a resonance, damped by 2e-4 of critical damping: against dense matrices with the root held. Stiffness and constraints differ by 1e11."""
        model = flexible.FeModel.from_mesh(beam_mesh(os.path.join(self.folder.name, "coarse.msh"), L, D, D, (5, 1, 1)), flexible.Material(E, 0.3, RHO))
        scene = h.Scene()
        whole = flexible.FullFeBody(scene, "beam", model, flexible.FullBody(law="small", mass_damping=0.1, attachments=[flexible.Attachment("root"), flexible.Attachment("tip", tie="average")]))
        scene.add("clamp", h.Fixed(whole.attachment("root").marker(), scene.ground.marker()))
        tip = whole.attachment("tip").marker()
        w = 2 * np.pi * np.array([5., 20., 41.17, 263.])
        found = scene.run().linearize().response(h.Excitation.force(tip, (0, 0, 1)), h.displacement(tip, "z"), w)
        K, M = (np.array(A.convert("dense").getDenseArray()) for A in (model.K.copy(), model.M.copy()))
        free = np.setdiff1d(np.arange(3 * model.nodes), np.add.outer(3 * model.sets["root"], np.arange(3)).ravel())
        nodes, load = model.sets["tip"], np.zeros(3 * model.nodes)
        load[3 * nodes + 2] = 1 / len(nodes)
        exact = [load[free] @ np.linalg.solve((K + (0.1j * x - x * x) * M)[np.ix_(free, free)], load[free]) for x in w]
        np.testing.assert_allclose(found.real, np.real(exact), rtol=1e-5)
        np.testing.assert_allclose(found.imag, np.imag(exact), rtol=1e-3)

    def test_equilibrium_on_a_driven_hub(self):
        """There is none, although rounding of a blade's forces makes steps ever shorter"""
        model = flexible.FeModel.from_mesh(beam_mesh(os.path.join(self.folder.name, "blade.msh"), 2., 0.06, 0.02, (4, 1, 1)), flexible.Material(7e10, 0., 2700.))
        body = flexible.reduce(model, [flexible.Attachment("root"), flexible.Attachment("tip")], modes=2, stiffening=True).modal()
        for speed in np.arange(73.5, 74.6, 0.1):
            scene = h.Scene()
            hub = scene.add("hub", h.RigidBody(1, np.eye(3), angular_velocity=(0, 0, speed)))
            scene.connect("pin", h.Revolute, hub, scene.ground, (0, 0, 0))
            scene.add("drive", h.RotationalMotion(hub.marker(), scene.ground.marker(), speed, of="velocity"))
            blade = scene.add("blade", h.FlexibleBody(body, angular_velocity=(0, 0, speed), velocity=(0, speed, 0)))
            scene.add("root", h.Fixed(blade.attachment("root").marker(), hub.marker()))
            with self.assertRaisesRegex(h.Error, "no static equilibrium found.* most in rotational motion drive"):
                scene.run().equilibrium()

    def told(self, *calls):
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            for call in calls:
                call()
        return [str(w.message) for w in told]

    def test_modes_under_tension(self):
        """A whole body and a reduced one are not in equilibrium at the start, and small motions are others there"""
        attachments = [flexible.Attachment("root"), flexible.Attachment("tip")]
        stiffening, tension = flexible.reduce(self.model, attachments, modes=6, stiffening=True), 20 * E * D**4 / 12 / L**2
        for whole in (True, False):
            scene = h.Scene()
            b = flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(attachments=attachments)) if whole else scene.add("beam", h.FlexibleBody(stiffening.modal()))
            scene.add("clamp", h.Fixed(b.attachment("root").marker(), scene.ground.marker()))
            tip = b.attachment("tip").marker()
            scene.add("load", h.UserForce(tip, force=(tension, 0, 0)))
            start, still = scene.run().linearize(), scene.run().equilibrium().linearize()
            slowest = []
            self.assertRegex(" ".join(self.told(lambda: slowest.extend(start.modes(1)))), r"modes\(count\): the state.*elastic body beam.*Bring the run to equilibrium by Run.equilibrium\(\);")
            self.assertEqual(len(self.told(lambda: start.response(h.Excitation.force(tip, (0, 0, 1)), h.displacement(tip, "z"), [0., 100.]))), 1)
            if not whole:
                self.assertRegex(" ".join(self.told(start.modes)), r"modes\(\): the state.*elastic body beam")
            self.assertEqual(self.told(lambda: slowest.extend(still.modes(1))), [])
            self.assertGreater(abs(slowest[1].value), 1.1 * abs(slowest[0].value))
        scene = h.Scene()  # the frame of an attachment turns by itself; the body, of which it is a small part, hardly does
        b = flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(attachments=attachments))
        scene.add("clamp", h.Fixed(b.attachment("root").marker(), scene.ground.marker()))
        scene.add("load", h.UserForce(b.attachment("tip").marker(), moment=(0.1, 0, 0)))
        small = scene.run().linearize()
        self.assertEqual(self.told(lambda: small.modes(1)), [])

    def test_modes_of_a_free_body(self):
        """Its deformation alone tells: the centre of mass and the axes of a bar that spins are steady; one that falls is at rest in itself, one that is pulled is not"""
        for whole in (True, False):
            for spin, gravity, pull, expected in ((30., 0., 0., 1), (0., 9.81, 0., 0), (0., 0., 0., 0), (0., 0., 1e5, 1)):
                scene, w = h.Scene(gravity=(0, 0, -gravity)), np.array([0, 0, spin])
                if whole:
                    b = flexible.FullFeBody(scene, "bar", self.model, flexible.FullBody(angular_velocity=w, velocity=np.cross(w, (-L / 2, 0, 0)), attachments=[flexible.Attachment("tip")]))
                else:
                    b = scene.add("bar", h.FlexibleBody(self.body, angular_velocity=w))
                scene.add("pull", h.UserForce(b.attachment("tip").marker(), force=(pull, 0, 0)))
                small = scene.run().linearize()
                told = self.told(lambda: small.modes(8) if whole else small.modes())
                self.assertEqual(len(told), expected, (whole, spin, gravity, pull))
                self.assertTrue(all("elastic body bar" in t for t in told))

    def test_modes_of_a_blade(self):
        """On a hub at speed, from the hub: at the start it is neither extended nor stiffened, and says so; after a run with damping it is steady, with the first frequency of flap
        of a beam that turns, Wright et al., Journal of Applied Mechanics 49, 1982: 4.1373 sqrt(EI/(m L^4)) at twice this speed"""
        unit = np.sqrt(E * D**2 / 12 / RHO) / L**2
        spin = np.array([0, 0, 2 * unit])
        blade = flexible.reduce(self.model, [flexible.Attachment("root")], modes=10, stiffening=True).modal()
        scene = h.Scene()
        d = scene.parameter("d", 1.)
        hub = scene.rigid_body("hub", inertia=np.eye(3), angular_velocity=spin)
        scene.connect("pin", h.Revolute, hub, scene.ground, (0, 0, 0))
        scene.add("drive", h.RotationalMotion(hub.marker(), scene.ground.marker(), spin[2], of="velocity"))
        b = scene.add("blade", lambda: h.FlexibleBody(blade, position=(0, 0, 0), angular_velocity=spin, velocity=np.cross(spin, (L / 2, 0, 0)), damping=d.get()))
        scene.add("root", h.Fixed(b.attachment("root").marker(), hub.marker()))
        small = scene.run().linearize(axes=hub)
        told = self.told(small.modes, lambda: small.state_space([], []), lambda: small.modes(3))
        self.assertEqual([t.split(":")[0] for t in told], ["modes()", "state_space()", "modes(count)"])
        for t in told:
            self.assertRegex(t, r"elastic body blade.*Let what vibrates in the turning scene come to rest by a run with damping.*Run.equilibrium\(\), which stops")
            self.assertNotIn("without a count", t)
        run = scene.solve(0.2, tolerance=1e-7)
        scene.set(d=0.)
        steady = scene.run(after=run).linearize(axes=hub)
        found = []
        self.assertEqual(self.told(lambda: found.extend(steady.modes()), lambda: steady.state_space([], []), lambda: steady.modes(3)), [])
        lag, flap = sorted(m.value.imag / unit for m in found if m.value.imag > 1)[:2]  # of a square beam flap^2 - lag^2 is the square of the speed
        self.assertAlmostEqual(flap, 4.1373, delta=0.005)
        self.assertAlmostEqual(lag, np.sqrt(4.1373**2 - 4), delta=0.005)

    def test_modes_in_other_axes(self):
        """A shaft's modal coordinates turn with the shaft"""
        scene, spin = h.Scene(), (30., 0, 0)
        shaft = scene.add("shaft", h.FlexibleBody(self.body, angular_velocity=spin))
        tip = shaft.attachment("tip").marker()
        scene.add("left", h.Spherical(shaft.attachment("root").marker(), scene.ground.marker()))
        scene.add("right", h.InLine(tip, scene.ground.marker((L, 0, 0), h.axes_along((1, 0, 0)))))
        for axes in (None, shaft, scene.ground):
            small = scene.run().linearize(axes=axes)
            told = self.told(small.modes, lambda: small.modes(3), lambda: small.state_space([], []), lambda: small.response(h.Excitation.force(tip, (1, 0, 0)), h.displacement(tip, "x"), 30.))
            self.assertEqual([t.split(":")[0] for t in told], ["modes()", "modes(count)", "state_space()", "response()"] if axes is scene.ground else [])
            self.assertTrue(all("body shaft turns relative to the axes" in t and "linearize(axes=body)" in t for t in told))
        for spins, axes, expected in (((300., 302.), "alike", []), ((300., 310.), "unlike", ["bar 1"]), ((0.01, 0.01), "ground", [])):  # about the bar's axis: nothing accelerates
            scene = h.Scene()
            for k, spin in enumerate(spins):
                scene.add("bar %d" % k, h.FlexibleBody(self.body, position=(0, k, 0), angular_velocity=(spin, 0, 0)))
            small = scene.run().linearize(axes=scene.ground if axes == "ground" else None)
            self.assertEqual([t.split("body ")[1][:5] for t in self.told(small.modes)], expected)

    def held(self, whole, assembly, place=(0., 0., 0.), law=None, **policy):
        """The beam clamped at its root, and at its tip by `law` or a clamp that misses it by `place`: scene, body, tip, what is at the tip"""
        scene = h.Scene()
        scene.start(assembly=assembly, **policy)
        if whole:
            b = flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(law=whole, attachments=[flexible.Attachment("root"), flexible.Attachment("tip")]))
        else:
            b = scene.add("beam", h.FlexibleBody(self.body))
        scene.add("clamp", h.Fixed(b.attachment("root").marker(), scene.ground.marker()))
        tip, goal = b.attachment("tip").marker(), scene.ground.marker(np.array([1., 0, 0]) + place)
        at = scene.add("drive", h.TranslationalMotion(tip, goal, law)) if law else scene.add("other", h.Fixed(tip, goal))
        return scene, b, tip, at

    def test_driven_end(self):
        """Clamped at one end and driven at the other, which moves at the start: no rigid motion has these velocities"""
        for whole in (None, "small"):
            scene, b, tip, _ = self.held(whole, "project", law=lambda t: 0.001 * h.sin(200 * t))
            scene.channel("z", h.displacement(tip, 2))
            now = scene.run().snapshot()
            np.testing.assert_allclose(now.motion(tip).velocity[2], 0.2, rtol=1e-9)
            run = scene.solve(0.01, tolerance=1e-6)
            self.assertAlmostEqual(run["z"][-1], 0.001 * np.sin(2), delta=1e-8)
        scene, b, tip, _ = self.held(None, "report", law=lambda t: 0.001 * h.sin(200 * t))
        with self.assertRaisesRegex(h.Error, r"drive: velocities violate it by 0\.2(.|\n)*assembly=\"project\""):
            scene.run()

    def test_velocities_after_an_impact(self):
        """The nearest velocities in the metric of the mass matrix, dense and of the modal body"""
        scene, b, tip, _ = self.held(None, "project", law=lambda t: 0.2 * t)
        modal, n = self.body.modal(), len(self.body.frequencies)
        shape = self.body.shape.reshape(-1, n)
        rigid = np.zeros((shape.shape[0], 6))
        x = self.model.coordinates - modal.center
        for c in range(3):
            rigid[c::3, c] = 1
            rigid[(c + 1) % 3::3, 3 + c], rigid[(c + 2) % 3::3, 3 + c] = -x[:, (c + 2) % 3], x[:, (c + 1) % 3]
        V = np.hstack([rigid, shape])
        M = V.T @ np.array(self.model.M.copy().convert("dense").getDenseArray()) @ V
        rows, goal = [], []
        for name in ("root", "tip"):
            k = self.model.sets[name]
            fit, *_ = np.linalg.lstsq(np.hstack([np.tile(np.eye(3), (len(k), 1)), self.turn(self.model.coordinates[k] - modal.attachments[name])]), V.reshape(-1, 3, V.shape[1])[k].reshape(3 * len(k), -1), rcond=None)
            rows.append(fit if name == "root" else fit[2:3])
            goal += [0.] * 6 if name == "root" else [0.2]
        C = np.vstack(rows)
        least = np.linalg.solve(M, C.T @ np.linalg.solve(C @ np.linalg.solve(M, C.T), goal))
        now = scene.run().snapshot()
        exact = least @ M @ least / 2
        self.assertAlmostEqual(now.energy()[0], exact, delta=1e-8 * exact)

    @staticmethod
    def turn(x):
        G = np.zeros((3 * len(x), 3))
        for c in range(3):
            G[(c + 1) % 3::3, c], G[(c + 2) % 3::3, c] = -x[:, (c + 2) % 3], x[:, (c + 1) % 3]
        return G

    def test_press_fit(self):
        """Clamped at both ends in a gap that is too wide or too narrow: EA d / L, from the start and from a run's analysis"""
        for whole, gap in ((None, 1e-4), (None, 1e-3), (None, -1e-3), ("small", 1e-3), ("large", 1e-4)):
            exact = E * D * D * gap / L
            for at_once in (False, True):
                scene, b, tip, other = self.held(whole, "project", (gap, 0, 0), equilibrium=at_once)
                run = scene.run()
                if not at_once:
                    np.testing.assert_allclose(run.snapshot().motion(tip).position, [1 + gap, 0, 0], atol=1e-9)
                    run.equilibrium()
                force = run.snapshot().load(other, tip).force[0]
                self.assertAlmostEqual(abs(force), abs(exact), delta=(1e-3 if whole == "large" else 1e-6) * abs(exact), msg=str((whole, gap, at_once)))

    def test_redundant_rows_beside_a_press_fit(self):
        """A four-bar linkage whose hinges are redundant in space, and a beam that has yet to be strained"""
        scene, b, tip, other = self.held(None, "project", (1e-3, 0, 0))
        corners = np.array([[0., 1, 0], [0, 2, 0], [1, 2, 0], [1, 1, 0]])
        links = [scene.add("link %d" % k, h.RigidBody(mass=1, inertia=np.eye(3), position=(corners[k] + corners[k + 1]) / 2)) for k in range(3)]
        bodies = [scene.ground] + links + [scene.ground]
        for k, x in enumerate(corners):
            scene.connect("hinge %d" % k, h.Revolute, bodies[k], bodies[k + 1], x)
        force = scene.run().equilibrium().snapshot().load(other, tip).force[0]
        self.assertAlmostEqual(abs(force), E * D * D * 1e-3 / L, delta=1e-5 * abs(force))

    def test_element_that_appears(self):
        """What a lock leaves of a vibration is the same whether misfits are reported or projected"""
        energies = []
        for whole in (None, "small"):
            for assembly in ("report", "project"):
                scene = h.Scene()
                scene.start(assembly=assembly)
                on, z = scene.parameter("on", 0.), scene.parameter("z", 0.)
                if whole:
                    b = flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(law=whole, attachments=[flexible.Attachment("root"), flexible.Attachment("tip")]))
                else:
                    b = scene.add("beam", h.FlexibleBody(self.body))
                scene.add("clamp", h.Fixed(b.attachment("root").marker(), scene.ground.marker()))
                tip, goal = b.attachment("tip").marker(), scene.ground.marker((1., 0, z))
                scene.add("push", h.UserForce(tip, force=(0, 0, 200 * h.sin(300 * h.time()))))
                first = [True]

                def lock():
                    there = first.pop() if first else float(on) > 0
                    return h.InPlane(tip, goal) if there else None

                scene.add("lock", lock)
                scene.set(z=0.1)
                run = scene.run(tolerance=1e-8).solve(0.01)
                before = run.snapshot()
                scene.set(on=1., z=before.motion(tip).position[2])
                after = scene.run(tolerance=1e-8, after=run).snapshot()
                self.assertGreater(abs(before.motion(tip).velocity[2]), 0.01)
                self.assertAlmostEqual(after.motion(tip).velocity[2], 0, delta=1e-9)
                energies.append(after.energy()[0])
                self.assertLess(energies[-1], before.energy()[0])
            self.assertAlmostEqual(energies[-1], energies[-2], delta=1e-7 * energies[-2])

    def test_contradictions_beside_flexible_bodies(self):
        """Are named, of rigid bodies and of what holds a flexible one"""
        scene, b, tip, _ = self.held(None, "project", law=lambda t: 0.001 * h.sin(200 * t))
        slider = scene.add("slider", h.RigidBody(mass=1, inertia=np.eye(3)))
        for name, speed in (("one", 1.), ("two", 2.)):
            scene.add(name, h.TranslationalMotion(slider.marker(), scene.ground.marker(), lambda t, speed=speed: speed * t))
        with self.assertRaisesRegex(h.Error, "no initial velocities satisfy all constraints:(.|\n)*(one|two)") as raised:
            scene.run()
        self.assertNotIn("drive", str(raised.exception))
        scene, b, tip, _ = self.held(None, "project", law=lambda t: 0.001 * h.sin(200 * t))
        scene.add("another", h.TranslationalMotion(tip, scene.ground.marker((1., 0, 0)), lambda t: 0.001 * h.sin(300 * t)))
        with self.assertRaisesRegex(h.Error, "another(.|\n)*was dropped as redundant at the start, and is violated"):
            scene.solve(0.01)
        scene, b, tip, _ = self.held(None, "project", (1e-3, 0, 0))
        scene.add("third", h.Fixed(tip, scene.ground.marker((1.002, 0, 0))))
        with self.assertRaisesRegex(h.Error, "(other|third)"):
            scene.run()

    def test_reactions_to_small_loads(self):
        """A clamped whole beam: reaction and deflection in proportion to the load, however small its forces are beside what rounding makes of the nodes"""
        deflections = []
        for load in (1e-3, 1e-2, 0.1, 1., 10.):
            scene = h.Scene()
            b = flexible.FullFeBody(scene, "beam", self.model, flexible.FullBody(law="small", attachments=[flexible.Attachment("root"), flexible.Attachment("tip", tie="average")]))
            root, tip = b.attachment("root").marker(), b.attachment("tip").marker()
            clamp = scene.add("clamp", h.Fixed(root, scene.ground.marker()))
            scene.add("load", h.UserForce(tip, force=(0, 0, load)))
            now = scene.run().equilibrium().snapshot()
            self.assertAlmostEqual(now.load(clamp, root).force[2] / -load, 1, delta=1e-6, msg=load)
            deflections.append(now.motion(tip).position[2] / load)
        np.testing.assert_allclose(deflections, deflections[-1], rtol=1e-5)

    def test_names_of_bodies(self):
        """A whole model has one that no other body has"""
        whole = lambda scene, name: flexible.FullFeBody(scene, name, self.model, flexible.FullBody(law="small"))
        for others in (whole, lambda scene, name: scene.add(name, h.RigidBody()), lambda scene, name: scene.add(name, h.FlexibleBody(self.body))):
            scene = h.Scene()
            whole(scene, "beam")
            others(scene, "beam")
            with self.assertRaisesRegex(h.Error, "body beam: the name is given more than once"):
                scene.run()
        scene = h.Scene()
        whole(scene, "")
        whole(scene, "")
        scene.run()

    def test_indefinite_mass(self):
        """A negative direction that no diagonal entry shows"""
        try:
            import scipy.sparse
        except ImportError:
            self.skipTest("no scipy")
        K, M = (scipy.sparse.csr_matrix(A.getValuesCSR()[::-1], shape=A.getSize()) for A in (self.model.K, self.model.M))
        m = M.toarray()[::3, ::3]
        for seed in range(3):
            w = np.random.default_rng(seed).normal(size=len(m))
            w /= np.linalg.norm(w)
            for part, refused in ((1.5, True), (1.05, True), (0.5, False)):
                wrong = scipy.sparse.csr_matrix(np.kron(m - part * np.outer(w, w) / (w @ np.linalg.solve(m, w)), np.eye(3)))
                model = flexible.FeModel.from_matrices(K, wrong, self.model.coordinates)
                model.add_set("root", self.model.sets["root"])
                if refused:
                    with self.assertRaisesRegex(h.Error, "M is not positive definite"):
                        flexible.reduce(model, [flexible.Attachment("root")], modes=3)
                else:
                    flexible.reduce(model, [flexible.Attachment("root")], modes=3)

    def test_messages(self):
        """Say what is wrong and no more"""
        with self.assertRaisesRegex(h.Error, r"^reduce\(\): keep lists mode 99, but there are 9 elastic modes at most"):
            flexible.reduce(self.model, [flexible.Attachment("root"), flexible.Attachment("tip")], modes=3, keep=[0, 99])
        with self.assertRaisesRegex(h.Error, "field of the body with 12 modes"):
            self.body.write_field(np.zeros(13), os.path.join(self.folder.name, "no.vtu"))
        scene = h.Scene()
        scene.add("load", h.ModalLoad(scene.add("stone", h.RigidBody()), "case", 1.))
        with self.assertRaisesRegex(h.Error, "modal load load: its body is not a flexible one of this scene") as raised:
            scene.run()
        self.assertNotIn("marker", str(raised.exception))
        scene = h.Scene()
        b = scene.add("beam", h.FlexibleBody(self.body, deformation=[1., 2.]))
        scene.channel("m", h.modal(b, 0))
        with self.assertRaisesRegex(h.Error, "has 12 modes, and damping ratios or a deformation of 2") as raised:
            scene.run()
        self.assertNotIn("channel m", str(raised.exception))
        lower = os.path.join(self.folder.name, "lower.mtx")
        with open(lower, "w") as text:
            text.write("%%MatrixMarket matrix coordinate real general\n3 3 4\n1 1 1.\n2 2 1.\n3 3 1.\n2 1 0.1\n")
        nodes = os.path.join(self.folder.name, "one.nodes")
        with open(nodes, "w") as text:
            text.write("1 0 0 0\n")
        with self.assertRaisesRegex(h.Error, "general, and it has entries in one triangle alone"):
            flexible.FeModel.from_files(lower, lower, nodes)

    def test_mistakes(self):
        try:
            import scipy.sparse

            eye = scipy.sparse.eye(6, format="csr")
            for call, kind, text in ((lambda: flexible.FeModel.from_matrices(eye, eye, np.zeros((3, 2))), ValueError, "must have .own nodes, 3."),
                                     (lambda: flexible.FeModel.from_matrices(eye * 1j, eye, np.zeros((2, 3))), TypeError, "K is complex"),
                                     (lambda: flexible.FeModel.from_matrices(eye, np.eye(6), np.zeros((2, 3))), TypeError, "M is a ndarray, must be a sparse")):
                with self.assertRaisesRegex(kind, text):
                    call()
        except ImportError:
            pass
        file = os.path.join(self.folder.name, "beam.msh")
        for call, kind, text in ((lambda: flexible.reduce(self.model, [], method="guess"), ValueError, "craig_bampton"),
                                 (lambda: flexible.FeModel.from_mesh(file, (2e11, .3)), TypeError, "must be Material"),
                                 (lambda: flexible.FeModel.from_mesh(file, {"beam": "steel"}), TypeError, "volume 'beam' is 'steel'"),
                                 (lambda: flexible.reduce(self.model, ["root"]), TypeError, "list of Attachment"),
                                 (lambda: flexible.reduce(self.model, flexible.Attachment("root")), TypeError, "list of Attachment"),
                                 (lambda: flexible.reduce(self.model, [], modes=5.5), TypeError, "modes must be integers"),
                                 (lambda: flexible.reduce(self.model, [], node_sets="tip"), TypeError, "list of names"),
                                 (lambda: flexible.FullFeBody(h.Scene(), "b", self.body), TypeError, "must be of a FeModel"),
                                 (lambda: h.Scene().add("b", h.FlexibleBody(self.body, damping=(100, 0.01))), ValueError, "list of .frequency, ratio."),
                                 (lambda: h.Scene().add("b", h.FlexibleBody(self.body, damping=0.02, ratios=[0.1] * len(self.body.frequencies))), ValueError, "damping and ratios are both given"),
                                 (lambda: flexible.reduce(self.model, [flexible.Attachment("hub")]), h.Error, "hub"),
                                 (lambda: flexible.Attachment("tip", tie="glue")._fields(), ValueError, "rigid"),
                                 (lambda: flexible.FeModel.from_mesh("no such.msh", STEEL), h.Error, "no such.msh")):
            with self.assertRaisesRegex(kind, text):
                call()


if __name__ == "__main__":
    unittest.main()
