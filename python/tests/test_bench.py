"""The experiment: measure, fit, design, render; and what is predicted of controllers."""

import json
import math
import subprocess

import matplotlib.pyplot as plt
import numpy as np
import pytest

import stickslip


def told_by(program, *arguments, out):
    """What a command of the program writes into `summary.json`."""
    subprocess.run([program, *arguments, "--out", str(out), "--quiet"], check=True)
    return stickslip.Summary((out / "summary.json").read_text())


def same(one, other, but=()):
    """Whether two summaries have the same names, units, and bits."""
    assert one.keys() == other.keys() and one.units == other.units
    for name in one:
        if name not in but:
            assert one[name] == other[name] or (math.isnan(one[name]) and math.isnan(other[name])), name
    for name, interval in one.intervals.items():
        assert interval == other.intervals[name]
    assert one.records == other.records


def test_a_measurement_has_the_bits_of_the_command_line(program, bench, tmp_path):
    ours = stickslip.measure(bench, plan={"speeds": 6}, seed=7)
    theirs = told_by(program, "measure", "friction", "--seed", "7", "--set", "plan.speeds=6", out=tmp_path)
    same(ours.summary, theirs)
    found = told_by(program, "fit", str(tmp_path), out=tmp_path / "fit")
    same(stickslip.fit(ours).summary, found)


def test_the_demonstration_has_the_bits_of_the_command_line(program, bench, tmp_path):
    ours = stickslip.demo(bench, seed=3).write(tmp_path / "ours")
    theirs = told_by(program, "demo", "--seed", "3", out=tmp_path / "theirs")
    same(ours, theirs, but={"speed.wall_time", "speed.real_time_factor"})


@pytest.mark.parametrize("what", ["breakaway", "presliding", "response", "learning", "tracking"])
def test_each_measurement_gives_numbers_and_data(bench, what):
    shorter = {
        "breakaway": {"angles": 1, "repetitions": 2},
        "presliding": {"quick_cycles": 4},
        "response": {},
        "learning": {"frequency": 2, "repetitions": 2},
        "tracking": {"speed": 20, "stroke": 2, "lowest_frequency": 1, "frequencies": 2, "speeds": 2},
    }
    found = stickslip.measure(bench, what, plan=shorter[what])
    assert found.summary["measure.complete"] == 1.0
    assert len(found) >= 2 and all(np.isfinite(values).any() for values in found.values())
    assert found.summary.units["measure.duration"] == "s"


def test_a_curve_is_fitted_and_found_again(bench, curve):
    found = stickslip.fit(curve)
    for name, true in bench.model.own.to_dict().items():
        if name in found.parameters:
            low, high = found.intervals[name]
            assert low <= found.parameters[name] <= high
            # The truth is a sum of two frictions, which no Stribeck curve is exactly.
            assert found.parameters[name] == pytest.approx(true, rel=0.15), name
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx(list(found.standard_errors.values()))
    predicted = found.predict(curve["velocity"])
    low, high = found.band(curve["velocity"])
    assert np.all(low < predicted) and np.all(predicted < high)
    sign = np.sign(curve["velocity"])
    assert found.residuals == pytest.approx(sign * (curve["torque"] - predicted), abs=1e-15)
    believed = found.on(bench)
    assert believed.model.own.breakaway_torque == found.parameters["breakaway_torque"]
    assert believed.plant.wheel.preload == curve.preload == 1.0


def test_points_of_ones_own_are_fitted_and_equivariant():
    velocity = np.concatenate([-np.geomspace(0.1, 50, 15), np.geomspace(0.1, 50, 15)])
    rng = np.random.default_rng(1)
    torque = np.sign(velocity) * (0.2 + 0.1 * np.exp(-np.abs(velocity) / 2)) + 0.004 * velocity
    torque += rng.normal(0, 1e-3, velocity.size)
    one = stickslip.fit(velocity, torque)
    more = stickslip.fit(velocity, 1.3 * torque)
    for name in ("breakaway_torque", "kinetic_torque", "viscous_friction"):
        assert more.parameters[name] == pytest.approx(1.3 * one.parameters[name], rel=1e-6)
    assert more.parameters["stribeck_velocity"] == pytest.approx(one.parameters["stribeck_velocity"], rel=1e-6)
    weighted = stickslip.fit(velocity, torque, np.full(velocity.size, 1e-3))
    assert weighted.parameters["kinetic_torque"] == pytest.approx(0.2, abs=2e-3)
    assert one.units["torque"] == "N m" and stickslip.fit(velocity, torque, linear=True).units["torque"] == "N"
    with pytest.raises(stickslip.InvalidValue, match="no parameters for a preset: .* several fits"):
        stickslip.fit(velocity, torque, side="positive").on(stickslip.preset("clm-bench"))


def test_a_file_of_ones_own_is_read_and_fitted(tmp_path):
    file = tmp_path / "mine.csv"
    speeds = np.geomspace(1.0, 500.0, 12)
    rows = [f"{rpm};{0.2 + 0.1 * math.exp(-rpm * math.tau / 120) + 1e-4 * rpm:.9f}" for rpm in speeds]
    file.write_text("\n".join(["n [rpm];M [N m]", *rows]).replace(".", ","))
    (curve,) = stickslip.read_curves(file, velocity="n", torque="M").values()
    assert curve["velocity"] == pytest.approx(speeds * math.tau / 60)
    found = stickslip.fit(curve, side="positive")
    assert found.parameters["kinetic_torque"] == pytest.approx(0.2, rel=1e-3)
    file.write_text("v [m/s],F [N]\n0.1,5\n")
    assert stickslip.read_curves(file)[""].units == {"velocity": "m/s", "torque": "N"}
    with pytest.raises(stickslip.Error):
        stickslip.read_curves(file, torque="M")


def test_points_that_are_none_are_refused():
    with pytest.raises(stickslip.InvalidValue, match="point 1 of the friction curve: velocity = 0"):
        stickslip.fit([1, 0, 2, 3, 4, 5], [1, 1, 1, 1, 1, 1])
    with pytest.raises(stickslip.InvalidValue, match="at least 5 required"):
        stickslip.fit([1, 2], [1, 1])
    with pytest.raises(stickslip.InvalidValue, match="torque has 1 values, velocity 2"):
        stickslip.fit([1, 2], [1])
    with pytest.raises(stickslip.InvalidValue, match="Choose one of: both"):
        stickslip.fit([1, 2], [1, 1], side="left")
    with pytest.raises(TypeError):
        stickslip.fit([1, 2])


def test_a_design_is_rendered_and_found_again(bench, curve):
    wanted = stickslip.design(stickslip.fit(curve).on(bench), [(0.5, 0.26), (2.0, 0.17), (30.0, 0.16)])
    assert wanted.renderable and wanted.summary["design.distance_from_points"] < 0.02
    rendered = stickslip.render(wanted.preset)
    desired = wanted.preset.friction("bench.desired").steady(rendered["velocity"])
    outside = np.abs(rendered["velocity"]) > bench.bench.fade_velocity
    error = np.sqrt(np.mean((rendered["torque"] - desired)[outside] ** 2))
    assert error < 0.01 * wanted.preset.bench.desired.breakaway_torque
    assert "svg" in rendered.html()


def test_a_design_beyond_the_load_motor_is_refused_with_reasons(bench):
    wanted = stickslip.design(bench.set({"bench.desired.breakaway_torque": 9.0, "bench.desired.kinetic_torque": 8.0}))
    assert not wanted.renderable and wanted.remarks
    with pytest.raises(stickslip.Error):
        stickslip.render(wanted.preset)


def test_loop_and_hunting_are_those_of_the_command_line(program, bench, tmp_path):
    same(stickslip.loop(bench).summary, told_by(program, "loop", out=tmp_path / "loop"))
    hunting = stickslip.hunting(bench, duration=10.0)
    same(hunting.summary, told_by(program, "hunting", "--duration", "10", out=tmp_path / "hunting"))
    assert hunting.hunts is (hunting.amplitude > 0.0) is math.isfinite(hunting.interval)


def test_a_benchmark_gives_records_and_goes_on_from_its_folder(tmp_path):
    prototype = stickslip.preset("prototype")
    kept = {"frictions": ["nominal"], "manoeuvres": ["reversal"], "seeds": 2, "quick": True, "folder": tmp_path}
    result = stickslip.benchmark(prototype, ["cascade", "cascade+feedforward"], **kept)
    ranks = [it for it in result.summary.records if it["kind"] == "rank"]
    assert {it["controller"] for it in ranks} == {"cascade", "cascade+feedforward"}
    stages = []
    again = stickslip.benchmark(
        prototype, ["cascade", "cascade+feedforward"], progress=lambda *it: stages.append(it), **kept
    )
    assert again.summary.records == result.summary.records
    with pytest.raises(stickslip.UnknownName, match="reversal"):
        stickslip.benchmark(prototype, ["cascade"], manoeuvres=["loop-the-loop"])


def test_fidelity_is_that_of_the_command_line(program, tmp_path):
    ours = stickslip.fidelity(
        ["prototype"], laws=["paper"], rates=[4000], wheel=True, mismatches=["perfect"], scenarios=["sine_2hz"], seeds=2
    )
    chosen = "--preset prototype --law paper --rate 4000 --wheel pressed --mismatch perfect --scenario sine_2hz --seeds 2"
    same(ours.summary, told_by(program, "fidelity", *chosen.split(), out=tmp_path))
    assert "paper" in repr(ours) and "svg" in ours.html()
    with pytest.raises(stickslip.UnknownName, match="sine_2hz"):
        stickslip.fidelity(scenarios=["sine_3hz"])


def test_results_are_written_as_the_command_line_writes_them(curve, tmp_path):
    written = curve.write(tmp_path)
    assert {it.name for it in tmp_path.iterdir()} == {"curve.csv", "curve.parquet", "report.html", "report.json", "summary.json"}
    assert json.loads((tmp_path / "summary.json").read_text())["command"] == "measure friction"
    assert dict(written) == dict(curve.summary)
    with pytest.raises(stickslip.FileError):
        curve.write(tmp_path / "summary.json")


def test_results_go_to_xarray_and_matplotlib(curve):
    table = curve.to_xarray()
    assert table.torque.attrs["units"] == "N m" and table.torque.dims == ("velocity",)
    ax = curve.plot()
    assert ax.get_ylabel() == "torque [N m]" and ax.get_xlabel() == "velocity [rad/s]"
    ax = stickslip.fit(curve).plot(ax=ax)
    assert "fitted, with its 95 % band" in ax.get_legend_handles_labels()[1]
    assert curve.plot("standard_error").get_ylabel() == "[N m]"
    plt.close("all")


def test_an_exception_in_progress_ends_the_work(bench):
    class Enough(Exception):
        pass

    def progress(stage, fraction):
        assert isinstance(stage, str) and 0.0 <= fraction <= 1.0
        raise Enough(stage)

    with pytest.raises(Enough):
        stickslip.measure(bench, thorough=True, progress=progress)


def test_ctrl_c_ends_long_work(bench):
    import signal
    import threading
    import time

    begin = time.monotonic()
    timer = threading.Timer(0.3, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        stickslip.benchmark(stickslip.preset("prototype"))
    timer.join()
    # The whole benchmark takes many minutes.
    assert time.monotonic() - begin < 60.0


def test_a_kind_of_measurement_that_there_is_not_is_told(bench):
    with pytest.raises(stickslip.UnknownName, match="There are: friction, breakaway"):
        stickslip.measure(bench, "temperature")
    with pytest.raises(stickslip.InvalidValue, match=r"speeds = -3 .*plan:"):
        stickslip.measure(bench, plan={"speeds": -3})
