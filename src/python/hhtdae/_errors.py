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

    def __repr__(self):
        return "hhtdae.Error(%d, %r)" % (self.ierr, self.message)

    def __reduce__(self):
        return Error, (self.ierr, self.message, self.trace)


Error.__module__ = "hhtdae"


def fail(code, text, specific, cause):
    """Raises the exception for an error of PETSc; called by the C++ part"""
    if isinstance(cause, (KeyboardInterrupt, SystemExit)):
        raise cause
    trace = [line.split("] ", 1)[-1] for line in getattr(PETSc.Error, "_traceback_", [])]
    message = re.sub(r"\s+\Z", "", specific) or text
    raise Error(code, in_python(message), trace) from cause


# Replacements that turn the names of C++ functions in the library's messages into Python's names; the first that matches is used. Any other
# Class::functionName becomes Class.function_name.
_NAMES = [
    (r"-scene_assemble project", 'scene.start(assembly="project"), or the option -scene_assemble project'),
    (r"Scene::createTS\(&next, ts\)", "Scene.run(after=run)"),
    (r"(Scene::)?\bcreateTS\(\)", "Scene.run()"),
    (r"Scene::set\(\) it", "set it by Scene.set()"),
    (r"\bsetUp\(\)", "Scene.set_up()"),
    (r"\bStaticEquilibrium\(\)", "Run.equilibrium()"),
    (r"\bAssembleAt\(\)", "Run.assemble()"),
    (r"\bKinematics\(\)", "Run.kinematics()"),
    (r"\bTSHHT3CheckpointLoad\(\)", "Run.load()"),
    (r"\bSnapshot::take\(\)", "Run.snapshot()"),
    (r"\bLinearization::take\(\)", "Run.linearize()"),
    (r"\bscene\.attachment\((.+?), \.\.\.\) or scene\.node\(\.\.\.\) as", r"the attachment(name) or node(label) of \1 as"),
    (r"\bmodes = PETSC_DEFAULT\b", "modes=None"),
    (r"\bSlowestModes\(\)", "Linearization.modes(count)"),
    (r"\bFeModel::readMesh\b", "FeModel.from_mesh()"),
    (r"\bReduction::(\w+)", r"reduce(): \1"),
    (r"\b(state|all_nodes) = true\b", r"\1=True"),
    (r"\b(state|all_nodes) = false\b", r"\1=False"),
]


def in_python(message):
    """A message of the library with names of C++ replaced by Python's names"""
    for name, here in _NAMES:
        message = re.sub(name, here, message)
    return re.sub(r"\b(Scene|Run|Snapshot|Linearization)::(\w+)", lambda m: m[1] + "." + re.sub("[A-Z]", lambda c: "_" + c[0].lower(), m[2]), message)
