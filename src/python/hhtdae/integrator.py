"""The integrator on petsc4py's TS: settings and results of ``ts.setType("hhtdae")``.

After ``import hhtdae`` the type is known to petsc4py. The problem is given by ``ts.setI2Function`` and ``ts.setI2Jacobian``; initial values by
``ts.setSolution2(u, v)``. Most functions here have an option of the command line (`-ts_hhtdae_...`), which ``ts.setFromOptions()`` reads and which replaces what was set before it.
"""

from dataclasses import dataclass
from typing import Tuple

from . import _core

__all__ = ["Statistics", "checkpoint_load", "checkpoint_save", "evaluate_at", "get_acceleration", "get_alpha", "get_form", "get_order",
           "get_role", "get_rotation_factor", "interpolate", "move_back", "set_alpha", "set_checkpoint_vec", "set_coordinate_change",
           "set_corrector_tolerance", "set_form", "set_nodes", "set_order", "set_predictor_degree", "set_radius", "set_reuse", "set_role",
           "set_rotations", "set_row_name", "set_start", "set_step_limit", "statistics"]


@dataclass(frozen=True)
class Statistics:
    """Cumulative counters of a run."""
    steps: int            #: accepted steps
    rejected: int         #: steps rejected by the error test
    newton: int           #: corrector iterations
    residuals: int        #: evaluations of the residual
    jacobians: int        #: evaluations of the Jacobian
    factorizations: int   #: set-ups of the preconditioner with a new matrix
    solves: int           #: linear solves
    time: float           #: wall-clock seconds from the first step to the end
    cpu: float            #: CPU seconds of this process over the same span
    corrector_fails: int  #: corrections that did not converge
    retries: int          #: of these, repeated at the same h with a new matrix
    restarts: int         #: consistent starts: the first one, events, restarts
    changes: int          #: changes of coordinates
    tiny_steps: int       #: steps shorter than rounding allows the corrector
    h_min: float          #: smallest accepted step
    h_max: float          #: largest accepted step
    of_order: Tuple[int, int, int, int] = (0, 0, 0, 0)  #: accepted steps of order 2, 3, 4, 5


def set_form(ts, form):
    """How the inertia forces are averaged over a step: "second_order" (the default), of second order always, or "paper", equation (9a) of Negrut et al., of first order
    where the mass matrix varies and alpha is not 0."""
    _core.set_form(ts, form)


def get_form(ts):
    """The form, "paper" or "second_order"."""
    return _core.get_form(ts)


def set_alpha(ts, alpha):
    """Numerical damping of the HHT method, -1/3 (most) to 0 (none), default -0.3."""
    _core.set_alpha(ts, alpha)


def get_alpha(ts):
    """Numerical damping alpha."""
    return _core.get_alpha(ts)


def set_radius(ts, radius):
    """Spectral radius at infinite frequency, 0 (most damping) to 1 (none), with the generalized-alpha parameters of Chung and Hulbert in place of those of HHT."""
    _core.set_radius(ts, radius)


def set_order(ts, order):
    """Order 2, HHT (the default); 3, 4 or 5, backward differentiation, only for smooth or well damped motion; or "auto": while the motion is smooth,
    the order that allows the longest next step. Orders above 2 need the form "second_order"."""
    if order != "auto" and order not in (2, 3, 4, 5):
        raise ValueError("order is %r, must be 2, 3, 4, 5 or 'auto'" % (order,))
    _core.set_order(ts, 0 if order == "auto" else order)


def get_order(ts):
    """The order, 2 to 5 or "auto"."""
    return _core.get_order(ts) or "auto"


def set_corrector_tolerance(ts, factor):
    """Error that the Newton iteration may leave, in units of the tolerance of a step, in (0, 1); default 0.001, and less for constrained systems with little damping."""
    _core.set_corrector_tolerance(ts, factor)


def set_predictor_degree(ts, degree):
    """Degree of the predictor's polynomial, 0 to 3, or -1 (the default) to choose it in each step."""
    _core.set_predictor_degree(ts, degree)


def set_reuse(ts, ratio, rate, hold):
    """When the Newton matrix is renewed. `ratio`: largest factor by which h may differ from the h of the matrix (default 1.4). `rate`: rate of
    convergence above which the next step has a new matrix (0.25; 0.1 with the preconditioner hhtconstraint). `hold`: h is not increased by less
    than this factor, so that the matrix can be kept (1.2)."""
    _core.set_reuse(ts, ratio, rate, hold)


def set_role(ts, role, unknowns):
    """Sets the role of unknowns; without it roles are determined from the derivatives of the residual.

    Parameters
    ----------
    role : {"coordinate", "state", "holonomic", "nonholonomic", "variable", "force"}
    unknowns : petsc4py.PETSc.IS or sequence of int
        Global numbers, those of this rank.
    """
    from petsc4py import PETSc

    if not isinstance(unknowns, PETSc.IS):
        unknowns = PETSc.IS().createGeneral(list(unknowns), comm=ts.getComm())
    _core.set_is(ts, role, unknowns)


def get_role(ts, role):
    """The unknowns of a role, an index set of global numbers, as set (then it may be empty)
    or, after the set-up, as detected; None where none was set or detected."""
    return _core.get_is(ts, role)


def set_nodes(ts, nodes, reference=None):
    """Sets which unknowns belong to nodes of finite elements, for ``-pc_type hhtconstraint``; scenes do this themselves. Collective, to be called
    after the Jacobian is set.

    Parameters
    ----------
    nodes : petsc4py.PETSc.IS, (n, 3) array of int or None
        Global numbers of own unknowns, those of a node consecutively (the block size of the IS is their number); an empty list on a rank without
        nodes. None removes the nodes.
    reference : petsc4py.PETSc.Vec, optional
        Positions of the nodes when these unknowns are zero, in the rows of the unknowns.
    """
    import numpy as np
    from petsc4py import PETSc

    if nodes is not None and not isinstance(nodes, PETSc.IS):
        nodes = np.asarray(nodes, dtype=PETSc.IntType)
        size = np.atleast_2d(nodes).shape[1] if nodes.size else 1
        own = PETSc.IS().createGeneral(nodes.ravel(), comm=ts.getComm())
        own.setBlockSize(int(PETSc.Vec().createWithArray([size], comm=ts.getComm()).max()[1]))  # a rank without nodes does not know the block size
        nodes = own
    _core.set_nodes(ts, nodes, reference)


def set_start(ts, start):
    """What happens with initial values that violate the constraints: "off": they are used as they are; "report" (the default): the violation is
    printed; "project": they are moved to the nearest consistent ones."""
    _core.set_start(ts, start)


def set_step_limit(ts, function):
    """Sets function(ts, t, u, v, a), which returns the application's upper bound on the step that begins in this state."""
    _core.set_step_limit(ts, function)


def set_row_name(ts, function):
    """Sets function(row), which returns the name of an unknown and its equation for messages, by its global number; "" for no name."""
    _core.set_row_name(ts, function)


def set_coordinate_change(ts, test, map, commit=None):
    """Sets functions that change the generalized coordinates during a run: test(ts, t, u, v) returns whether a change is due, map(ts, t, u, v, a)
    transforms the vectors in place, commit(ts) is called after all vectors have been transformed."""
    _core.set_coordinate_change(ts, test, map, commit)


def set_rotations(ts, rotations, refer, back):
    """Sets which coordinates are local rotation vectors, relative to the attitude at the last accepted step; their velocities are angular velocities
    in space axes.

    Parameters
    ----------
    rotations : petsc4py.PETSc.IS or sequence of int
        The first of the three coordinates of each, on the rank that owns all three.
    refer : callable
        refer(ts, u): the attitudes of u become the reference, the rotation vectors in u zero.
    back : callable
        back(ts): restores the reference before the last call of `refer`.
    """
    from petsc4py import PETSc

    if not isinstance(rotations, PETSc.IS):
        rotations = PETSc.IS().createGeneral(list(rotations), comm=ts.getComm())
    _core.set_rotations(ts, rotations, refer, back)


def get_rotation_factor(ts):
    """(factor, begin) of the step whose Newton matrix is being computed: h^2 / 12 in a step of order two, gamma h (h - gamma h) / 2 for higher
    orders, and the velocities at the beginning of the step; 0 and None if the matrix is not that of a step."""
    return _core.get_rotation_factor(ts)


def get_acceleration(ts):
    """The accelerations at the end of the last step, a vector that belongs to the TS."""
    return _core.get_acceleration(ts)


def interpolate(ts, t):
    """(u, v, a) at a time of the last step, by polynomials through the ends of steps: new vectors."""
    return _core.interpolate(ts, t)


def move_back(ts, t):
    """Sets the state of the TS back to a time of its last step; the next step begins anew from there."""
    u, v, a = interpolate(ts, t)
    U, V = ts.getSolution2()
    u.copy(U)
    v.copy(V)
    ts.setTime(t)
    ts.restartStep()
    for x in (u, v, a):
        x.destroy()


def evaluate_at(ts, t):
    """(u, v, a) at a time of the last step, as new vectors: positions and velocities as of `interpolate`, accelerations and multipliers from the
    equations of motion at that time."""
    return _core.evaluate_at(ts, t)


def statistics(ts):
    """`Statistics` of the run so far."""
    return Statistics(**_core.statistics(ts))


def checkpoint_save(ts, file):
    """Writes the state of a run to a file, from which `checkpoint_load` continues with bitwise identical results. Collective."""
    _core.checkpoint_save(ts, str(file))


def checkpoint_load(ts, file):
    """Takes the TS to the state in a file of `checkpoint_save`. Collective."""
    _core.checkpoint_load(ts, str(file))


def set_checkpoint_vec(ts, vec):
    """A vector of the application's that checkpoints save and restore, or None."""
    _core.set_checkpoint_vec(ts, vec)
