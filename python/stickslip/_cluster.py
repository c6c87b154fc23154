"""Studies on the workers of a Dask cluster. Dask assigns the parts and repeats those of a lost worker."""

from __future__ import annotations

import contextlib
import time
import uuid
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import islice
from typing import Any

from . import _stickslip
from ._bench import Progress
from ._errors import Error
from ._stickslip import StudyParts, StudyWork

AHEAD = 2
"""Submitted parts per worker thread: one runs, the next one waits."""
FEWEST = 4
"""Smallest number of submitted parts, so that an adaptive cluster starts workers."""
LOOK = 1.0
"""Interval between two counts of the worker threads [s]."""


def run(parts: StudyParts, cluster: Any, progress: Progress | None) -> None:
    """Run the missing parts of a study on a cluster: a client, or the address or cluster to create one from."""
    try:
        import distributed as module
    except ImportError as error:
        raise Error('Dask is not installed. Install it with pip install "stickslip[dask]".') from error
    # Most of the module has no type annotations.
    distributed: Any = module
    missing = parts.missing()
    if not missing:
        return
    if not isinstance(cluster, distributed.Client):
        with distributed.Client(cluster) as client:
            return run(parts, client, progress)
    if cluster.asynchronous:
        raise Error("The client is asynchronous. Create it with asynchronous=False.")
    total, done = sum(cases for _, cases in missing), 0
    waiting, running = iter(missing), dict[Any, tuple[int, int]]()
    name = f"stickslip-{uuid.uuid4().hex}"
    part, threads = _part(), _threads(cluster)
    completed = distributed.as_completed(with_results=True)
    with _cluster_errors():
        # The result of a task, so that Dask can recompute it after the loss of its worker.
        work = cluster.submit(str, parts.work(), key=f"{name}-work")
    try:
        while True:
            with _cluster_errors():
                ahead = max(FEWEST, AHEAD * next(threads))
                for index, cases in islice(waiting, max(0, ahead - len(running))):
                    future = cluster.submit(part, work, index, key=f"{name}-part-{index}")
                    running[future] = index, cases
                    completed.add(future)
                if not running:
                    return
                future, result = next(completed)
                if isinstance(result, BaseException):
                    raise result
            index, cases = running.pop(future)
            parts.put(index, result)
            done += cases
            if progress is not None:
                progress("run the cases", done / total)
    finally:
        # Cancel waiting parts. This fails without a scheduler, where nothing is left to cancel.
        with contextlib.suppress(Exception):
            cluster.cancel([work, *running])


def _threads(client: Any) -> Iterator[int]:
    """Yield the current number of worker threads, which may change."""
    last_count, threads = -LOOK, 0
    while True:
        if time.monotonic() - last_count >= LOOK:
            last_count, threads = time.monotonic(), sum(client.nthreads().values())
        yield threads


@contextlib.contextmanager
def _cluster_errors() -> Iterator[None]:
    """Convert errors of the cluster into an Error of the study."""
    try:
        yield
    except Error:
        raise
    except Exception as error:
        cause = f"The cluster failed: {str(error).rstrip('.')}. Finished parts are saved"
        raise Error(f"{cause}; repeat the same call to continue.") from error


def _part() -> Callable[[str, int], bytes]:
    """Return the task that runs a part. It is sent to the workers as source, so that it can report a worker without
    stickslip or with another version."""
    version = _stickslip.__version__

    def part(work: str, index: int) -> bytes:
        import distributed

        worker = f"The worker {distributed.get_worker().address}"
        try:
            import stickslip
        except ImportError as error:
            raise RuntimeError(f"{worker} has no stickslip ({error}). Install version {version} there.") from None
        if stickslip.__version__ != version:
            cause = f"{worker} has stickslip {stickslip.__version__}, but this machine has {version}."
            raise RuntimeError(f"{cause} Install the same version on all machines.")
        from stickslip._cluster import _work

        return _work(work).part(index)

    return part


@lru_cache(maxsize=4)
def _work(text: str) -> StudyWork:
    """Parse the description of a study, once for all parts on a worker."""
    return StudyWork(text)
