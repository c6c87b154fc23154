"""Signals over time or velocity: named NumPy arrays with units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ._errors import needing

if TYPE_CHECKING:
    import matplotlib.axes
    import xarray

Columns = list[tuple[str, str, "NDArray[np.float64]"]]


class Signals(Mapping[str, "NDArray[np.float64]"]):
    """Named arrays of equal length; the first one is the independent variable.

    >>> signals = Signals([("time", "s", np.arange(3.0)), ("angle", "rad", np.zeros(3))])
    >>> signals["angle"].shape, signals.units["angle"]
    ((3,), 'rad')
    """

    units: dict[str, str]
    """Unit of each signal; "1" for a pure number."""

    def __init__(self, columns: Columns) -> None:
        self._arrays = {name: values for name, _, values in columns}
        self.units = {name: unit for name, unit, _ in columns}

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __repr__(self) -> str:
        rows = (f"    {name} [{unit}]" for name, unit in self.units.items())
        return "\n".join([f"{type(self).__name__} of {self._count()} values", *rows])

    def _count(self) -> int:
        return len(next(iter(self._arrays.values()), ()))

    def to_xarray(self) -> xarray.Dataset:
        """Return the signals as a Dataset over the first one, with units as attributes. Requires xarray.

        >>> signals = Signals([("time", "s", np.arange(3.0)), ("angle", "rad", np.zeros(3))])
        >>> signals.to_xarray().angle.attrs["units"]
        'rad'
        """
        with needing("xarray"):
            import xarray

        over = next(iter(self._arrays))
        arrays = {name: (over, values, {"units": self.units[name]}) for name, values in self._arrays.items()}
        return xarray.Dataset(arrays)

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Plot signals over the first one. Requires Matplotlib.

        - `names`: signals to plot. Default: all.
        - `ax`: axes to draw on. Default: new ones.
        - `style`: further keywords for `Axes.plot`.

        Returns the axes.
        """
        over, *others = self._arrays
        shown = list(names) or others
        ax = _axes(ax)
        for name in shown:
            ax.plot(self._arrays[over], self._arrays[name], label=f"{_words(name)} [{self.units[name]}]", **style)
        ax.set_xlabel(f"{_words(over)} [{self.units[over]}]")
        units = {self.units[name] for name in shown}
        if len(units) == 1:
            ax.set_ylabel(f"[{units.pop()}]")
        ax.legend()
        return ax


def _axes(ax: matplotlib.axes.Axes | None) -> matplotlib.axes.Axes:
    """Return `ax`, or new axes."""
    if ax is not None:
        return ax
    with needing("plot"):
        import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1]


def _words(name: str) -> str:
    return name.replace("_", " ")
