"""A study on the workers of a Dask cluster. Who runs what, and what becomes of a worker that is lost, is Dask's business."""

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
"""Parts for each thread of the workers that are on their way: one runs, the next is there when it ends."""
FEWEST = 4
"""Parts on their way at least, so that a cluster that grows with its work has a reason to."""
LOOK = 1.0
"""Between two looks at how many threads there are [s]."""


def run(parts: StudyParts, cluster: Any, progress: Progress | None) -> None:
    """Runs what is missing of a study on a cluster: a client of one, or what a client is made of."""
    try:
        import distributed as module
    except ImportError as error:
        raise Error('A study on a cluster needs Dask. Install it with pip install "stickslip[dask]".') from error
    # Most of it says nothing of its types.
    distributed: Any = module
    missing = parts.missing()
    if not missing:
        return
    if not isinstance(cluster, distributed.Client):
        with distributed.Client(cluster) as client:
            return run(parts, client, progress)
    if cluster.asynchronous:
        raise Error("A study waits for its cluster: give it a client that was made with asynchronous=False.")
    total, done = sum(cases for _, cases in missing), 0
    waiting, running = iter(missing), dict[Any, tuple[int, int]]()
    name = f"stickslip-{uuid.uuid4().hex}"
    part, threads = _part(), _threads(cluster)
    completed = distributed.as_completed(with_results=True)
    with _told():
        # The result of a task, so that Dask can make it again where the worker that has it is lost.
        work = cluster.submit(str, parts.work(), key=f"{name}-work")
    try:
        while True:
            with _told():
                ahead = max(FEWEST, AHEAD * next(threads))
                for index, cases in islice(waiting, max(0, ahead - len(running))):
                    future = cluster.submit(part, work, index, key=f"{name}-part-{index}")
                    running[future] = index, cases
                    completed.add(future)
                if not running:
                    return
                future, found = next(completed)
                if isinstance(found, BaseException):
                    raise found
            index, cases = running.pop(future)
            parts.put(index, found)
            done += cases
            if progress is not None:
                progress("run the cases", done / total)
    finally:
        # What is not running yet never will. Without a scheduler there is nothing to cancel.
        with contextlib.suppress(Exception):
            cluster.cancel([work, *running])


def _threads(client: Any) -> Iterator[int]:
    """How many threads the workers have, now and again: workers come and go."""
    looked, threads = -LOOK, 0
    while True:
        if time.monotonic() - looked >= LOOK:
            looked, threads = time.monotonic(), sum(client.nthreads().values())
        yield threads


@contextlib.contextmanager
def _told() -> Iterator[None]:
    """What a cluster says is an error of the study, which says that nothing is lost."""
    try:
        yield
    except Error:
        raise
    except Exception as error:
        words = f"The cluster has given up: {str(error).rstrip('.')}. What is finished is kept"
        raise Error(f"{words}, and the same call goes on from there.") from error


def _part() -> Callable[[str, int], bytes]:
    """The task that runs a part. It goes to the workers as it stands, so that it can tell of one that has no stickslip, or
    another one."""
    version = _stickslip.__version__

    def part(work: str, index: int) -> bytes:
        import distributed

        where = f"The worker {distributed.get_worker().address}"
        try:
            import stickslip
        except ImportError as error:
            raise RuntimeError(f"{where} has no stickslip ({error}). Install {version} there.") from None
        if stickslip.__version__ != version:
            other = f"{where} has stickslip {stickslip.__version__}, and this is {version}."
            raise RuntimeError(f"{other} Install the same version on all machines.")
        from stickslip._cluster import _work

        return _work(work).part(index)

    return part


@lru_cache(maxsize=4)
def _work(text: str) -> StudyWork:
    """A work that a worker was sent: read once, whatever the number of its parts."""
    return StudyWork(text)
