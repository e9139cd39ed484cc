"""Joints, motions and forces: what `Scene.add` takes beside bodies.

Marker i is on the body that is acted on, marker j on the one that takes the reaction. Any number may be a `Parameter` or a formula of parameters;
then the element is described anew for every run. `state=True` carries a force's components as unknowns of the equations.
"""

from typing import Tuple

from . import forces, joints
from .spec import Spec


def _kinds(module):
    return [name for name, x in vars(module).items() if isinstance(x, type) and issubclass(x, Spec) and x.__module__ == module.__name__
            and not name.startswith("_")]


ELEMENTS: Tuple[str, ...] = tuple(name for module in (joints, forces) for name in _kinds(module) if name not in ("Term", "ContactLaw"))
__all__ = list(ELEMENTS) + ["ContactLaw", "Term"]
for _module in (joints, forces):
    globals().update({name: getattr(_module, name) for name in _kinds(_module)})
