"""Pickling of scenes: in another process the function that describes the scene is called with the same arguments."""

import functools
from typing import Any, Callable, NamedTuple, Tuple, TypeVar

from .spec import copied

__all__ = ["model"]

Function = TypeVar("Function", bound=Callable[..., Any])


def model(function: Function) -> Function:
    """A decorator for a function of a module that describes a scene, so that the scene can be pickled, for `multiprocessing` or for files.

    The function returns the scene, or a tuple that contains the scene. Its arguments are pickled as they were given (lists,
    dictionaries, arrays and data classes are copied), with the present values of parameters and the settings of `Scene.start` and `Scene.output`;
    unpickling describes the scene anew. Bodies, markers, elements and formulas of the scene can be pickled together with it.

    >>> @hhtdae.model
    ... def oscillator(mass=1.):
    ...     scene = hhtdae.Scene()
    ...     stiffness = scene.parameter("stiffness", 40.)
    ...     ...
    ...     return scene

    >>> def job(scene):              # a run comes back as its Results
    ...     return scene.solve(2., tolerance=1e-6)

    >>> with multiprocessing.Pool() as pool:
    ...     results = pool.map(job, [oscillator(mass) for mass in (1., 2., 3.)])
    """

    @functools.wraps(function)
    def describe(*args, **keywords):
        recipe = Recipe(describe, args, keywords)
        result = function(*args, **keywords)
        recipe.mark(result)
        return result

    return describe


class State(NamedTuple):
    """The pickled data of a scene: how to describe it, and what can be changed after that"""
    describe: Callable[..., Any]
    args: Tuple[Any, ...]
    keywords: dict
    parameters: dict
    start: dict
    output: dict


class Recipe:
    """The describing function and its arguments; stored in the scene that it has described"""

    def __init__(self, describe, args, keywords):
        self.describe, self.args, self.keywords = describe, copied(args), copied(keywords)

    def mark(self, result):
        scene = _scene_of(result, self.describe)
        scene._recipe, self.edits = self, scene._edits

    def state(self, scene):
        if scene._edits != self.edits:
            raise TypeError("the scene of %s() cannot be pickled: it has been described further since then; let the function do it" % self.describe.__name__)
        return State(self.describe, self.args, self.keywords, {name: p.get() for name, p in scene._parameters.items()}, dict(scene._start), dict(scene._output))

    @staticmethod
    def again(state):
        scene = _scene_of(state.describe(*state.args, **state.keywords), state.describe)
        scene.set(**state.parameters)
        scene.start(**state.start)
        scene.output(**state.output)
        return scene


def _scene_of(result, describe):
    from .scene import Scene

    found = [x for x in (result if isinstance(result, tuple) else (result,)) if isinstance(x, Scene)]
    if len(found) != 1:
        raise TypeError("%s() is marked by @hhtdae.model: it must return a scene, or a tuple with one, but returned %r" % (describe.__name__, result))
    return found[0]
