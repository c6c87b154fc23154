"""What came of a piece of work: numbers with units and intervals, data, remarks, a report."""

from __future__ import annotations

import json
import math
import os
import pathlib
import tempfile
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import FileError, needing
from ._signals import Columns, Signals, _axes, _words
from ._stickslip import Outcome, Preset, fit_points, preset

if TYPE_CHECKING:
    import matplotlib.axes
    import xarray


class Summary(Mapping[str, float]):
    """Numbers under the names of a `summary.json`, in SI units; NaN where there is none."""

    units: dict[str, str]
    """Unit of each number; "1" for a pure number."""
    intervals: dict[str, tuple[float, float]]
    """Ends of the 95 % interval of each number that has one."""
    records: list[dict[str, Any]]
    """Rows of its tables, each a mapping: for `pandas.DataFrame`."""

    def __init__(self, text: str) -> None:
        told = json.loads(text)
        results = told["results"]
        self._values = {name: _number(it["value"]) for name, it in results.items()}
        self.units = {name: it["unit"] for name, it in results.items()}
        known = {name: it["ci95"] for name, it in results.items() if it.get("ci95")}
        self.intervals = {name: (_number(low), _number(high)) for name, (low, high) in known.items()}
        self.records = told.get("rows", [])

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return "\n".join(f"{name} = {value:.6g} {self.units[name]}" for name, value in self._values.items())


def _number(value: float | None) -> float:
    # A summary has null for what is not finite.
    return math.nan if value is None else float(value)


class Result(Signals):
    """What came of a piece of work: its data as signals, and its numbers, remarks and report."""

    summary: Summary
    """Its numbers, under the names of `summary.json`."""
    remarks: list[str]
    """What one should know of it, each with a remedy."""
    made_by: str
    """The call that it came of, as its report has it."""

    def __init__(self, outcome: Outcome, made_by: str, columns: Columns | None = None) -> None:
        super().__init__(outcome.columns() if columns is None else columns)
        self._outcome: Outcome | _Kept = outcome
        self.made_by = made_by
        self.summary = Summary(outcome.summary())
        self.remarks = outcome.remarks()

    def __repr__(self) -> str:
        return "\n".join([f"{type(self).__name__}: {self.made_by}", *self._outcome.lines(), *self.remarks])

    def html(self) -> str:
        """The report as one page of HTML, figures included."""
        return self._outcome.html(self.made_by)

    def write(self, folder: str | os.PathLike[str]) -> Summary:
        """Writes report, data and `summary.json` into a folder, as the command line does; returns the summary."""
        return Summary(self._outcome.write(os.fspath(folder), self.made_by))

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_outcome": _Kept.of(self._outcome, self.made_by)}


class _Kept:
    """What an outcome says and writes: it can be pickled, which what was computed cannot."""

    def __init__(self, outcome: Outcome, made_by: str) -> None:
        self._lines = outcome.lines()
        with tempfile.TemporaryDirectory() as folder:
            outcome.write(folder, made_by)
            self._files = {it.name: it.read_bytes() for it in pathlib.Path(folder).iterdir()}

    @classmethod
    def of(cls, outcome: Outcome | _Kept, made_by: str) -> _Kept:
        return outcome if isinstance(outcome, _Kept) else cls(outcome, made_by)

    def lines(self) -> list[str]:
        return self._lines

    def html(self, _: str) -> str:
        return self._files["report.html"].decode()

    def write(self, folder: str, _: str) -> str:
        try:
            os.makedirs(folder, exist_ok=True)
            for name, contents in self._files.items():
                pathlib.Path(folder, name).write_bytes(contents)
        except OSError as error:
            raise FileError(f"{folder}: cannot write it ({error}). Choose another place.") from error
        return self._files["summary.json"].decode()


class FrictionCurve(Result):
    """Friction at constant speeds: `velocity` [rad/s], `torque` [N m], `standard_error` [N m]."""

    preload: float
    """How far the linings of the friction wheel were pressed on, 0 … 1."""

    def __init__(self, outcome: Outcome, made_by: str) -> None:
        super().__init__(outcome, made_by)
        self.preload = self.summary.get("measure.preload", math.nan)

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Draws torque over velocity with its 95 % intervals; needs Matplotlib. Names are signals, as of any result."""
        if names:
            return super().plot(*names, ax=ax, **style)
        ax = _axes(ax)
        _points(ax, self["velocity"], self["torque"], self["standard_error"], self.units, style)
        ax.legend()
        return ax


class Fit(Result):
    """A Stribeck curve through points, with what the points tell of it.

    `parameters`, `standard_errors` and `intervals` have the names of a parameter file: `breakaway_torque`,
    `kinetic_torque`, `stribeck_velocity`, `viscous_friction`.
    """

    parameters: dict[str, float]
    """The values [N m, N m, rad/s, N m s/rad; of a linear axis N, N, m/s, N s/m]."""
    standard_errors: dict[str, float]
    """Their standard errors; infinite where the points do not tell a parameter."""
    intervals: dict[str, tuple[float, float]]
    """Ends of their 95 % intervals."""
    known: dict[str, bool]
    """Whether the points tell each of them."""
    covariance: NDArray[np.float64]
    """Their covariance, in the order of `parameters`."""
    residuals: NDArray[np.float64]
    """Measured less fitted, positive away from zero [N m]."""
    rms: float
    """Root mean square of the residuals [N m]."""
    chi_square: float
    """Weighted sum of their squares."""
    degrees_of_freedom: int
    """Points less parameters."""
    lack_of_fit: float
    """How far the form of the curve is from the friction that was measured, as a standard deviation [N m]."""

    def __init__(self, columns: Columns, side: str, linear: bool, preload: float | None, source: str) -> None:
        arrays = {name: values for name, _, values in columns}
        self._asked = (arrays["velocity"], arrays["torque"], arrays.get("standard_error"), side, linear, preload, source)
        fit = self._fit = fit_points(*self._asked)
        super().__init__(fit.outcome(), f"stickslip.fit({source}, side={side!r})", columns)
        self._preload = preload
        self.parameters = fit.parameters
        self.standard_errors = fit.standard_errors
        self.intervals = fit.intervals
        self.known = fit.known
        self.covariance = fit.covariance
        self.residuals = fit.residuals
        self.rms = fit.rms
        self.chi_square = fit.chi_square
        self.degrees_of_freedom = fit.degrees_of_freedom
        self.lack_of_fit = fit.lack_of_fit

    def __getstate__(self) -> dict[str, Any]:
        state = super().__getstate__()
        del state["_fit"]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        # The same points have the same curve, to the bit.
        self.__dict__.update(state, _fit=fit_points(*state["_asked"]))

    def predict(self, velocity: ArrayLike) -> NDArray[np.float64]:
        """The fitted torque [N m] at velocities [rad/s]."""
        return self._fit.at(np.atleast_1d(velocity))[0]

    def band(self, velocity: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper end of the 95 % band of the curve [N m] at velocities [rad/s]."""
        torque, half_width = self._fit.at(np.atleast_1d(velocity))
        return torque - half_width, torque + half_width

    def on(self, bench: Preset) -> Preset:
        """A preset that believes this friction of its axis (`model.own`), with the linings as they were measured.

        Raises InvalidValue where the points do not tell all four parameters.
        """
        part = preset(text=self._fit.fragment())
        changes: dict[str, Any] = {"model.own": part.model.own}
        if self._preload is not None:
            changes["plant.wheel.preload"] = self._preload
        return bench.set(changes)

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Draws the points, the curve and its 95 % band; needs Matplotlib. Names are signals, as of any result."""
        if names:
            return super().plot(*names, ax=ax, **style)
        ax = _axes(ax)
        velocity = self["velocity"]
        _points(ax, velocity, self["torque"], self.get("standard_error"), self.units, style)
        for side in (velocity[velocity > 0], velocity[velocity < 0]):
            if side.size:
                over = np.linspace(side.min(), side.max(), 400)
                (line,) = ax.plot(over, self.predict(over), color="C1")
                ax.fill_between(over, *self.band(over), color="C1", alpha=0.25, linewidth=0)
        line.set_label("fitted, with its 95 % band")
        ax.legend()
        return ax


def _points(
    ax: matplotlib.axes.Axes,
    velocity: NDArray[np.float64],
    torque: NDArray[np.float64],
    standard_error: NDArray[np.float64] | None,
    units: dict[str, str],
    style: dict[str, Any],
) -> None:
    """Measured points, with 95 % intervals where errors are known."""
    error = None if standard_error is None else 1.96 * standard_error
    ax.errorbar(velocity, torque, yerr=error, **{"fmt": ".", "color": "C0", "label": "measured", **style})
    ax.set_xlabel(f"{_words('velocity')} [{units['velocity']}]")
    ax.set_ylabel(f"{_words('torque')} [{units['torque']}]")


class Design(Result):
    """A desired friction, and what the load motor can do about it."""

    preset: Preset
    """The bench with it as `bench.desired`."""
    renderable: bool
    """Whether the load motor can render it."""

    def __init__(self, outcome: Outcome, made_by: str, designed: Preset, renderable: bool) -> None:
        super().__init__(outcome, made_by)
        self.preset = designed
        self.renderable = renderable


class Loop(Result):
    """How far the loop of a position controller is from oscillation."""

    preset: Preset
    """The bench with this controller."""

    def __init__(self, outcome: Outcome, made_by: str, bench: Preset) -> None:
        super().__init__(outcome, made_by)
        self.preset = bench


class Hunting(Result):
    """Whether a controller will hunt."""

    hunts: bool
    """Whether it will."""
    amplitude: float
    """Half the distance between the extremes [rad]; 0 where it does not hunt."""
    interval: float
    """Mean time from one slip to the next [s]; infinite where it does not hunt."""

    def __init__(self, outcome: Outcome, made_by: str, cycle: tuple[float, float] | None) -> None:
        super().__init__(outcome, made_by)
        self.hunts = cycle is not None
        self.amplitude, self.interval = cycle or (0.0, math.inf)


class Simulation(Signals):
    """Signals of a closed loop, a value each sample of the position controller."""

    stopped: str | None
    """Why it ended before its time, and what to do; None where it did not."""

    def __init__(self, columns: Columns, stopped: str | None) -> None:
        super().__init__(columns)
        self.stopped = stopped

    def __repr__(self) -> str:
        return super().__repr__() + (f"\nStopped: {self.stopped}" if self.stopped else "")

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Draws signals over time, set-point and true angle unless named; needs Matplotlib."""
        return super().plot(*(names or ("reference_position", "true_angle")), ax=ax, **style)


_CHOSEN = ("plant_step", "step_error")
"""What a study says of its steps, beside the measures."""


class Study(Result):
    """What became of the measures of a study, a value each case: `case` from 1, the axes, the measures.

    Where the study chose the step of the virtual machine, `plant_step` [s] is which, and `step_error` the largest share by
    which a measure moved when it was last halved. A measure that a case does not have is NaN, and `failures` says why. What a sensitivity analysis tells of the axes
    is among the `records` of the summary.
    """

    axes: list[str]
    """What was changed."""
    measures: list[str]
    """What was measured."""
    failures: dict[int, str]
    """Why a case lacks numbers, by the number of the case."""
    kept: int
    """Cases that the folder had from an earlier run."""

    def __init__(
        self,
        outcome: Outcome,
        made_by: str,
        columns: Columns,
        failures: dict[int, str],
        axes: list[str],
        grid: list[NDArray[np.float64]] | None,
        kept: int,
    ) -> None:
        super().__init__(outcome, made_by, columns)
        self.failures = failures
        self.axes = axes
        self._found = [name for name, _, _ in columns[1 + len(axes) :]]
        self.measures = [name for name in self._found if name not in _CHOSEN]
        self.kept = kept
        self._grid = grid

    def to_xarray(self) -> xarray.Dataset:
        """The cases as a Dataset, with units as attributes; needs xarray.

        A grid has its axes as dimensions. Of other designs the dimension is `case`, with the axes as coordinates.
        """
        with needing("xarray"):
            import xarray

        def units(name: str) -> dict[str, str]:
            return {"units": self.units[name]}

        case = self["case"].astype(np.int64)
        failure = np.array([self.failures.get(number, "") for number in case.tolist()], dtype=object)
        dims: tuple[str, ...] = ("case",)
        shape: tuple[int, ...] = (case.size,)
        if self._grid is None:
            coords = {name: ("case", self[name], units(name)) for name in self.axes}
        else:
            dims, shape = tuple(self.axes), tuple(values.size for values in self._grid)
            coords = {name: (name, values, units(name)) for name, values in zip(self.axes, self._grid)}
        arrays: dict[str, Any] = {name: (dims, self[name].reshape(shape), units(name)) for name in self._found}
        arrays |= {"failure": (dims, failure.reshape(shape)), "case": (dims, case.reshape(shape))}
        return xarray.Dataset(arrays, coords)

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Draws measures over an axis, or one over two axes of a grid as a map; needs Matplotlib.

        `names` are measures and axes; without them the first measure, over the only two axes or the first one.
        """
        over = [name for name in names if name in self.axes]
        shown = [name for name in names if name not in over] or self.measures[:1]
        grid = self._grid if self._grid is not None and all(values.size > 1 for values in self._grid) else None
        ax = _axes(ax)
        if grid is not None and len(grid) == 2 and len(shown) == 1 and len(over) != 1:
            x, y = over or reversed(self.axes)
            orders = {name: np.argsort(values) for name, values in zip(self.axes, grid)}
            table = self[shown[0]].reshape(grid[0].size, grid[1].size)[np.ix_(*orders.values())]
            places = {name: values[orders[name]] for name, values in zip(self.axes, grid)}
            drawn = table if x == self.axes[1] else table.T
            mesh = ax.pcolormesh(places[x], places[y], drawn, **{"shading": "nearest", **style})
            ax.figure.colorbar(mesh, ax=ax, label=f"{_words(shown[0])} [{self.units[shown[0]]}]")
            ax.set_xlabel(f"{_words(x)} [{self.units[x]}]")
            ax.set_ylabel(f"{_words(y)} [{self.units[y]}]")
            return ax
        (x,) = over or self.axes[:1]
        for name in shown:
            label = f"{_words(name)} [{self.units[name]}]"
            ax.plot(self[x], self[name], **{"marker": ".", "linestyle": "none", "label": label, **style})
        ax.set_xlabel(f"{_words(x)} [{self.units[x]}]")
        ax.legend()
        return ax
