"""Recordings of machines: files, data frames and arrays as columns with units."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import NDArray

from ._errors import InvalidValue
from ._files import lines
from ._signals import Columns, Signals, _axes, _words
from ._stickslip import MachineFile, Table, machine_file, read_table, table_of

if TYPE_CHECKING:
    import matplotlib.axes

Source = Union[str, "os.PathLike[str]", Mapping[str, Any], Any]
"""A recording: a file, a Recording, arrays by name, or a data frame of pandas, polars or xarray."""

Machine = Union[str, "os.PathLike[str]", Mapping[str, Any]]
"""A machine file, or a mapping with the contents of one."""


class Recording(Signals):
    """Columns of a recording, or the signals of a machine in it: `time`, `position`, `command` and others in SI units."""

    name: str
    """Path of the file, or the kind of the data."""
    remarks: list[str]
    """Remarks on the recording: what was changed in it, and peculiarities."""

    def __init__(self, table: Table, name: str, machine: MachineFile | None = None) -> None:
        self.remarks: list[str] = []
        columns: Columns = table.columns()
        if machine is not None:
            columns, self.remarks = table.signals(machine)
        super().__init__(columns)
        self.name = name
        self._table = table

    def __repr__(self) -> str:
        return "\n".join([super().__repr__(), *self.remarks])

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_table": self._table.columns()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        columns = [(name, unit or None, values) for name, unit, values in state["_table"]]
        self.__dict__.update(state, _table=table_of(state["name"], columns))

    def plot(self, *names: str, ax: matplotlib.axes.Axes | None = None, **style: Any) -> matplotlib.axes.Axes:
        """Plot signals over time, one diagram for each unit. Requires Matplotlib.

        - `names`: signals to plot. Default: all.
        - `ax`: axes to draw all signals on. Default: new ones.
        - `style`: further keywords for `Axes.plot`.

        Returns the axes, the first ones of several.
        """
        over = next((name for name, values in self.items() if _rises(values)), None)
        groups: dict[str, list[str]] = {}
        for name in names or [name for name in self if name != over]:
            groups.setdefault(self.units[name], []).append(name)
        axes = [ax] * len(groups) if ax is not None else list(_stacked(len(groups)))
        for (unit, group), axis in zip(groups.items(), axes):
            for name in group:
                x = np.arange(self[name].size) if over is None else self[over]
                axis.plot(x, self[name], label=_words(name), **style)
            axis.set_ylabel(f"[{unit}]" if unit else "")
            axis.legend()
        axes[-1].set_xlabel("row" if over is None else f"{_words(over)} [{self.units[over]}]")
        return axes[0]


def _rises(values: NDArray[np.float64]) -> bool:
    return values.size > 1 and bool(np.all(np.diff(values) > 0))


def _stacked(count: int) -> Iterator[matplotlib.axes.Axes]:
    """Yield new axes above each other."""
    first = _axes(None)
    if count <= 1:
        yield first
        return
    figure = first.figure
    first.remove()
    yield from figure.subplots(count, sharex=True)


def read_recording(recording: Source, machine: Machine | None = None) -> Recording:
    """Read a recording of a machine: a file, or data that are in memory.

    - `recording`: file (CSV, MAT, Parquet or MDF 4); arrays by name; a data frame of pandas or polars; an xarray
      Dataset; a structured array. A unit may follow the name: "angle [deg]". Times become seconds.
    - `machine`: machine file, or a mapping with its contents. Default: the columns as they are.

    Returns the columns; with a machine its signals in SI units on an even grid, as `identify` uses them, with remarks on
    all changes. `plot()` shows at a glance whether the recording was read correctly. Raises Error where it cannot be read
    or does not match the machine.

    >>> import numpy as np, stickslip
    >>> time = np.arange(0.0, 1.0, 1e-3)
    >>> recording = stickslip.read_recording({"time [s]": time, "angle [deg]": np.sin(time)})
    >>> list(recording), recording.units["angle"]
    (['time', 'angle'], 'deg')
    """
    table, name = table_and_name(recording)
    return Recording(table, name, None if machine is None else machine_of(machine))


def machine_of(machine: Machine) -> MachineFile:
    """Return the checked machine file."""
    if isinstance(machine, Mapping):
        return machine_file("machine", "\n".join(lines(machine)))
    return machine_file(os.fspath(machine), None)


def table_and_name(recording: Source) -> tuple[Table, str]:
    """Return the columns of any kind of recording, and its name in messages."""
    if isinstance(recording, Recording):
        return recording._table, recording.name
    if isinstance(recording, (str, os.PathLike)):
        path = os.fspath(recording)
        return read_table(path), path
    name = type(recording).__name__
    columns = [_column(title, unit, values) for title, unit, values in _items(recording)]
    return table_of(name, columns), name


def _items(recording: Any) -> Iterator[tuple[str, str | None, Any]]:
    """Yield name, unit and values of the columns; the kinds are recognised by their attributes, without an import."""
    if hasattr(recording, "collect") and hasattr(recording, "collect_schema"):
        recording = recording.collect()
    if isinstance(recording, Signals):
        yield from ((name, recording.units[name], values) for name, values in recording.items())
    elif hasattr(recording, "data_vars"):
        for name, values in {**recording.coords, **recording.data_vars}.items():
            yield str(name), values.attrs.get("units"), values
    elif hasattr(recording, "columns") and hasattr(recording, "__getitem__"):
        units = getattr(recording, "attrs", {}).get("units", {})
        index = getattr(recording, "index", None)
        # A named index, or one of times, is a column; row numbers are not.
        if index is not None and (index.name is not None or index.dtype.kind in "mM"):
            yield str(index.name or "time"), units.get(index.name), index
        yield from ((str(name), units.get(name), recording[name]) for name in recording.columns)
    elif isinstance(recording, Mapping):
        yield from ((str(name), None, values) for name, values in recording.items())
    elif getattr(getattr(recording, "dtype", None), "names", None):
        yield from ((name, None, recording[name]) for name in recording.dtype.names)
    else:
        kind = type(recording).__name__
        raise TypeError(f"The recording is a {kind}. Give a file, arrays by name, or a data frame.")


def _column(name: str, unit: str | None, values: Any) -> tuple[str, str | None, NDArray[np.float64]]:
    """Return a column with its numbers; cells that are not numbers are NaN."""
    # A bracket without a space before it is part of the name: position[0].
    stated = re.fullmatch(r"(.*\S)\s+[\[(]([^\[\]()]*)[\])]", name)
    if stated and unit is None:
        name, unit = stated[1], stated[2]
    array = values.to_numpy() if hasattr(values, "to_numpy") else np.asarray(values)
    if array.dtype.kind == "O" and str(getattr(values, "dtype", "")).startswith("datetime64"):
        # With a time zone: in UTC.
        array = np.asarray(values, "datetime64[ns]")
    if array.dtype.kind in "mM":
        # Dates as seconds since the first one, which keeps their digits.
        known = array[~np.isnat(array)]
        since = array - known[0] if array.dtype.kind == "M" and known.size else array
        seconds = since.astype("timedelta64[ns]").astype(np.float64) * 1e-9
        return name, "s", np.where(np.isnat(array), np.nan, seconds)
    if array.dtype.kind in "biuf":
        return name, unit or None, np.ascontiguousarray(array, np.float64)
    if array.dtype.kind == "c":
        raise InvalidValue(f"{name} has complex numbers. Give its real part or its magnitude.")
    return name, unit or None, np.array([_number(it) for it in array.ravel()]).reshape(array.shape)


def _number(cell: Any) -> float:
    try:
        return float(cell)
    except (TypeError, ValueError):
        return float("nan")
