"""An exception on one rank ends the work of all ranks: at the next point where they meet, as an error on all of them; else by MPI_Abort."""

import os
import sys

from petsc4py import PETSc

from . import _core
from ._errors import Error

PETSC_ERR_USER = 83


def together(comm, function, *arguments):
    """function(*arguments), which all ranks call at the same point: if one rank fails there, the others raise `Error` with its text. Without it they would wait
    for that rank for ever in their next collective call. What the function itself does collectively has to be done, or not, by all ranks. Collective."""
    if comm.size == 1:
        return function(*arguments)
    result = error = None
    try:
        result = function(*arguments)
    except BaseException as raised:
        error = raised
    first = _core.first_failure(comm, "" if error is None else "%s: %s" % (type(error).__name__, error))
    if error is not None:
        raise error
    if first is not None:
        raise Error(PETSC_ERR_USER, "On rank %d: %s" % first)
    return result


def end_all_ranks_with_one():
    """An exception that nobody has caught ends all ranks of COMM_WORLD by MPI_Abort, after its traceback was printed, as ``python -m mpi4py`` does: the others
    may wait for that rank in a collective call, and MPI does not end before all ranks do. Interactive sessions go on."""
    before, process = sys.excepthook, os.getpid()

    def hook(kind, error, trace):
        before(kind, error, trace)
        if os.getpid() == process and not hasattr(sys, "ps1") and not sys.flags.interactive:  # not in a copy of the process
            sys.stdout.flush()
            sys.stderr.flush()
            _core.abort(1)

    if PETSc.COMM_WORLD.size > 1:
        sys.excepthook = hook
