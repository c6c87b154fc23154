"""Runs of a project: the catalogue, and replay of their records."""

from __future__ import annotations

import dataclasses
import json
import os
import pathlib

from . import _stickslip
from ._bench import Progress
from ._errors import FileError
from ._recording import Recording, read_recording


@dataclasses.dataclass(frozen=True)
class Replay:
    """Result of a replay, compared bit by bit."""

    cycles: int
    """Replayed cycles."""
    recorded: int
    """Cycles of the record."""
    machine: bool
    """Whether the virtual machine was simulated too."""
    lost: int
    """Cycles missing in the record after the last replayed one."""
    first: tuple[int, str, str, float, float] | None
    """The first difference: cycle, block, signal, recorded and replayed value. None without a difference."""
    text: str
    """The result in a sentence."""

    @property
    def identical(self) -> bool:
        """Whether the whole record was replayed without a difference."""
        return self.first is None and self.cycles == self.recorded

    def __repr__(self) -> str:
        return self.text


@dataclasses.dataclass(frozen=True)
class Run:
    """A run of the catalogue."""

    number: int
    """Number, unique in the project."""
    name: str
    """Name."""
    kind: str
    """Its command, such as "demo" or "measure friction", or "recording"."""
    begun: str
    """Start time in UTC (RFC 3339)."""
    duration: float | None
    """Bench time, or elapsed time of a run without a bench [s]."""
    preset: str
    """The preset in its command; may be empty."""
    controller: str
    """The position controller."""
    law: str
    """The rendering law."""
    tags: tuple[str, ...]
    """Tags, sorted."""
    note: str
    """Note of the user."""
    command: str
    """The command line."""
    version: str
    """Version of the program."""
    state: str
    """Availability of its files: "here", "missing", "replaced" or "deleted"."""
    folder: str | None
    """Folder or file of the run; None where its files are not available."""
    record: str | None
    """Path of its record of every cycle; None without one."""

    def read(self) -> Recording:
        """Read its record of every cycle. Raises FileError where there is none."""
        return read_recording(self._record())

    def replay(self, *, progress: Progress | None = None) -> Replay:
        """Replay its record. Raises FileError where there is none."""
        return replay(self._record(), progress=progress)

    def _record(self) -> str:
        if self.record is None:
            raise FileError(f"Run {self.number} has no record of every cycle. Repeat it with --record.")
        return self.record


def runs(query: str = "", *, project: str | os.PathLike[str] | None = None, limit: int = 50) -> list[Run]:
    """List the runs of the working folder, the newest first.

    - `query`: as for `stickslip runs`: words; "law:bristle", "tag:good"; "M_S>0.2" for parameters and results. Default:
      all runs.
    - `project`: project folder of a running bench outside the working folder.
    - `limit`: largest number of runs.

    Terms that are not understood are ignored. Raises FileError where the catalogue cannot be read.
    """
    found, _ = _stickslip.runs_of(query, None if project is None else os.fspath(project), limit)
    return [_run(json.loads(text), folder) for text, folder in found]


def _run(facts: dict[str, object], folder: str | os.PathLike[str] | None) -> Run:
    names = {field.name for field in dataclasses.fields(Run)}
    facts = {name: value for name, value in facts.items() if name in names}
    record = facts["record"]
    if folder is not None and isinstance(record, str):
        path = pathlib.Path(folder)
        record = os.fspath(path / record if path.is_dir() else path)
    else:
        record = None
    tags = facts["tags"]
    facts["tags"] = tuple(tags) if isinstance(tags, list) else ()
    facts |= {"folder": None if folder is None else os.fspath(folder), "record": record}
    return Run(**facts)  # type: ignore[arg-type]


def replay(run: str | os.PathLike[str] | int, *, progress: Progress | None = None) -> Replay:
    """Replay a recorded run and compare it bit by bit with this version of the software.

    - `run`: the file of a record, a folder with its `run.mf4`, or a number in the catalogue.

    Returns the Replay. Raises FileError for a missing record, Error for a record of another version.
    """
    path = pathlib.Path(_stickslip.folder_of_run(run) if isinstance(run, int) else run)
    if path.is_dir():
        path /= "run.mf4"
    return Replay(*_stickslip.replay_record(os.fspath(path), progress))
