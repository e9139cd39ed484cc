"""Flexible bodies from linear finite-element models: reduction, stress, and whole models in a scene.

>>> model = flexible.FeModel.from_mesh("frame.msh", {"steel": flexible.Material(2.1e11, 0.3, 7850)})
>>> body = flexible.reduce(model, [flexible.Attachment("hub", "hub nodes"), flexible.Attachment("tip", tie="average")], modes=20)
>>> frame = scene.add("frame", hhtdae.FlexibleBody(body.modal(), damping=0.01))
>>> scene.add("pin", hhtdae.Fixed(frame.attachment("hub").marker(), scene.ground.marker()))

If a model is distributed, arrays contain the part of this rank. All functions that read, reduce or write are collective.
"""

import operator
import os
import tempfile
from dataclasses import asdict, dataclass, field
from typing import Any, List, NamedTuple, Optional, Sequence

import numpy as np
from petsc4py import PETSc

from . import _core
from .results import optional

try:
    from . import _flexible
except ImportError as error:
    raise ImportError("flexible bodies are not there, hhtdae was built without SLEPc: %s" % error) from error
from .scene import Body
from .spec import copied

__all__ = ["Attachment", "FeModel", "FullBody", "FullFeBody", "HotSpot", "HotSpots", "Material", "ReducedBody", "load_modal_body", "reduce"]

ModalBody = _core.ModalBody


class Material(NamedTuple):
    """Isotropic, linear elastic: Young's modulus, Poisson's ratio, density."""
    young: float
    poisson: float
    density: float


@dataclass
class Attachment:
    """A point of an FE model on which joints and forces act.

    Parameters
    ----------
    name : str
    set : str
        Set of nodes; default: the set with the name of the attachment.
    tie : {"rigid", "average"}
        "rigid": the nodes follow the point as a rigid body (RBE2); "average": the point follows the weighted mean motion of the nodes (RBE3).
    position : (3,), optional
        Default: the centroid of the nodes.
    weights : sequence of float, optional
        Weights of the nodes of an average, in ascending order of the nodes' labels (`FeModel.label`), for any number of ranks; default: equal
        weights.
    """
    name: str
    set: str = ""
    tie: str = "rigid"
    position: Optional[Sequence[float]] = None
    weights: Optional[Sequence[float]] = None

    def _fields(self):
        if self.tie not in ("rigid", "average"):
            raise ValueError("attachment %s: tie is %r, must be 'rigid' or 'average'" % (self.name, self.tie))
        return asdict(self)


class Elements(NamedTuple):
    """Elements of a mesh: types (list of str), material (n,), nodes (n, 20) by global number from 0 on, padded with -1, in Gmsh's order."""
    types: List[str]
    material: np.ndarray
    nodes: np.ndarray

    def cells(self):
        """{name: nodes of cells, (n, nodes of a cell)} with the names and the order of nodes of meshio and VTK: tetra, tetra10, hexahedron,
        hexahedron20"""
        order = {"tetrahedron4": ("tetra", range(4)), "tetrahedron10": ("tetra10", [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]), "brick8": ("hexahedron", range(8)),
                 "brick20": ("hexahedron20", [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15])}
        types = np.array(self.types)
        return {order[t][0]: self.nodes[types == t][:, list(order[t][1])] for t in dict.fromkeys(self.types)}


def _attachments(attachments):
    """The fields of attachments, for the C++ part"""
    for a in [attachments] if isinstance(attachments, (str, Attachment)) else attachments:
        if not isinstance(a, Attachment) or a is attachments:
            raise TypeError("attachments are %r, must be a list of Attachment" % (attachments,))
    return [a._fields() for a in attachments]


def _comm(comm):
    return PETSc.COMM_WORLD if comm is None else PETSc.Comm(comm)


class FeModel:
    """A linear finite-element model, three translations a node: made by `from_mesh`, `from_calculix`, `from_files` or `from_matrices`.

    Attributes
    ----------
    nodes, own, first : int
        Number of nodes on all ranks; this rank has `own` nodes, from number `first` on.
    coordinates : (own, 3)
    label : (own,)
        Numbers of the nodes in the mesh file or in the program that made the model.
    sets : dict of str to array
        Own nodes of named sets, by global number.
    elements : Elements
    K, M : petsc4py.PETSc.Mat
        Stiffness without supports, and mass.
    """

    def __init__(self, comm=None):
        self.comm = _comm(comm)
        self._core = _flexible.FeModel(self.comm)

    @classmethod
    def from_mesh(cls, file, materials, comm=None):
        """A Gmsh mesh of tetrahedra or bricks; materials, `Material` or triples, by the name of physical volumes, "" for all others. Physical
        groups become sets by their names, or numbers; those of several dimensions that share one are "point rod", "curve rod", "surface rod", "volume rod"."""
        model = cls(comm)
        model._core.read_mesh(str(file), {name: _material(m, name) for name, m in (materials if isinstance(materials, dict) else {"": materials}).items()})
        return model

    @classmethod
    def from_calculix(cls, stem, comm=None):
        """Stored matrices of CalculiX: stem.sti, stem.mas, stem.dof, and the input deck stem.inp."""
        model = cls(comm)
        model._core.read_calculix(str(stem))
        return model

    @classmethod
    def from_files(cls, stiffness, mass, nodes="", sets="", comm=None):
        """Matrix Market files, or PETSc binary, of K and M without supports; nodes: "label x y z" a line; sets: "name label label ..."."""
        model = cls(comm)
        model._core.read_matrices(str(stiffness), str(mass), str(nodes), str(sets))
        return model

    @classmethod
    def from_matrices(cls, K, M, coordinates, comm=None):
        """Matrices in memory, petsc4py's or scipy.sparse ones (on one rank), with both triangles; coordinates (own nodes, 3)."""
        model = cls(PETSc.COMM_SELF if comm is None and not isinstance(K, PETSc.Mat) else K.getComm() if comm is None else comm)
        x = np.asarray(coordinates, dtype=float)
        if x.size and (x.ndim != 2 or x.shape[1] != 3):
            raise ValueError("coordinates have the shape %r, must have (own nodes, 3): a row for each node" % (x.shape,))
        model._core.set_matrices(_matrix(K, "K", model.comm), _matrix(M, "M", model.comm), x.reshape(-1))
        return model

    def add_set(self, name, nodes):
        """Adds a named set of own nodes, given by global numbers from 0 on, or by an array (own,) of True and False."""
        x = np.asarray(nodes)
        if x.dtype == bool:
            if x.shape != (self.own,):
                raise ValueError("set %s: True or False is needed for each of the %d own nodes, the shape is %r" % (name, self.own, x.shape))
            x = self.first + np.flatnonzero(x)
        self._core.add_set(name, _integers(x, "set %s: nodes" % name))
        return self

    def select(self, where):
        """Global numbers of own nodes where where(x, y, z), a function of arrays, is true."""
        x = self.coordinates
        return self.first + np.flatnonzero(where(x[:, 0], x[:, 1], x[:, 2]))

    def to_meshio(self):
        """A meshio.Mesh of the own nodes, with the elements' materials by number, the nodes' labels and the named sets. On one rank."""
        return _mesh(self.comm, self.coordinates, self.elements, {"label": self.label},
                     {name: np.asarray(nodes) for name, nodes in self.sets.items()})

    nodes = property(lambda self: self._core.nodes)
    own = property(lambda self: self._core.own)
    first = property(lambda self: self._core.first)
    coordinates = property(lambda self: self._core.coordinates)
    label = property(lambda self: self._core.label)
    sets = property(lambda self: self._core.sets)
    elements = property(lambda self: Elements(*self._core.elements))
    K = property(lambda self: self._core.K)
    M = property(lambda self: self._core.M)


def _integers(x, what):
    """Converts x to a list of Python's integers"""
    try:
        return [operator.index(n) for n in x]
    except TypeError:
        raise TypeError("%s must be integers, are %r" % (what, x)) from None


def _material(m, name):
    """The three numbers of a material, checked"""
    try:
        young, poisson, density = (float(x) for x in m)
    except (TypeError, ValueError):
        raise TypeError("the material of %s is %r, must be Material(young, poisson, density)" % ("volume %r" % name if name else "the mesh", m)) from None
    return young, poisson, density


def _matrix(A, name, comm):
    if isinstance(A, PETSc.Mat):
        return A
    if not hasattr(A, "tocsr"):
        raise TypeError("%s is a %s, must be a sparse matrix of scipy (scipy.sparse.csr_matrix(%s)) or one of petsc4py" % (name, type(A).__name__, name))
    A = A.tocsr()
    if not A.has_canonical_format:  # SciPy sums several entries at one place, while PETSc would take the last one
        A = A.copy()
        A.sum_duplicates()
    if np.iscomplexobj(A):
        raise TypeError("%s is complex, must be real; damping of structure goes into the scene's FlexibleBody" % name)
    most = np.iinfo(PETSc.IntType).max
    if A.nnz > most:
        raise ValueError("%s has %d entries, this PETSc counts to %d: take one with 64-bit indices" % (name, A.nnz, most))
    mat = PETSc.Mat().createAIJ(A.shape, csr=(A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data.astype(float)), comm=comm)
    mat.assemble()
    return mat


class ReducedBody:
    """A body in modal coordinates, made by `reduce` or `ReducedBody.load`. On one rank it can be pickled.

    Attributes
    ----------
    frequencies : (modes,)
        Of the modes, cycles per unit of time.
    residuals : (modes,)
        Relative error bounds of the frequencies: the full model has an eigenvalue l with abs(omega^2 - l) <= residual l; negative if not known.
    comm
        The communicator over whose ranks the nodes are distributed.
    coordinates : (own nodes, 3); label : (own nodes,); elements : Elements
    shape : (own nodes, 3, modes)
        The modes at the nodes, if they were kept.
    stress : (nodes with stress, 6, modes), and stress_nodes
        Stress modes, components xx, yy, zz, xy, yz, zx, if they were computed.
    """

    def __init__(self, core=None, comm=None):
        self._core = core if core is not None else _flexible.ReducedBody()
        self.comm = PETSc.COMM_SELF if comm is None else comm  # the communicator over whose ranks its nodes are distributed

    @classmethod
    def load(cls, file, comm=None):
        """Reads a file of `save`."""
        body = cls(comm=_comm(comm))
        body._core.load(body.comm, str(file))
        return body

    def save(self, file):
        """Writes the body to an HDF5 file."""
        self._core.save(str(file))

    def __reduce__(self):
        """Pickled as the bytes of its file, on one rank"""
        if self.comm.size > 1:
            raise TypeError("a reduced body is distributed over ranks: save() writes it from all of them")
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "body.h5")
            self.save(file)
            with open(file, "rb") as whole:
                return _unpickled, (whole.read(),)

    def modal(self):
        """The body as the `model` of a `hhtdae.FlexibleBody`."""
        return self._core.modal()

    frequencies = property(lambda self: self._core.frequencies())
    residuals = property(lambda self: self._core.residuals())
    source = property(lambda self: self._core.source)
    method = property(lambda self: self._core.method)
    coordinates = property(lambda self: self._core.coordinates)
    label = property(lambda self: self._core.label)
    elements = property(lambda self: Elements(*self._core.elements))
    stress_nodes = property(lambda self: self._core.stress_nodes)

    @property
    def shape(self):
        x = self._core.shape
        return x.reshape(len(x) // 3, 3, x.shape[1])

    @property
    def stress(self):
        x = self._core.stress
        return x.reshape(len(x) // 6, 6, x.shape[1])

    def add_stress_modes(self, model):
        """Stress modes at all nodes, from the model that was reduced; returns the body."""
        _flexible.add_stress_modes(model._core, self._core)
        return self

    def von_mises(self, eta):
        """von Mises stress at the nodes with stress modes, for modal coordinates (modes,)."""
        return self._core.von_mises(eta)

    def write_field(self, eta, file, origin=(0., 0., 0.), axes=None):
        """Writes the displacement, and the stress where it is known, as a .vtu file for ParaView; origin, axes: pose of the FE model's axes."""
        self._core.write_field(eta, str(file), origin, np.eye(3) if axes is None else axes)

    def to_meshio(self, eta=None):
        """A meshio.Mesh of the own nodes; for modal coordinates (modes,) with the displacement there, and the stress (nan where it is not known) and its
        von Mises value if there are stress modes. On one rank."""
        data = {"label": self.label}
        if eta is not None:
            eta = np.asarray(eta, dtype=float)
            data["displacement"] = self.shape @ eta
            if len(self.stress_nodes):
                for name, values in (("stress", self.stress @ eta), ("von Mises", self.von_mises(eta))):
                    data[name] = np.full((len(self.label),) + values.shape[1:], np.nan)
                    data[name][self.stress_nodes] = values
        return _mesh(self.comm, self.coordinates, self.elements, data)


def _mesh(comm, points, elements, point_data, sets=None):
    """A meshio.Mesh of all cells, a block for each kind"""
    meshio = optional("meshio", "to_meshio()")
    if comm.size > 1:
        raise ValueError("to_meshio(): the mesh is distributed over %d ranks" % comm.size)
    types = np.array(elements.types)
    materials = [np.asarray(elements.material)[types == t] for t in dict.fromkeys(elements.types)]
    return meshio.Mesh(points, list(elements.cells().items()), point_data=point_data, cell_data={"material": materials}, point_sets=sets)


def _unpickled(whole):
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "body.h5")
        with open(file, "wb") as out:
            out.write(whole)
        return ReducedBody.load(file, PETSc.COMM_SELF)


def reduce(model, attachments, *, method="craig_bampton", modes: Optional[int] = 20, max_frequency=0., keep_below=0., keep: Sequence[int] = (),
           stiffening=False, stress=False, all_nodes=True, progress=False, node_sets: Sequence[str] = (), nodes: Sequence[int] = (), pressures=None,
           nodal_loads=None):
    """Reduces an FE model to a body in modal coordinates. Options of PETSc and SLEPc for its solvers have the prefix ``reduce_``: ``-reduce_eps_tol``, ``-reduce_pc_type``.

    Parameters
    ----------
    model : FeModel
    attachments : sequence of Attachment
    method : {"craig_bampton", "free_free", "static"}
        "craig_bampton": constraint modes and fixed-interface normal modes; "free_free": normal modes of the unsupported body; "static":
        constraint modes only (Guyan).
    modes : int or None
        Largest number of normal modes; None with `max_frequency`: all below it.
    max_frequency : float
        Largest frequency of normal modes, cycles per unit of time; 0: no bound.
    keep_below : float
        Modes of the reduced eigenvalue problem up to this frequency are kept; 0: all. If bounds leave no modes, a notice says so.
    keep : sequence of int
        Numbers, from 0 on, of the modes of the reduced eigenvalue problem that are kept; empty: all.
    stiffening : bool
        Geometric stiffening by loads on attachments and by angular velocity.
    stress : bool
        Whether stress modes are computed.
    all_nodes : bool
        Whether the modes at all nodes are kept, for stress and pictures.
    node_sets, nodes : sequences of str and of int
        Sets, and labels, of nodes that are kept for markers, forces and contact.
    pressures : dict of load cases
        ``{name: set}`` or ``{name: (set, follows)}``: unit pressure on the outer faces whose nodes are all in the set; follows: whether it
        follows the surface.
    nodal_loads : dict of load cases
        ``{name: {label: (fx, fy, fz)}}``. Load cases of both kinds add no static (residual) vector to the modes: deflections due to
        them converge with the number of modes. If the static deflection has to be exact, make an attachment of the loaded nodes (tie "average"
        adds no stiffness); kept nodes are not sufficient.

    Returns
    -------
    ReducedBody
    """
    if method not in ("craig_bampton", "free_free", "static"):
        raise ValueError("method is %r, must be 'craig_bampton', 'free_free' or 'static'" % (method,))
    loads = [(name, p, True) if isinstance(p, str) else (name, p[0], bool(p[1])) for name, p in (pressures or {}).items()]
    loads += [(name, dict(forces)) for name, forces in (nodal_loads or {}).items()]
    if not isinstance(model, FeModel):
        raise TypeError("the model is %r, must be a FeModel" % (model,))
    if isinstance(node_sets, str):
        raise TypeError("node_sets is %r, must be a list of names" % node_sets)
    modes = modes if modes is None else _integers([modes], "modes")[0]
    core = _flexible.reduce(model._core, dict(node_sets=list(node_sets), nodes=_integers(nodes, "nodes"), loads=loads, attachments=_attachments(attachments), method=method,
                                              modes=modes, max_frequency=max_frequency, keep_below=keep_below, keep=_integers(keep, "keep"), stiffening=stiffening,
                                              all_nodes=all_nodes, progress=progress))
    body = ReducedBody(core, model.comm)
    return body.add_stress_modes(model) if stress else body


def load_modal_body(file, comm=None):
    """Reads only the data that a scene needs from a file of a reduced body."""
    return _flexible.load_modal_body(_comm(comm), str(file))


class HotSpot(NamedTuple):
    """A node's label, position (3,), largest von Mises stress, and its time."""
    label: int
    position: np.ndarray
    stress: float
    time: float


class HotSpots:
    """Follows the largest von Mises stress of every node through a run.

    >>> spots = HotSpots(body)
    >>> run.on_step(lambda run: spots.add(run.time, run.snapshot().modes(frame)))
    >>> spots.highest(3)
    """

    def __init__(self, body):
        self._body, self._core = body, _flexible.HotSpots(body._core)

    def add(self, time, eta):
        """Notes the stress for modal coordinates at a time."""
        self._core.add(time, eta)

    def highest(self, count=5, distance=0.):
        """The nodes with the highest stress, no two closer than `distance`, as a list of `HotSpot`. Collective."""
        return [HotSpot(*s) for s in self._core.highest(count, distance)]


@dataclass(eq=False)
class FullBody:
    """An FE model as a body of a scene with 3 coordinates for each node; initial pose and velocities.

    law : "large" (St. Venant-Kirchhoff material, total Lagrangian; elements are fully integrated, including CalculiX's C3D20R, which become
        some per cent stiffer than in K) or "small" (linear, for rotations of the body from its initial attitude by at most a few degrees)
    position, rotation : of the origin and axes (columns) of the FE model, undeformed, space axes
    velocity : of the origin of the FE model, space axes; that of a `hhtdae.FlexibleBody` is of the centre of mass
    angular_velocity : space axes
    mass_damping, stiffness_damping : C = a M + b K; with "large" b must be 0
    """
    law: str = "large"
    position: Sequence[float] = (0., 0., 0.)
    rotation: Any = field(default_factory=lambda: np.eye(3))
    velocity: Sequence[float] = (0., 0., 0.)
    angular_velocity: Sequence[float] = (0., 0., 0.)
    mass_damping: float = 0.
    stiffness_damping: float = 0.
    attachments: Sequence[Attachment] = ()


class FullFeBody:
    """A whole FE model in a scene with the same communicator; to be created on all ranks in the same order as the scene's other parts. Pages show
    its surface, coloured by stress if its elements have materials.
    """

    def __init__(self, scene, name, model, body=FullBody()):
        if not isinstance(model, FeModel) or not isinstance(body, FullBody):
            raise TypeError("%s is made of %r and %r, must be of a FeModel and a FullBody" % (name, model, body))
        if body.law not in ("small", "large"):
            raise ValueError("%s: law is %r, must be 'small' or 'large'" % (name, body.law))
        self._scene, self._model, self._core, self.name = scene, model, _flexible.FullFeBody(), name
        self._placed = copied((body.position, body.rotation))
        scene._describe("finite-element body " + name)
        fields = dict(vars(body), attachments=_attachments(body.attachments))
        self._core.add(scene._core, name, model._core, fields)
        scene._keep.append(model)

    def attachment(self, name):
        """The frame of an attachment: a body for markers."""
        return Body(self._scene, self._core.attachment(name), "%s.%s" % (self.name, name))

    def positions(self, run, time=None):
        """Positions of own nodes, (own, 3), in space axes, at a time within the last step; default: the present time of the run, which before the
        first step is the start, or after ``run.equilibrium()`` the equilibrium."""
        return self._core.positions(run._open(), run.time if time is None else time)

    def write_field(self, run, file, time=None):
        """Displacements as a .vtu file, at a time as of `positions`."""
        self._core.write_field(run._open(), run.time if time is None else time, str(file))

    def to_meshio(self, run, time=None):
        """A meshio.Mesh of the body at a time as of `positions`: its undeformed nodes with their displacements. On one rank."""
        m = self._model
        placed = np.asarray(self._placed[0]) + m.coordinates @ np.asarray(self._placed[1]).T
        return _mesh(m.comm, placed, m.elements, {"label": m.label, "displacement": self.positions(run, time) - placed})
