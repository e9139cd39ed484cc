"""Exceptions of the package."""

import re

from petsc4py import PETSc


class Error(PETSc.Error):
    """A call of the library has failed; its text is the library's message: which object, which value, what to do.

    Attributes
    ----------
    ierr : int
        PETSc's error code.
    message : str
        The message.
    trace : list of str
        PETSc's traceback, innermost call first.

    An exception of a Python function that the library called is its ``__cause__``. ``PETSc.Error`` of petsc4py is its base class.
    """

    def __init__(self, ierr, message="", trace=()):
        super().__init__(ierr)
        self.message = message
        self.trace = list(trace)

    def __str__(self):
        return self.message

    def __reduce__(self):
        return Error, (self.ierr, self.message, self.trace)


Error.__module__ = "hhtdae"


def fail(code, text, specific, cause):
    """What the C++ part calls where PETSc has returned an error"""
    if isinstance(cause, (KeyboardInterrupt, SystemExit)):
        raise cause
    trace = [line.split("] ", 1)[-1] for line in getattr(PETSc.Error, "_traceback_", [])]
    message = re.sub(r"\s+\Z", "", specific) or text
    message = message.replace("-scene_assemble project", 'scene.start(assembly="project"), or the option -scene_assemble project')
    raise Error(code, message, trace) from cause
