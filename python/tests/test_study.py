"""Parameter studies with the bytes of the command line; pickles of results."""

import copy
import pathlib
import pickle
import re
import signal
import subprocess
import threading

import matplotlib.pyplot as plt
import numpy as np
import pytest

import stickslip

FACTORS = [0.5, 1.0, 1.5]
INERTIAS = [1.2e-3, 1.0e-3]

FILE = f"""
title = "Model and inertia"
manoeuvres = ["sine_2hz"]

[set]
bench.compensation.kind = "feedforward"

[[axis]]
name = "model"
path = ["model.own.breakaway_torque", "model.own.kinetic_torque"]
factor = true
values = {FACTORS}

[[axis]]
path = "plant.drive.load_inertia"
values = {INERTIAS}
"""

# The contents of the file as Python objects.
PLAN = {
    "title": "Model and inertia",
    "manoeuvres": ("sine_2hz",),
    "set": {"bench": {"compensation.kind": "feedforward"}},
    "axis": [
        {
            "name": "model",
            "path": ["model.own.breakaway_torque", "model.own.kinetic_torque"],
            "factor": np.True_,
            "values": np.array(FACTORS),
        },
        {"path": "plant.drive.load_inertia", "values": INERTIAS},
    ],
}


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(FILE)
    return path


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return stickslip.study(PLAN, tmp_path_factory.mktemp("study"))


def bytes_of(folder):
    return (pathlib.Path(folder) / "study.parquet").read_bytes()


def test_a_study_has_the_bytes_of_the_command_line(program, file, results, tmp_path):
    out = tmp_path / "theirs"
    output = subprocess.run([program, "study", file, "--out", out], check=True, capture_output=True, text=True).stdout
    ours = stickslip.study(file, tmp_path / "ours", threads=1)
    assert bytes_of(tmp_path / "ours") == bytes_of(out)
    ours.write(tmp_path / "ours")
    assert (tmp_path / "ours/summary.json").read_bytes() == (out / "summary.json").read_bytes()
    command = re.compile(r"stickslip[ .]study[^<\"]*")
    pages = [command.sub("", (folder / "report.html").read_text()) for folder in (tmp_path / "ours", out)]
    assert pages[0] == pages[1] and len(pages[0]) > 10_000
    assert output.splitlines()[0] in repr(ours)
    # The same study from a mapping; a written report contains the rows.
    results.write(tmp_path / "mapping")
    assert bytes_of(tmp_path / "mapping") == bytes_of(out)


def test_rows_are_arrays_with_names_and_units(results):
    assert list(results) == ["case", "model", "plant.drive.load_inertia", "sine_2hz_rms", "plant_step", "step_error"]
    assert results.axes == ["model", "plant.drive.load_inertia"] and results.measures == ["sine_2hz_rms"]
    assert results["case"].tolist() == [1, 2, 3, 4, 5, 6] and results["model"].tolist() == [0.5, 0.5, 1, 1, 1.5, 1.5]
    units = {"case": "1", "model": "1", "plant.drive.load_inertia": "kg m^2", "sine_2hz_rms": "rad"}
    assert results.units == units | {"plant_step": "s", "step_error": "1"}
    assert (results["plant_step"] > 1e-6).all() and (results["step_error"] >= 0.0).all()
    assert results.failures == {} and results.summary["study.cases"] == 6
    deviation = results["sine_2hz_rms"]
    assert deviation[2] < deviation[0] and deviation[2] < deviation[4], "an exact model compensates best"
    assert "6 cases on prototype. 2 Hz, RMS: " in repr(results) and "mrad (case " in repr(results)
    assert "Model and inertia" in results.html() and "svg" in results.html()


def test_a_grid_converts_to_xarray_with_its_axes_as_dimensions(results):
    table = results.to_xarray()
    assert table.sine_2hz_rms.dims == ("model", "plant.drive.load_inertia") and table.sine_2hz_rms.shape == (3, 2)
    assert table.sine_2hz_rms.attrs["units"] == "rad"
    assert table.step_error.dims == table.sine_2hz_rms.dims
    assert table.coords["plant.drive.load_inertia"].attrs["units"] == "kg m^2"
    one = table.sel({"model": 1.0, "plant.drive.load_inertia": 1.0e-3})
    assert one.case == 4 and one.sine_2hz_rms == results["sine_2hz_rms"][3] and one.failure == ""


def test_a_sampled_study_converts_to_xarray_by_case_and_lists_effects():
    axes = [
        {"name": "model", "path": "model.own.kinetic_torque", "factor": True, "range": [0.5, 1.5]},
        {"name": "inertia", "path": "plant.drive.load_inertia", "range": (1e-3, 2e-3), "logarithmic": True},
    ]
    plan = PLAN | {"axis": axes, "design": {"kind": "morris", "trajectories": 2}}
    results = stickslip.study(plan)
    table = results.to_xarray()
    assert table.sine_2hz_rms.dims == ("case",) and table.case.values.tolist() == [1, 2, 3, 4, 5, 6]
    assert table.coords["inertia"].dims == ("case",) and table.inertia.attrs["units"] == "kg m^2"
    effects = [row for row in results.summary.records if row["kind"] == "effects"]
    assert [row["axis"] for row in effects] == ["model", "inertia"] and all(row["magnitude"] > 0 for row in effects)


def test_failed_cases_are_nan_and_have_a_reason():
    axes = [
        {"name": "jitter", "path": "plant.tick_jitter", "values": [0.0, 40e-6]},
        {"name": "limit", "path": "bench.safety.following_error", "values": [1e-3, 2.0]},
    ]
    results = stickslip.study(PLAN | {"axis": axes})
    assert np.isnan(results["sine_2hz_rms"]).tolist() == [True, False, True, True]
    assert set(results.failures) == {1, 3, 4}
    assert results.failures[1] == "sine_2hz: the supervision stopped it, since it did not follow the set-point"
    assert "plant.tick_jitter" in results.failures[3] and "case 3" in results.failures[3]
    assert results.to_xarray().failure.sel(jitter=0.0, limit=1e-3) == results.failures[1]
    assert "3 cases failed" in repr(results)


def test_a_study_is_plotted(results):
    ax = results.plot()
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("plant.drive.load inertia [kg m^2]", "model [1]")
    (mesh,) = ax.collections
    # Inertias decrease in the plan and increase in the map.
    assert mesh.get_array().tolist() == results["sine_2hz_rms"].reshape(3, 2)[:, ::-1].tolist()
    assert ax.figure.axes[1].get_ylabel() == "sine 2hz rms [rad]"
    turned = results.plot("sine_2hz_rms", "model", "plant.drive.load_inertia")
    assert turned.get_xlabel() == "model [1]" and turned.collections[0].get_array().shape == (2, 3)
    ax = results.plot("model")
    assert ax.get_xlabel() == "model [1]" and ax.get_lines()[0].get_xdata().tolist() == results["model"].tolist()
    with pytest.raises(KeyError):
        results.plot("modle")
    plt.close("all")


def test_a_study_accepts_a_preset_object():
    bench = stickslip.preset("prototype").set({"plant.drive.load_inertia": 1.1e-3})
    axes = [{"path": "model.own.kinetic_torque", "factor": True, "values": [1.0]}]
    (ours,) = stickslip.study({"preset": bench, "manoeuvres": ["sine_2hz"], "axis": axes})["sine_2hz_rms"]
    same = {"set": {"plant.drive.load_inertia": 1.1e-3}, "manoeuvres": ["sine_2hz"], "axis": axes}
    (theirs,) = stickslip.study(same)["sine_2hz_rms"]
    (other,) = stickslip.study(same | {"set": {}})["sine_2hz_rms"]
    assert ours == theirs != other


def test_errors_in_a_plan_are_raised_before_a_case_runs(file, tmp_path):
    with pytest.raises(stickslip.InvalidValue, match=r"unknown parameter manoevres \(study\). Did you mean manoeuvres\?"):
        stickslip.study({"manoevres": ["creep"]})
    with pytest.raises(stickslip.InvalidValue, match="plant.drive.load_inertia = 5 kg m\\^2 is outside"):
        stickslip.study(PLAN | {"axis": [{"path": "plant.drive.load_inertia", "values": [5]}]})
    with pytest.raises(stickslip.UnknownName, match="unknown manoeuvre crawl"):
        stickslip.study(PLAN | {"manoeuvres": ["crawl"]})
    with pytest.raises(TypeError, match="seeds is a complex. Give a number"):
        stickslip.study(PLAN | {"seeds": 1j})
    file.write_text(FILE.replace("manoeuvres", "manoevres"))
    with pytest.raises(stickslip.InvalidValue, match=r"plan.toml:3\). Did you mean manoeuvres\?"):
        stickslip.study(file)
    with pytest.raises(stickslip.FileError, match="absent.toml"):
        stickslip.study(tmp_path / "absent.toml")


def test_an_interrupted_study_continues_with_the_missing_parts(tmp_path):
    class Enough(Exception):
        pass

    calls = []

    def progress(stage, fraction):
        calls.append((stage, fraction))
        if fraction > 0.5:
            raise Enough

    values = np.linspace(1.0e-3, 1.2e-3, 24)
    plan = PLAN | {"axis": [{"path": "plant.drive.load_inertia", "values": values}]}
    with pytest.raises(Enough):
        stickslip.study(plan, tmp_path / "often", threads=1, progress=progress)
    assert calls[0][0] == "run the cases" and not (tmp_path / "often/study.parquet").exists()
    continued = stickslip.study(plan, tmp_path / "often")
    # Two of three parts are finished, or all three if the thread was faster than the interruption.
    assert continued.kept in (16, 24)
    whole = stickslip.study(plan, tmp_path / "once")
    assert whole.kept == 0 and bytes_of(tmp_path / "once") == bytes_of(tmp_path / "often")
    assert continued.html() == whole.html()
    assert stickslip.study(plan, tmp_path / "once").kept == 24


def test_ctrl_c_ends_a_study(tmp_path):
    timer = threading.Timer(0.5, signal.raise_signal, (signal.SIGINT,))
    # The whole study takes hours.
    axes = [{"path": "plant.drive.load_inertia", "range": [1e-3, 1.2e-3], "points": 1_000_000}]
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        stickslip.study(PLAN | {"axis": axes}, tmp_path)
    timer.join()


def same(one, other, folder):
    """Assert that two results print and write the same."""
    assert type(one) is type(other) and repr(one) == repr(other)
    assert dict(one.summary) == pytest.approx(dict(other.summary), rel=0, abs=0, nan_ok=True)
    assert one.remarks == other.remarks and one.html() == other.html() and one.units == other.units
    for name in one:
        np.testing.assert_array_equal(one[name], other[name])
    for name, it in (("one", one), ("other", other)):
        it.write(folder / name)
    files = {it.name: it.read_bytes() for it in (folder / "one").iterdir()}
    assert files == {it.name: it.read_bytes() for it in (folder / "other").iterdir()} and "report.html" in files


def test_a_pickled_study_does_not_need_its_folder(tmp_path):
    results = stickslip.study(PLAN)
    text = pickle.dumps(results)
    restored = pickle.loads(text)
    same(results, restored, tmp_path / "now")
    assert restored.failures == results.failures and restored.axes == results.axes
    assert restored.to_xarray().identical(results.to_xarray())
    assert len(pickle.dumps(restored)) == len(text)
    # The temporary folder is deleted with the study; the pickle does not need it.
    del results
    restored.write(tmp_path / "later")
    assert bytes_of(tmp_path / "later") == bytes_of(tmp_path / "now/one")


def test_every_result_can_be_pickled(bench, curve, tmp_path):
    design = stickslip.design(bench, [(0.5, 0.26), (2.0, 0.17), (30.0, 0.16)])
    results = [
        curve,
        stickslip.fit(curve),
        stickslip.fit([1, 2, 3, 4, 5, 6], [0.3, 0.28, 0.27, 0.265, 0.262, 0.26], side="positive"),
        design,
        stickslip.loop(bench),
        stickslip.hunting(bench, duration=2.0),
        stickslip.measure(bench, "breakaway", plan={"angles": 1, "repetitions": 2}),
    ]
    for k, result in enumerate(results):
        restored = pickle.loads(pickle.dumps(result))
        same(result, restored, tmp_path / str(k))
        assert repr(copy.deepcopy(result)) == repr(result)
    restored = pickle.loads(pickle.dumps(results[1]))
    assert restored.on(bench) == results[1].on(bench)
    np.testing.assert_array_equal(restored.predict([1.0, 2.0]), results[1].predict([1.0, 2.0]))
    assert pickle.loads(pickle.dumps(design)).preset == design.preset
    with pytest.raises(stickslip.FileError, match="cannot write it"):
        restored.write(tmp_path / "0/one/report.html")
    run = stickslip.simulate(bench, {"reference": "sine", "amplitude": 1.0, "frequency": 2.0}, 0.1)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(run))["true_angle"], run["true_angle"])
