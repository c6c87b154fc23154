"""Studies on a cluster: the same bytes as on one machine, also after the loss of workers."""

import os
import signal
import time

import numpy as np
import pytest

import stickslip

distributed = pytest.importorskip("distributed")

# Ignore warnings of Dask about workers that are killed on purpose and about their sockets.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")

PLAN = {
    "manoeuvres": ["sine_2hz"],
    "controller": "cascade+hold",
    "axis": [
        {"path": "plant.drive.load_inertia", "values": np.linspace(1.0e-3, 1.2e-3, 24)},
        {"name": "limit", "path": "bench.safety.following_error", "values": [1e-3, 2.0]},
    ],
}
PARTS = 6
CASES = 48


@pytest.fixture(scope="module")
def client():
    """Two workers of one thread each, in separate processes."""
    settings = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": ":0", "host": "127.0.0.1"}
    with distributed.LocalCluster(**settings) as cluster, distributed.Client(cluster) as client:
        yield client


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The study without a cluster: its folder and its results."""
    folder = tmp_path_factory.mktemp("alone")
    return folder, stickslip.study(PLAN, folder)


def bytes_of(folder):
    return (folder / "study.parquet").read_bytes()


def is_idle(client):
    """Whether no task or data of a study remains on the workers after running tasks have ended."""
    for _ in range(600):
        if not any(client.processing().values()) and not any(client.has_what().values()):
            return True
        time.sleep(0.1)
    return False


def test_a_study_on_a_cluster_has_the_bytes_of_one_machine(client, alone, tmp_path):
    folder, local = alone
    calls = []
    spread = stickslip.study(PLAN, tmp_path, cluster=client, progress=lambda *it: calls.append(it))
    assert bytes_of(tmp_path) == bytes_of(folder)
    assert spread.html() == local.html() and repr(spread) == repr(local)
    assert spread.kept == 0 and len(spread.failures) == CASES // 2
    done = [fraction for stage, fraction in calls if stage == "run the cases"]
    assert done == sorted(done) and len(done) == PARTS and done[-1] == 1.0
    assert any(stage == "tune the controller" for stage, _ in calls), "tuned once, not by each worker"
    # The folder is complete, so that no connection to a cluster is needed.
    repeated = stickslip.study(PLAN, tmp_path, cluster="tcp://127.0.0.1:1")
    assert repeated.kept == CASES and is_idle(client)


def test_the_loss_of_a_worker_does_not_change_the_results(client, alone, tmp_path):
    workers = client.run(os.getpid)
    assert len(workers) == 2

    def progress(stage, fraction):
        if stage == "run the cases" and workers:
            os.kill(workers.popitem()[1], signal.SIGKILL)
            workers.clear()

    results = stickslip.study(PLAN, tmp_path, cluster=client, progress=progress)
    assert not workers and results.kept == 0
    assert bytes_of(tmp_path) == bytes_of(alone[0])
    # Dask's nanny starts a new worker.
    client.wait_for_workers(2, timeout=60)


def test_an_interrupted_study_continues_locally_and_on_a_cluster(client, alone, tmp_path):
    class Enough(Exception):
        pass

    def after(part):
        def progress(stage, fraction):
            if stage == "run the cases" and fraction >= part:
                raise Enough

        return progress

    with pytest.raises(Enough):
        stickslip.study(PLAN, tmp_path, cluster=client, progress=after(0.1))
    parts = len(list((tmp_path / "parts").iterdir()))
    assert 1 <= parts < PARTS and not (tmp_path / "study.parquet").exists()
    assert is_idle(client), "submitted parts are cancelled"
    with pytest.raises(Enough):
        stickslip.study(PLAN, tmp_path, threads=1, progress=after(0.1))
    results = stickslip.study(PLAN, tmp_path, cluster=client)
    assert results.kept > 8 * parts
    assert bytes_of(tmp_path) == bytes_of(alone[0])


def test_ctrl_c_ends_a_study_on_a_cluster(client, tmp_path):
    def progress(stage, fraction):
        if stage == "run the cases":
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        stickslip.study(PLAN, tmp_path, cluster=client, progress=progress)
    assert list((tmp_path / "parts").iterdir()) and is_idle(client)


def test_a_worker_with_another_version_is_refused(client, tmp_path):
    def set_version(version):
        import stickslip

        stickslip.__version__, version = version, stickslip.__version__
        return version

    (worker, own), *_ = client.run(set_version, "0.0.1").items()
    try:
        with pytest.raises(stickslip.Error, match=f"tcp://.* has stickslip 0.0.1, but this machine has {own}. Install the same"):
            stickslip.study(PLAN, tmp_path, cluster=client)
    finally:
        client.run(set_version, own)
    assert is_idle(client)
    # No part of that worker was stored.
    assert list((tmp_path / "parts").iterdir()) == []


def test_a_worker_without_stickslip_is_named(client, tmp_path):
    def hide(module):
        import sys

        sys.modules["stickslip"], module = module, sys.modules.get("stickslip")
        return module is not None

    def restore():
        import sys

        del sys.modules["stickslip"]

    client.run(hide, None)
    try:
        with pytest.raises(stickslip.Error, match="tcp://.* has no stickslip .* Finished parts are saved"):
            stickslip.study(PLAN, tmp_path, cluster=client)
    finally:
        client.run(restore)


def test_memory_is_bounded_by_the_threads_of_the_workers(client, alone, tmp_path, monkeypatch):
    parts, most = [], 0
    submit = distributed.Client.submit

    def counted(self, function, *arguments, **keywords):
        nonlocal most
        future = submit(self, function, *arguments, **keywords)
        if "-part-" in future.key:
            parts.append(future)
            most = max(most, sum(not one.done() for one in parts))
        return future

    monkeypatch.setattr(distributed.Client, "submit", counted)
    stickslip.study(PLAN, tmp_path, cluster=client)
    assert 0 < most <= 4 and len(parts) == PARTS


def test_the_loss_of_the_scheduler_is_reported_and_finished_parts_are_saved(client, tmp_path, monkeypatch):
    nthreads, folder = distributed.Client.nthreads, tmp_path / "parts"

    def gone(self):
        if any(folder.glob("*.parquet")):
            raise OSError("Timed out.")
        return nthreads(self)

    monkeypatch.setattr(stickslip._cluster, "LOOK", 0.0)
    monkeypatch.setattr(distributed.Client, "nthreads", gone)
    with pytest.raises(stickslip.Error, match=r"The cluster failed: Timed out\. Finished parts are saved; repeat"):
        stickslip.study(PLAN, tmp_path, cluster=client)
    assert any(folder.glob("*.parquet"))


def test_only_a_cluster_requires_dask(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(stickslip.Error, match=r'pip install "stickslip\[dask\]"'):
        stickslip.study(PLAN, tmp_path, cluster="tcp://127.0.0.1:8786")


def test_an_asynchronous_client_is_refused(client, tmp_path, monkeypatch):
    monkeypatch.setattr(distributed.Client, "asynchronous", True)
    with pytest.raises(stickslip.Error, match="asynchronous=False"):
        stickslip.study(PLAN, tmp_path, cluster=client)
