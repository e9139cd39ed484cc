"""PETSc is for one thread at a time: a call from a second thread meanwhile raises an error instead of crashing occasionally."""

import functools
import os
import threading
from typing import Any, Callable, TypeVar, cast

F = TypeVar("F", bound=Callable[..., Any])

_busy = threading.RLock()


def _anew():
    """After a fork only the thread that called it exists, so that the lock is replaced by a free one"""
    global _busy
    _busy = threading.RLock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_anew)


def one_thread(function: F) -> F:
    """A decorator: calling the function raises an error while another thread is in a decorated function. Callbacks of a run are in its thread."""
    @functools.wraps(function)
    def alone(*arguments, **named):
        mine = _busy
        if not mine.acquire(blocking=False):
            raise RuntimeError("%s(): another thread is making or solving a run, or asks one; PETSc is for one thread at a time: call it when that one has ended, and for runs "
                               "side by side use processes, multiprocessing.Pool or concurrent.futures.ProcessPoolExecutor" % function.__qualname__.replace(".__init__", "").lstrip("_"))
        try:
            return function(*arguments, **named)
        finally:
            mine.release()
    return cast(F, alone)
