"""Multibody dynamics on PETSc: index-3 differential-algebraic equations by the Hilber-Hughes-Taylor method.

There are three ways to use the integrator:

- ``ts.setType("hhtdae")`` on petsc4py's TS, with `hhtdae.integrator` for the method's own settings and results;
- `solve_mechanism` for equations of motion given as Python functions, in the manner of scipy.integrate.solve_ivp;
- `Scene` for mechanisms described by bodies, joints and forces, with `hhtdae.flexible` for flexible bodies from finite-element models.

>>> import hhtdae
>>> scene = hhtdae.Scene(gravity=(0, -9.81, 0))
>>> rod = scene.add("rod", hhtdae.RigidBody(mass=1, position=(0.5, 0, 0)))
>>> pin = scene.connect("pin", hhtdae.Revolute, rod, scene.ground, point=(0, 0, 0))
>>> scene.channel("angle", hhtdae.angle(rod.marker(), scene.ground.marker()), "rad")
>>> run = scene.solve(2.0, tolerance=1e-6)
>>> run["angle"][-1]

PETSc is initialized by petsc4py. For options of the command line, before anything else::

    import sys, petsc4py
    petsc4py.init(sys.argv)
    import hhtdae

PETSc is for one thread at a time: a scene, its runs and queries of them are used by one thread at a time, and no two threads solve at once, see
`Run`; for parallel runs use processes.

On several ranks an uncaught exception ends all ranks by MPI_Abort after its traceback is printed; `sys.excepthook` does this, unless it is
replaced later.

Formulas of measures and parameters are evaluated in C++, see `hhtdae.expressions` and `hhtdae.measures`.
"""

from petsc4py import PETSc as _PETSc  # initializes MPI and PETSc; they are finalized after everything imported below

from . import _core

_core.initialize()

from . import bodies, elements, expressions, integrator, measures, mechanism, query, recipe, results, run, scene
from ._errors import Error
from .bodies import *
from .elements import *
from .expressions import *
from .integrator import Statistics, statistics
from .measures import *
from .mechanism import MechanismResult, solve_mechanism
from .query import *
from .recipe import *
from .results import *
from .run import Run
from .scene import *
from .ranks import end_all_ranks_with_one as _end_all_ranks_with_one

_end_all_ranks_with_one()

__all__ = ["Error", "MechanismResult", "Run", "Statistics", "integrator", "solve_mechanism", "statistics"]
for _module in (bodies, elements, expressions, measures, query, recipe, results, scene):
    __all__ += _module.__all__


def __getattr__(name):
    # hhtdae.flexible loads SLEPc, so that it is imported at its first use only.
    if name == "flexible":
        import importlib

        return importlib.import_module(".flexible", __name__)
    raise AttributeError("module 'hhtdae' has no attribute %r" % name)
