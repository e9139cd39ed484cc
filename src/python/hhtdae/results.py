"""Results of a run, which can be pickled: channels as arrays, a data frame of pandas, plots, a page."""

import html
from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Tuple

import numpy as np

from .integrator import Statistics

__all__ = ["Page", "Results"]


def optional(module: str, what: str, package: str = "") -> Any:
    """Imports an optional module; the message of ImportError says what it is needed for and which package contains it"""
    import importlib

    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = package or module.split(".")[0]
        raise ImportError("%s needs %s, which is not there (Debian: python3-%s, pip: %s): %s" % (what, package, package, package, error)) from error


class Page:
    """A run in three dimensions, with its channels, in one HTML document that needs no network; made by `Run.page`.

    As the last line of a notebook's cell it is shown below the cell. The notebook stores it: half a megabyte plus the frames.
    """

    def __init__(self, text: str, height: int = 600) -> None:
        self.html, self.height = text, height

    def save(self, file: Any) -> None:
        """Writes the page to a file, for any browser."""
        with open(file, "w", encoding="utf-8") as out:
            out.write(self.html)

    def _repr_html_(self) -> str:
        return ('<iframe srcdoc="%s" style="width: 100%%; height: %dpx; border: 0" allowfullscreen></iframe>' % (html.escape(self.html), self.height))

    def __repr__(self) -> str:
        return "<page of %.1f MB: save(file), or show it in a notebook>" % (len(self.html) / 1e6)


class Channels:
    """Channels by name over `times`, from `values` and the list `_signature` of names and units."""

    times: np.ndarray
    values: np.ndarray
    _signature: List[Tuple[str, str]]

    @property
    def channels(self) -> Dict[str, np.ndarray]:
        """All channels by name, with "time"."""
        values = self.values
        return {"time": self.times, **{name: values[:, k].copy() for k, (name, _) in enumerate(self._signature)}}

    @property
    def units(self) -> Dict[str, str]:
        """Units of the channels by name."""
        return dict(self._signature)

    def __getitem__(self, name: str) -> np.ndarray:
        names = [n for n, _ in self._signature]
        if name not in names:
            raise KeyError("no channel is called %r; there are %s" % (name, ", ".join(names) or "none"))
        return self.values[:, names.index(name)].copy()

    def frame(self):
        """The channels as a pandas data frame with the time as index; units are in its `attrs`."""
        pandas = optional("pandas", "frame()")
        frame = pandas.DataFrame(self.values, columns=[n for n, _ in self._signature], index=pandas.Index(self.times, name="time"))
        frame.attrs["units"] = self.units
        return frame

    def plot(self, *names: str, axes: Any = None) -> np.ndarray:
        """Plots channels over time by matplotlib, all if none are named; returns the axes, one for each unit."""
        plt = optional("matplotlib.pyplot", "plot()")
        chosen = [(n, u) for n, u in self._signature if not names or n in names]
        unknown = set(names) - {n for n, _ in chosen}
        if unknown:
            raise KeyError("no channel is called %s" % ", ".join(sorted(unknown)))
        units = list(dict.fromkeys(u for _, u in chosen))
        if axes is None:
            _, axes = plt.subplots(max(1, len(units)), 1, sharex=True, squeeze=False)
        axes = np.ravel(axes)
        for name, unit in chosen:
            axes[units.index(unit)].plot(self.times, self[name], label=name)
        for a, unit in zip(axes, units):
            a.set_ylabel(unit)
            a.legend()
        axes[-1].set_xlabel("time")
        return axes


@dataclass(eq=False, repr=False)
class Results(Channels):
    """The results of a run in memory, made by `Run.results`; a pickled run is unpickled as its results.

    Attributes
    ----------
    times : (n,); values : (n, channels)
    time : float
        The time that the run had reached.
    steps : int
    statistics : Statistics
    """
    times: np.ndarray
    values: np.ndarray
    time: float
    steps: int
    statistics: Statistics
    _signature: List[Tuple[str, str]] = field(default_factory=list)
    _page: Optional[str] = None

    def page(self, height: int = 600) -> Page:
        """The run as a page, if it has recorded one, see `Run.page`."""
        if self._page is None:
            raise ValueError("these results have no page: Scene.run(page=True) records one")
        return Page(self._page, height)

    def __repr__(self) -> str:
        return "<results to t = %.6g, %d steps, %d samples of %s>" % (self.time, self.steps, len(self.times), ", ".join(n for n, _ in self._signature) or "nothing")
