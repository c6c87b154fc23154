"""Recordings of real machines: files, frames and arrays; identification, validation, calibration, runs."""

import dataclasses
import datetime
import pathlib
import pickle
import subprocess

import matplotlib.pyplot as plt
import numpy as np
import pytest
from test_bench import same, summary_of

import stickslip

DATA = pathlib.Path(__file__).parents[2] / "data/emps"
MACHINE = {
    "name": "axis",
    "axis": "linear",
    "sampling_period": {"value": 1, "unit": "ms"},
    "columns": {"position": {"name": "position", "unit": "m"}, "command": {"name": "command", "unit": "V"}},
    "drive": {"gain": {"value": 36, "unit": "N/V"}},
}


def axis():
    """Time, position and command of an axis of 90 kg with a friction of 22 N + 190 N s/m·v, driven with 36 N/V."""
    time = np.arange(0.0, 12.0, 1e-3)
    velocity = 0.2 * np.sin(2.0 * time) + 0.1 * np.sin(5.3 * time)
    position = -0.1 * np.cos(2.0 * time) - 0.1 / 5.3 * np.cos(5.3 * time)
    acceleration = 0.4 * np.cos(2.0 * time) + 0.53 * np.cos(5.3 * time)
    force = 90.0 * acceleration + 22.0 * np.sign(velocity) + 190.0 * velocity
    return {"time [s]": time, "position": position, "command": force / 36.0}


@pytest.fixture(scope="module")
def found():
    return stickslip.identify(axis(), machine=MACHINE)


class Series:
    """A column as pandas and polars have it."""

    def __init__(self, values):
        self._values = np.asarray(values)
        self.dtype, self.name = self._values.dtype, None

    def to_numpy(self):
        return self._values


class Frame:
    """A frame with the attributes of pandas and polars."""

    def __init__(self, columns, index=None, **attributes):
        self._columns, self.columns = columns, list(columns)
        if index is not None:
            self.index = index
        vars(self).update(attributes)

    def __getitem__(self, name):
        return Series(self._columns[name])


def test_arrays_give_the_friction_of_an_axis(found):
    assert abs(found.parameters["inertia.mass"] - 90.0) < 1.0
    for side in ("positive", "negative"):
        assert abs(found.parameters[f"friction.{side}.coulomb"] - 22.0) < 1.0
        assert abs(found.parameters[f"friction.{side}.viscous"] - 190.0) < 5.0
    low, high = found.intervals["inertia.mass"]
    assert low < found.parameters["inertia.mass"] < high
    assert found.units["force"] == "N" and list(found)[0] == "velocity"
    assert found.feedforward.units["command"] == "V" and len(found.feedforward["velocity"]) > 20
    assert stickslip.preset(text=found.model).model.own.kinetic_torque > 0.0


def test_a_result_plots_pickles_and_writes_the_files_of_the_command_line(found, tmp_path):
    again = pickle.loads(pickle.dumps(found))
    assert again.parameters == found.parameters and again.model == found.model
    for result in (found, again):
        assert result.plot().get_ylabel() == "force [N]"
    plt.close("all")
    again.write(tmp_path)
    assert {"model.toml", "feedforward.csv", "report.html", "summary.json"} <= {it.name for it in tmp_path.iterdir()}
    assert "inertia" in found.html() and str(found) == str(again)


def test_a_file_gives_the_bits_of_the_command_line(program, tmp_path):
    recording, machine = DATA / "emps.csv.gz", DATA / "emps-machine.toml"
    ours = stickslip.identify(recording, machine=machine)
    theirs = summary_of(program, "identify", str(recording), "--machine", str(machine), out=tmp_path)
    same(ours.summary, theirs)
    checked = stickslip.validate(recording, ours)
    model = tmp_path / "model.toml"
    arguments = ("validate", str(recording), "--model", str(model), "--machine", str(machine))
    same(checked.summary, summary_of(program, *arguments, out=tmp_path / "validate"))
    same(stickslip.validate(recording, model, machine=machine).summary, checked.summary)
    assert checked.plot().get_xlabel() == "time [s]"
    plt.close("all")


@pytest.mark.parametrize("kind", ["pandas", "polars", "structured", "signals", "lists"])
def test_every_kind_of_table_gives_the_same_bits(kind, found):
    columns = axis()
    table = {
        "pandas": lambda: Frame(columns, index=Series(range(12000))),
        "polars": lambda: Frame(columns),
        "structured": lambda: np.rec.fromarrays(list(columns.values()), names=list(columns)),
        "signals": lambda: stickslip.read_recording(columns),
        "lists": lambda: {name: values.tolist() for name, values in columns.items()},
    }[kind]()
    assert stickslip.identify(table, machine=MACHINE).parameters == found.parameters


def test_frames_of_pandas_and_polars_are_read():
    for module in ("pandas", "polars"):
        frames = pytest.importorskip(module)
        recording = stickslip.read_recording(frames.DataFrame(axis()))
        np.testing.assert_array_equal(recording["position"], axis()["position"])
        assert recording.units["time"] == "s"


def test_times_become_seconds_and_a_named_index_is_a_column():
    start = np.datetime64(datetime.datetime(2026, 1, 1), "ns")
    stamps = start + np.arange(4) * np.timedelta64(1000000, "ns")
    index = Series(stamps)
    recording = stickslip.read_recording(Frame({"angle": [0, 1, 2, 3]}, index=index, attrs={"units": {"angle": "deg"}}))
    assert list(recording) == ["time", "angle"] and recording.units == {"time": "s", "angle": "deg"}
    np.testing.assert_allclose(recording["time"], [0.0, 1e-3, 2e-3, 3e-3], atol=1e-12)
    spans = stickslip.read_recording({"t": np.array([0, 5, "NaT"], "timedelta64[ms]")})
    assert spans["t"][1] == 0.005 and np.isnan(spans["t"][2])


def test_brackets_are_units_only_behind_a_space():
    recording = stickslip.read_recording({"position[0]": [0.0, 1.0], "effort (N m)": [1.0, 2.0], "state": ["on", "off"]})
    assert recording.units == {"position[0]": "", "effort": "N m", "state": ""}
    assert np.isnan(recording["state"]).all()


def test_a_recording_shows_what_a_machine_makes_of_it():
    recording = stickslip.read_recording(axis(), machine=MACHINE)
    assert recording.units == {"time": "s", "position": "m", "command": "V"}
    again = pickle.loads(pickle.dumps(recording))
    assert again["position"].tobytes() == recording["position"].tobytes() and again.remarks == recording.remarks
    first = again.plot()
    assert len(first.figure.axes) == 2 and first.get_ylabel() == "[m]"
    plt.close("all")


def test_wrong_data_are_refused_with_a_remedy():
    for recording, exception, words in (
        ({"a": [0.0, 1.0], "b": [0.0]}, stickslip.InvalidValue, "b has 1 values, a 2"),
        ({"a": np.zeros((2, 2))}, stickslip.InvalidValue, "one-dimensional"),
        ({"a": np.zeros(2, complex)}, stickslip.InvalidValue, "complex"),
        ({}, stickslip.InvalidValue, "no rows"),
        ({"a": []}, stickslip.InvalidValue, "no rows"),
        (3.0, TypeError, "a data frame"),
        ("none.csv", stickslip.FileError, "none.csv"),
    ):
        with pytest.raises(exception, match=words):
            stickslip.read_recording(recording)
    with pytest.raises(stickslip.Error, match="missing field"):
        stickslip.identify(axis(), machine={"name": "axis"})
    with pytest.raises(stickslip.Error, match="column"):
        stickslip.identify({"angle": np.zeros(100)}, machine=MACHINE)
    with pytest.raises(stickslip.FileError):
        stickslip.identify(axis(), machine="none.toml")
    with pytest.raises(TypeError, match="machine="):
        stickslip.validate(axis(), "model.toml")


def test_an_identification_can_be_interrupted():
    def stop(stage, share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stickslip.identify(axis(), machine=MACHINE, progress=stop)


def test_a_calibration_has_the_bits_of_the_command_line(program, bench, tmp_path):
    plan = {"duration": 2}
    ours = stickslip.calibrate(bench, plan=plan, seed=3)
    arguments = ("calibrate", "--preset", "clm-bench", "--seed", "3", "--set", "plan.duration=2")
    same(ours.summary, summary_of(program, *arguments, out=tmp_path))
    calibrated = stickslip.preset(str(tmp_path / "calibrated.toml"))
    assert calibrated.model.to_dict() == ours.preset.model.to_dict()
    assert pickle.loads(pickle.dumps(ours)).plot().get_ylabel() == "torque [N m]"
    plt.close("all")


def test_runs_are_found_read_and_replayed(program, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert stickslip.runs() == []
    command = [program, "demo", "--seed", "3", "--quiet"]
    subprocess.run(command, check=True)
    (run,) = stickslip.runs("demo")
    assert run.number == 1 and run.state == "here" and pathlib.Path(run.folder).is_dir()
    assert stickslip.runs("something-else") == [] and pickle.loads(pickle.dumps(run)) == run
    with pytest.raises(stickslip.FileError, match="no record"):
        dataclasses.replace(run, record=None).read()
    recording = run.read()
    assert recording.units["time"] == "s" and recording.units["cycle"] == "1"
    replayed = run.replay()
    assert replayed.identical and replayed.cycles == replayed.recorded
    assert stickslip.replay(1) == replayed == stickslip.replay(run.folder)
