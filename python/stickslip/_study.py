"""Parameter studies: what becomes of a manoeuvre when parameters change."""

from __future__ import annotations

import json
import numbers
import os
import re
import shutil
import tempfile
import weakref
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from . import _cluster, _stickslip
from ._bench import Progress
from ._results import Study
from ._stickslip import Preset


def study(
    plan: str | os.PathLike[str] | Mapping[str, Any],
    folder: str | os.PathLike[str] | None = None,
    *,
    threads: int | None = None,
    cluster: Any = None,
    progress: Progress | None = None,
) -> Study:
    """What becomes of a manoeuvre when parameters of the machine, of the belief or of the controller change.

    `plan` is the file of a study, or a mapping of what such a file says; its `preset` may be a Preset. What is finished
    lies in `folder`, from which the same study goes on after an interruption, and `study.parquet` is there at the end.
    Without a folder an interruption leaves nothing. The numbers are those of `stickslip study`, whatever the `threads`.

    `cluster` is a `distributed.Client`, an address for one, or a cluster of Dask: its workers then run the cases, and the
    bytes are the same. What is finished comes to the folder here, and nothing of it is lost with a worker.

    >>> import stickslip
    >>> found = stickslip.study({
    ...     "preset": stickslip.preset("prototype"),
    ...     "manoeuvres": ["sine_2hz"],
    ...     "set": {"bench.compensation.kind": "feedforward"},
    ...     "axis": [{"name": "belief", "path": "model.own.kinetic_torque", "factor": True, "values": [0.5, 1.0]}],
    ... })
    >>> wrong, right = found["sine_2hz_rms"]
    >>> bool(right < wrong), found.units["sine_2hz_rms"], found.failures
    (True, 'rad', {})
    """
    own = None if folder is not None else tempfile.mkdtemp(prefix="stickslip-study-")
    try:
        at = os.fspath(folder) if folder is not None else str(own)
        if isinstance(plan, Mapping):
            bench = plan.get("preset")
            bench = bench if isinstance(bench, Preset) else None
            said = {name: value for name, value in plan.items() if value is not bench}
            parts = _stickslip.open_study(None, "\n".join(_file(said)), bench, at, progress)
            made_by = f"stickslip.study({dict(plan)})"
        else:
            parts = _stickslip.open_study(os.fspath(plan), "", None, at, progress)
            made_by = f"stickslip.study({os.fspath(plan)!r})"
        if cluster is None:
            parts.run(threads, progress)
        else:
            _cluster.run(parts, cluster, progress)
        outcome, columns, failures, axes, grid, kept = parts.finish()
        found = Study(outcome, made_by, columns, failures, axes, grid, kept)
    except BaseException:
        if own is not None:
            shutil.rmtree(own, ignore_errors=True)
        raise
    if own is not None:
        weakref.finalize(found, shutil.rmtree, own, ignore_errors=True)
    return found


def _file(plan: Mapping[str, Any]) -> Iterator[str]:
    """The lines of the file that says the same."""
    groups = ("set", "design", "axis")
    yield from _rows({name: value for name, value in plan.items() if name not in groups})
    for name in groups[:2]:
        if name in plan:
            yield f"[{name}]"
            yield from _rows(plan[name])
    for axis in plan.get("axis", ()):
        yield "[[axis]]"
        yield from _rows(axis)


def _rows(values: Mapping[str, Any], group: str = "") -> Iterator[str]:
    for name, value in values.items():
        parts = name.split(".")
        key = group + ".".join(it if re.fullmatch(r"[\w-]+", it, re.ASCII) else json.dumps(it) for it in parts)
        if isinstance(value, Mapping):
            yield from _rows(value, f"{key}.")
        else:
            yield f"{key} = {_value(key, value)}"


def _value(key: str, value: Any) -> str:
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    # Before numbers: to Python a truth value is one of them.
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if isinstance(value, Iterable):
        return f"[{', '.join(_value(key, it) for it in value)}]"
    words = f"{key} is a {type(value).__name__}. Give a number, True or False, a name, or a list of them."
    raise TypeError(words)
