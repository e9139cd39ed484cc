"""Joints, motions and forces: what `Scene.add` takes beside bodies.

Marker i is on the body that is acted on, marker j on the one that takes the reaction. Any number may be a `Parameter` or a formula of parameters;
then the element is described anew for every run. `state=True` carries a force's components as unknowns of the equations.
"""

from typing import List

from . import forces, joints
from .forces import *
from .joints import *

__all__: List[str] = []
__all__ += joints.__all__
__all__ += forces.__all__

#: Names of the classes that are elements, which is all but parts of elements
ELEMENTS = tuple(name for name in __all__ if name not in ("Term", "ContactLaw"))
