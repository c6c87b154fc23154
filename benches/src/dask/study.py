"""One study by the threads of this machine and by the workers of a Dask cluster of as many processes, in turn.

study.py CASES ROUNDS: seconds of the fastest of each; the files are the same, byte for byte, or it fails."""

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
        begin = time.perf_counter()
        stickslip.study({"manoeuvres": ["sine_2hz"], "axis": [axis]}, folder, threads=WORKERS, cluster=cluster)
        return time.perf_counter() - begin, pathlib.Path(folder, "study.parquet").read_bytes()


if __name__ == "__main__":
    cases, rounds = int(sys.argv[1]), int(sys.argv[2])
    best = [float("inf")] * 2
    with (
        distributed.LocalCluster(n_workers=WORKERS, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster,
        distributed.Client(cluster) as client,
    ):
        timed(64, client)
        for _ in range(rounds):
            (here, one), (spread, other) = timed(cases), timed(cases, client)
            if one != other:
                sys.exit("the files differ")
            best = [min(best[0], here), min(best[1], spread)]
    print(*best)
