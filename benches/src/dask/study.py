"""Time a study on the threads of this machine and on a Dask cluster with the same number of processes, in turn.

study.py CASES ROUNDS: print the seconds of the fastest run of each. Fails if the files differ in any byte."""

import pathlib
import sys
import tempfile
import time

import distributed
import stickslip

WORKERS = 2


def timed(cases, cluster=None):
    axis = {"path": "plant.drive.load_inertia", "range": [1.0e-3, 1.2e-3], "points": cases}
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        stickslip.study({"manoeuvres": ["sine_2hz"], "axis": [axis]}, folder, threads=WORKERS, cluster=cluster)
        return time.perf_counter() - start, pathlib.Path(folder, "study.parquet").read_bytes()


if __name__ == "__main__":
    cases, rounds = int(sys.argv[1]), int(sys.argv[2])
    best = [float("inf")] * 2
    with (
        distributed.LocalCluster(n_workers=WORKERS, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster,
        distributed.Client(cluster) as client,
    ):
        timed(64, client)
        for _ in range(rounds):
            (local, local_bytes), (remote, remote_bytes) = timed(cases), timed(cases, client)
            if local_bytes != remote_bytes:
                sys.exit("the files differ")
            best = [min(best[0], local), min(best[1], remote)]
    print(*best)
