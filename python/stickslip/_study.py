"""Parameter studies: effect of parameter changes on a manoeuvre."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Iterator, Mapping
from typing import Any

from . import _cluster, _stickslip
from ._bench import Progress
from ._files import lines
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
    """Run a manoeuvre with varied parameters of the machine, the model or the controller.

    - `plan`: file of the study, or a mapping with the contents of such a file; its `preset` may be a Preset.
    - `folder`: folder for finished parts and `study.parquet`. A repeated call with the same study continues there.
      Default: a temporary folder; an interruption then loses all results.
    - `threads`: number of threads. Default: one per processor.
    - `cluster`: `distributed.Client`, Dask cluster or its address. Its workers run the cases; the results are stored in
      the local folder, so that the loss of a worker loses no finished part.

    Returns a Study. The numbers equal those of `stickslip study` for any number of threads or workers. Raises
    InvalidValue or UnknownName for an error in the plan before a case runs.

    >>> import stickslip
    >>> results = stickslip.study({
    ...     "preset": stickslip.preset("prototype"),
    ...     "manoeuvres": ["sine_2hz"],
    ...     "set": {"bench.compensation.kind": "feedforward"},
    ...     "axis": [{"name": "model", "path": "model.own.kinetic_torque", "factor": True, "values": [0.5, 1.0]}],
    ... })
    >>> wrong, right = results["sine_2hz_rms"]
    >>> bool(right < wrong), results.units["sine_2hz_rms"], results.failures
    (True, 'rad', {})
    """
    temporary = None if folder is not None else tempfile.mkdtemp(prefix="stickslip-study-")
    try:
        path = os.fspath(folder) if folder is not None else str(temporary)
        if isinstance(plan, Mapping):
            bench = plan.get("preset")
            bench = bench if isinstance(bench, Preset) else None
            entries = {name: value for name, value in plan.items() if value is not bench}
            parts = _stickslip.open_study(None, "\n".join(_file(entries)), bench, path, progress)
            made_by = f"stickslip.study({dict(plan)})"
        else:
            parts = _stickslip.open_study(os.fspath(plan), "", None, path, progress)
            made_by = f"stickslip.study({os.fspath(plan)!r})"
        if cluster is None:
            parts.run(threads, progress)
        else:
            _cluster.run(parts, cluster, progress)
        outcome, columns, failures, axes, grid, kept = parts.finish()
        results = Study(outcome, made_by, columns, failures, axes, grid, kept)
    except BaseException:
        if temporary is not None:
            shutil.rmtree(temporary, ignore_errors=True)
        raise
    if temporary is not None:
        weakref.finalize(results, shutil.rmtree, temporary, ignore_errors=True)
    return results


def _file(plan: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of the equivalent study file."""
    groups = ("set", "design", "axis")
    yield from lines({name: value for name, value in plan.items() if name not in groups})
    for name in groups[:2]:
        if name in plan:
            yield f"[{name}]"
            yield from lines(plan[name])
    for axis in plan.get("axis", ()):
        yield "[[axis]]"
        yield from lines(axis)
