"""Joints, motions and forces: arguments of `Scene.add` other than bodies.

Loads are those on the body of marker i; the reaction acts on the body of marker j. Any number may be a `Parameter` or a formula of parameters;
then the element is described anew for every run. With `state=True` the components of a force are unknowns of the equations.
"""

from typing import List

from . import forces, joints
from .forces import *
from .joints import *

__all__: List[str] = []
__all__ += joints.__all__
__all__ += forces.__all__

#: Names of the classes that are elements; the others are parts of elements
ELEMENTS = tuple(name for name in __all__ if name not in ("Term", "ContactLaw"))
