"""Results: numbers with units and intervals, data, remarks and report."""

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
    """Numbers by their names in `summary.json`, in SI units; NaN for a missing value."""

    units: dict[str, str]
    """Unit of each number; "1" for a pure number."""
    intervals: dict[str, tuple[float, float]]
    """Ends of the 95 % interval of each number that has one."""
    records: list[dict[str, Any]]
    """Rows of the tables, each a mapping, suitable for `pandas.DataFrame`."""

    def __init__(self, text: str) -> None:
        contents = json.loads(text)
        results = contents["results"]
        self._values = {name: _number(it["value"]) for name, it in results.items()}
        self.units = {name: it["unit"] for name, it in results.items()}
        ends = {name: it["ci95"] for name, it in results.items() if it.get("ci95")}
        self.intervals = {name: (_number(low), _number(high)) for name, (low, high) in ends.items()}
        self.records = contents.get("rows", [])

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return "\n".join(f"{name} = {value:.6g} {self.units[name]}" for name, value in self._values.items())


def _number(value: float | None) -> float:
    # A summary contains null for non-finite values.
    return math.nan if value is None else float(value)


class Result(Signals):
    """Result of a function: data as signals, numbers, remarks and report."""

    summary: Summary
    """Numbers by their names in `summary.json`."""
    remarks: list[str]
    """Remarks on the result, each with a remedy."""
    made_by: str
    """The call that produced the result, as printed in the report."""

    def __init__(self, outcome: Outcome, made_by: str, columns: Columns | None = None) -> None:
        super().__init__(outcome.columns() if columns is None else columns)
        self._outcome: Outcome | _Snapshot = outcome
        self.made_by = made_by
        self.summary = Summary(outcome.summary())
        self.remarks = outcome.remarks()

    def __repr__(self) -> str:
        return "\n".join([f"{type(self).__name__}: {self.made_by}", *self._outcome.lines(), *self.remarks])

    def html(self) -> str:
        """Return the report as one HTML page, including figures."""
        return self._outcome.html(self.made_by)

    def write(self, folder: str | os.PathLike[str]) -> Summary:
        """Write report, data and `summary.json` into a folder, as the command line does, and return the summary.

        Raises FileError where the folder cannot be written.
        """
        return Summary(self._outcome.write(os.fspath(folder), self.made_by))

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_outcome": _Snapshot.of(self._outcome, self.made_by)}


class _Snapshot:
    """Text and files of an outcome, which can be pickled, unlike the outcome."""

    def __init__(self, outcome: Outcome, made_by: str) -> None:
        self._lines = outcome.lines()
        with tempfile.TemporaryDirectory() as folder:
            outcome.write(folder, made_by)
            self._files = {it.name: it.read_bytes() for it in pathlib.Path(folder).iterdir()}

    @classmethod
    def of(cls, outcome: Outcome | _Snapshot, made_by: str) -> _Snapshot:
        return outcome if isinstance(outcome, _Snapshot) else cls(outcome, made_by)

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
            raise FileError(f"{folder}: cannot write it ({error}). Choose another folder.") from error
        return self._files["summary.json"].decode()


class OverVelocity(Result):
    """A result with friction at constant speeds: `velocity`, `torque`, `standard_error`."""

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Plot torque over velocity with 95 % intervals, or the signals `names`. Requires Matplotlib."""
        if names:
            return super().plot(*names, ax=ax, **style)
        ax = _axes(ax)
        _points(ax, self["velocity"], self["torque"], self["standard_error"], self.units, style)
        ax.legend()
        return ax


class FrictionCurve(OverVelocity):
    """Friction at constant speeds: `velocity` [rad/s], `torque` [N m], `standard_error` [N m]."""

    preload: float
    """Preload of the friction wheel during the measurement, 0 … 1."""

    def __init__(self, outcome: Outcome, made_by: str) -> None:
        super().__init__(outcome, made_by)
        self.preload = self.summary.get("measure.preload", math.nan)


class Fit(Result):
    """Stribeck curve fitted to points, with uncertainties.

    `parameters`, `standard_errors` and `intervals` use the names of a parameter file: `breakaway_torque`,
    `kinetic_torque`, `stribeck_velocity`, `viscous_friction`.
    """

    parameters: dict[str, float]
    """Values [N m, N m, rad/s, N m s/rad; of a linear axis N, N, m/s, N s/m]."""
    standard_errors: dict[str, float]
    """Standard errors of the parameters; infinite for a parameter that the points do not determine."""
    intervals: dict[str, tuple[float, float]]
    """Ends of the 95 % intervals of the parameters."""
    known: dict[str, bool]
    """Whether the points determine each parameter."""
    covariance: NDArray[np.float64]
    """Covariance of the parameters, in the order of `parameters`."""
    residuals: NDArray[np.float64]
    """Measured minus fitted torque, positive where the measured magnitude is larger [N m]."""
    rms: float
    """Root mean square of the residuals [N m]."""
    chi_square: float
    """Weighted sum of squared residuals."""
    degrees_of_freedom: int
    """Number of points minus number of parameters."""
    lack_of_fit: float
    """Deviation of the measured friction from a Stribeck curve, as a standard deviation [N m]."""

    def __init__(self, columns: Columns, side: str, linear: bool, preload: float | None, source: str) -> None:
        arrays = {name: values for name, _, values in columns}
        torque, error = arrays["torque"], arrays.get("standard_error")
        self._arguments = (arrays["velocity"], torque, error, side, linear, preload, source)
        fit = self._fit = fit_points(*self._arguments)
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
        # The same points give a bit-identical curve.
        self.__dict__.update(state, _fit=fit_points(*state["_arguments"]))

    def predict(self, velocity: ArrayLike) -> NDArray[np.float64]:
        """Return the fitted torque [N m] at velocities [rad/s]."""
        return self._fit.at(np.atleast_1d(velocity))[0]

    def band(self, velocity: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return lower and upper end of the 95 % band of the curve [N m] at velocities [rad/s]."""
        torque, half_width = self._fit.at(np.atleast_1d(velocity))
        return torque - half_width, torque + half_width

    def on(self, bench: Preset) -> Preset:
        """Return the preset with this friction as `model.own` and the preload of the measurement.

        Raises InvalidValue where the points do not determine all four parameters.
        """
        part = preset(text=self._fit.fragment())
        changes: dict[str, Any] = {"model.own": part.model.own}
        if self._preload is not None:
            changes["plant.wheel.preload"] = self._preload
        return bench.set(changes)

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Plot the points, the curve and its 95 % band, or the signals `names`. Requires Matplotlib."""
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
    name: str = "torque",
) -> None:
    """Plot measured points, with 95 % intervals if there are standard errors; `name` is that of the torques."""
    error = None if standard_error is None else 1.96 * standard_error
    ax.errorbar(velocity, torque, yerr=error, **{"fmt": ".", "color": "C0", "label": "measured", **style})
    ax.set_xlabel(f"{_words('velocity')} [{units['velocity']}]")
    ax.set_ylabel(f"{_words(name)} [{units[name]}]")


class Design(Result):
    """Desired friction and the torque that the load motor can render."""

    preset: Preset
    """Preset with the desired friction as `bench.desired`."""
    renderable: bool
    """Whether the load motor can render the desired friction."""

    def __init__(self, outcome: Outcome, made_by: str, designed: Preset, renderable: bool) -> None:
        super().__init__(outcome, made_by)
        self.preset = designed
        self.renderable = renderable


class Loop(Result):
    """Stability margins of a position loop."""

    preset: Preset
    """Preset with this controller."""

    def __init__(self, outcome: Outcome, made_by: str, bench: Preset) -> None:
        super().__init__(outcome, made_by)
        self.preset = bench


class Hunting(Result):
    """Predicted hunting of a controller."""

    hunts: bool
    """Whether the controller hunts."""
    amplitude: float
    """Half the peak-to-peak amplitude [rad]; 0 without hunting."""
    interval: float
    """Mean time from one slip to the next [s]; infinite without hunting."""

    def __init__(self, outcome: Outcome, made_by: str, cycle: tuple[float, float] | None) -> None:
        super().__init__(outcome, made_by)
        self.hunts = cycle is not None
        self.amplitude, self.interval = cycle or (0.0, math.inf)


class Simulation(Signals):
    """Signals of a closed loop, one value per sample of the position controller."""

    stopped: str | None
    """Reason for an early end of the run, with a remedy; None for a complete run."""

    def __init__(self, columns: Columns, stopped: str | None) -> None:
        super().__init__(columns)
        self.stopped = stopped

    def __repr__(self) -> str:
        return super().__repr__() + (f"\nStopped: {self.stopped}" if self.stopped else "")

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Plot signals over time. Default: set-point and true angle. Requires Matplotlib."""
        return super().plot(*(names or ("reference_position", "true_angle")), ax=ax, **style)


_STEPS = ("plant_step", "step_error")
"""Columns of a study that describe the integration step."""


class Study(Result):
    """Results of a study, one value per case: `case` from 1, the axes, the measures.

    Where the study selected the integration step of the virtual machine, `plant_step` [s] is that step and `step_error`
    the largest relative change of a measure at the last halving. A missing measure is NaN; `failures` gives the reason.
    The results of a sensitivity analysis are among the `records` of the summary.
    """

    axes: list[str]
    """Names of the varied parameters."""
    measures: list[str]
    """Names of the measures."""
    failures: dict[int, str]
    """Reason for missing numbers, by the number of the case."""
    kept: int
    """Number of cases reused from an earlier run in the folder."""

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
        self._names = [name for name, _, _ in columns[1 + len(axes) :]]
        self.measures = [name for name in self._names if name not in _STEPS]
        self.kept = kept
        self._grid = grid

    def to_xarray(self) -> xarray.Dataset:
        """Return the cases as a Dataset, with units as attributes. Requires xarray.

        The dimensions of a grid are its axes. Other designs have the dimension `case`, with the axes as coordinates.
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
        arrays: dict[str, Any] = {name: (dims, self[name].reshape(shape), units(name)) for name in self._names}
        arrays |= {"failure": (dims, failure.reshape(shape)), "case": (dims, case.reshape(shape))}
        return xarray.Dataset(arrays, coords)

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Plot measures over one axis, or one measure over two axes of a grid as a map. Requires Matplotlib.

        - `names`: measures and axes. Default: the first measure, over both axes of a grid or over the first axis.
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
