"""Exceptions on one rank: `together` raises an error on all ranks; uncaught exceptions end all ranks by MPI_Abort."""

import os
import sys

from petsc4py import PETSc

from . import _core
from ._errors import Error

PETSC_ERR_USER = 83


def together(comm, function, *arguments):
    """Calls function(*arguments) on all ranks: if it raises an exception on one rank, the others raise `Error` with its text. Without this they
    would wait forever for that rank in their next collective call. Collective calls within the function must be made by all ranks or by none.
    Collective."""
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
    """Sets `sys.excepthook` so that an uncaught exception ends all ranks of COMM_WORLD by MPI_Abort after its traceback was printed, as ``python
    -m mpi4py`` does: the other ranks may wait for that rank in a collective call, and MPI programs end only when all ranks do. Interactive
    sessions continue."""
    before, process = sys.excepthook, os.getpid()

    def hook(kind, error, trace):
        before(kind, error, trace)
        if os.getpid() == process and not hasattr(sys, "ps1") and not sys.flags.interactive:  # not in a forked process
            sys.stdout.flush()
            sys.stderr.flush()
            _core.abort(1)

    if PETSc.COMM_WORLD.size > 1:
        sys.excepthook = hook
