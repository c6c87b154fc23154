"""Real machines: identification of an axis from a recording, validation, calibration of a bench."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _stickslip
from ._bench import Progress
from ._errors import InvalidValue
from ._recording import Machine, Source, machine_of, table_and_name
from ._results import OverVelocity, Result, _points
from ._signals import Columns, Signals, _axes
from ._stickslip import Outcome, Preset

if TYPE_CHECKING:
    import matplotlib.axes


class Identification(Result):
    """Inertia and friction of an axis: `velocity`, `force` [N] or `torque` [N m], `standard_error`.

    `parameters` and `intervals` use the names of `summary.json`: `inertia.mass` (also of a rotary axis),
    `friction.positive.coulomb`, `friction.negative.viscous` and others, in SI units.
    """

    parameters: dict[str, float]
    """Values of inertia and friction."""
    intervals: dict[str, tuple[float, float]]
    """Ends of the 95 % intervals of the parameters."""
    model: str
    """Text of `model.toml`: the best model, also a parameter file for `preset(text=…)`."""
    feedforward: Signals
    """Force, and command for it, at constant speeds, in the units of the recording."""

    def __init__(
        self,
        outcome: Outcome,
        made_by: str,
        model: str,
        feedforward: Columns,
        curve: tuple[NDArray[np.float64], NDArray[np.float64]],
        machine: str,
    ) -> None:
        super().__init__(outcome, made_by)
        groups = ("inertia.", "friction.", "motor.", "pendulum.")
        self.parameters = {name: value for name, value in self.summary.items() if name.startswith(groups)}
        self.intervals = {name: ends for name, ends in self.summary.intervals.items() if name in self.parameters}
        self.model = model
        self.feedforward = Signals(feedforward)
        self._curve = curve
        self._machine = machine

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Plot friction over velocity with 95 % intervals and the best model, or the signals `names`.

        Requires Matplotlib.
        """
        if names:
            return super().plot(*names, ax=ax, **style)
        if len(self) == 0:
            raise InvalidValue("This identification has no friction curve. Show its report: write(folder).")
        ax = _axes(ax)
        _, force, _ = self
        _points(ax, self["velocity"], self[force], self["standard_error"], self.units, style, force)
        velocity, friction = self._curve
        for k, side in enumerate((velocity < 0, velocity > 0)):
            ax.plot(velocity[side], friction[side], color="C1", label=None if k else "best model")
        ax.legend()
        return ax


class Validation(Result):
    """Errors of a model on another recording; measured and predicted signals over `time`."""

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Plot the measured and the predicted command or force, or the signals `names`. Requires Matplotlib."""
        return super().plot(*(names or list(self)[1:3]), ax=ax, **style)


class Calibration(OverVelocity):
    """Calibrated parameters of a bench; its friction at constant speeds: `velocity`, `torque`, `standard_error`."""

    preset: Preset
    """The preset with the calibrated model."""

    def __init__(self, outcome: Outcome, made_by: str, calibrated: Preset) -> None:
        super().__init__(outcome, made_by)
        self.preset = calibrated


def identify(recording: Source, machine: Machine, *, progress: Progress | None = None) -> Identification:
    """Identify inertia and friction of an axis from a recording of position and command.

    - `recording`: file (CSV, MAT, Parquet or MDF 4), a Recording, arrays by name, or a data frame of pandas or polars.
    - `machine`: machine file, or a mapping with its contents: columns, units, drive, controller.

    Returns the Identification; `remarks` lists what the recording does not determine. The numbers equal those of
    `stickslip identify`. Raises Error where the recording does not match the machine or does not determine the
    parameters, InvalidValue for arrays of different lengths.

    >>> import numpy as np, stickslip
    >>> time = np.arange(0.0, 12.0, 1e-3)
    >>> velocity = 0.2 * np.sin(2.0 * time) + 0.1 * np.sin(5.3 * time)
    >>> position = -0.1 * np.cos(2.0 * time) - 0.1 / 5.3 * np.cos(5.3 * time)
    >>> force = 90.0 * np.gradient(velocity, time) + 22.0 * np.sign(velocity) + 190.0 * velocity
    >>> found = stickslip.identify(
    ...     {"position": position, "command": force / 36.0},
    ...     machine={
    ...         "name": "axis",
    ...         "axis": "linear",
    ...         "sampling_period": {"value": 1, "unit": "ms"},
    ...         "columns": {
    ...             "position": {"name": "position", "unit": "m"},
    ...             "command": {"name": "command", "unit": "V"},
    ...         },
    ...         "drive": {"gain": {"value": 36, "unit": "N/V"}},
    ...     },
    ... )
    >>> bool(abs(found.parameters["inertia.mass"] - 90.0) < 1.0)
    True
    """
    table, name = table_and_name(recording)
    file = machine_of(machine)
    outcome, model, feedforward, curve = _stickslip.identify_axis(table, file, progress)
    made_by = f"stickslip.identify({name!r}, machine={_shown(machine)})"
    return Identification(outcome, made_by, model, feedforward, curve, file.text)


def validate(
    recording: Source,
    model: Identification | str | os.PathLike[str],
    *,
    machine: Machine | None = None,
    progress: Progress | None = None,
) -> Validation:
    """Validate an identified model on a recording that was not used for its identification.

    - `recording`: as for `identify`.
    - `model`: the Identification, or the file `model.toml` of one.
    - `machine`: machine file, or a mapping with its contents. Default: that of the Identification.

    Returns the Validation. The numbers equal those of `stickslip validate`. Raises Error where the recording does not
    match the machine.
    """
    if machine is not None:
        file = machine_of(machine)
    elif isinstance(model, Identification):
        file = _stickslip.machine_file("machine", model._machine)
    else:
        raise TypeError("Missing machine. Pass machine=, the file with the columns and the drive of this recording.")
    table, name = table_and_name(recording)
    with tempfile.TemporaryDirectory() as folder:
        if isinstance(model, Identification):
            path = os.path.join(folder, "model.toml")
            with open(path, "w", encoding="utf-8") as out:
                out.write(model.model)
        else:
            path = os.fspath(model)
        outcome = _stickslip.validate_model(table, path, file, progress)
    shown = "found" if isinstance(model, Identification) else repr(path)
    return Validation(outcome, f"stickslip.validate({name!r}, {shown})")


def calibrate(
    bench: Preset, *, plan: Mapping[str, Any] | None = None, seed: int = 1, progress: Progress | None = None
) -> Calibration:
    """Calibrate the virtual bench of a preset by its own experiments: scales, inertias, coupling, lags, friction.

    - `plan`: values that differ from the standard plan, such as `{"duration": 2}` [s].
    - `seed`: seed of the noise. The numbers equal those of `stickslip calibrate` with the same seed.

    Returns the Calibration; its `preset` has the calibrated model. Raises InvalidValue for a value outside its range,
    BenchFault where the supervision stops the bench.
    """
    calibrated, outcome = _stickslip.calibrate_bench(bench, plan, seed, progress)
    return Calibration(outcome, f"stickslip.calibrate(bench, plan={plan}, seed={seed})", calibrated)


def _shown(machine: Machine) -> str:
    """Return the argument as in the call; a mapping is in the report."""
    return "{…}" if isinstance(machine, Mapping) else repr(os.fspath(machine))
