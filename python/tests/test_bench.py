"""The experiment (measure, fit, design, render) and predictions for controllers."""

import json
import math
import subprocess

import matplotlib.pyplot as plt
import numpy as np
import pytest

import stickslip


def summary_of(program, *arguments, out):
    """Run a command of the program and return its `summary.json`."""
    subprocess.run([program, *arguments, "--out", str(out), "--quiet"], check=True)
    return stickslip.Summary((out / "summary.json").read_text())


def same(one, other, but=()):
    """Assert that two summaries have the same names, units and bits."""
    assert one.keys() == other.keys() and one.units == other.units
    for name in one:
        if name not in but:
            assert one[name] == other[name] or (math.isnan(one[name]) and math.isnan(other[name])), name
    for name, interval in one.intervals.items():
        assert interval == other.intervals[name]
    assert one.records == other.records


def test_a_measurement_has_the_bits_of_the_command_line(program, bench, tmp_path):
    ours = stickslip.measure(bench, plan={"speeds": 6}, seed=7)
    theirs = summary_of(program, "measure", "friction", "--seed", "7", "--set", "plan.speeds=6", out=tmp_path)
    same(ours.summary, theirs)
    fitted = summary_of(program, "fit", str(tmp_path), out=tmp_path / "fit")
    same(stickslip.fit(ours).summary, fitted)


def test_the_demonstration_has_the_bits_of_the_command_line(program, bench, tmp_path):
    ours = stickslip.demo(bench, seed=3).write(tmp_path / "ours")
    theirs = summary_of(program, "demo", "--seed", "3", out=tmp_path / "theirs")
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
    result = stickslip.measure(bench, what, plan=shorter[what])
    assert result.summary["measure.complete"] == 1.0
    assert len(result) >= 2 and all(np.isfinite(values).any() for values in result.values())
    assert result.summary.units["measure.duration"] == "s"


def test_a_fit_recovers_the_parameters_of_the_bench(bench, curve):
    fitted = stickslip.fit(curve)
    for name, true in bench.model.own.to_dict().items():
        if name in fitted.parameters:
            low, high = fitted.intervals[name]
            assert low <= fitted.parameters[name] <= high
            # The true friction is a sum of two frictions, which is not exactly a Stribeck curve.
            assert fitted.parameters[name] == pytest.approx(true, rel=0.15), name
    assert np.sqrt(np.diag(fitted.covariance)) == pytest.approx(list(fitted.standard_errors.values()))
    predicted = fitted.predict(curve["velocity"])
    low, high = fitted.band(curve["velocity"])
    assert np.all(low < predicted) and np.all(predicted < high)
    sign = np.sign(curve["velocity"])
    assert fitted.residuals == pytest.approx(sign * (curve["torque"] - predicted), abs=1e-15)
    updated = fitted.on(bench)
    assert updated.model.own.breakaway_torque == fitted.parameters["breakaway_torque"]
    assert updated.plant.wheel.preload == curve.preload == 1.0


def test_the_fit_of_arrays_is_equivariant():
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
    with pytest.raises(stickslip.InvalidValue, match="No parameters for a preset: .* several fits"):
        stickslip.fit(velocity, torque, side="positive").on(stickslip.preset("clm-bench"))


def test_a_curve_from_a_csv_file_is_fitted(tmp_path):
    file = tmp_path / "mine.csv"
    speeds = np.geomspace(1.0, 500.0, 12)
    rows = [f"{rpm};{0.2 + 0.1 * math.exp(-rpm * math.tau / 120) + 1e-4 * rpm:.9f}" for rpm in speeds]
    file.write_text("\n".join(["n [rpm];M [N m]", *rows]).replace(".", ","))
    (curve,) = stickslip.read_curves(file, velocity="n", torque="M").values()
    assert curve["velocity"] == pytest.approx(speeds * math.tau / 60)
    fitted = stickslip.fit(curve, side="positive")
    assert fitted.parameters["kinetic_torque"] == pytest.approx(0.2, rel=1e-3)
    file.write_text("v [m/s],F [N]\n0.1,5\n")
    assert stickslip.read_curves(file)[""].units == {"velocity": "m/s", "torque": "N"}
    with pytest.raises(stickslip.Error):
        stickslip.read_curves(file, torque="M")


def test_invalid_points_are_refused():
    with pytest.raises(stickslip.InvalidValue, match="point 2 of the friction curve: velocity = 0"):
        stickslip.fit([1, 0, 2, 3, 4, 5], [1, 1, 1, 1, 1, 1])
    with pytest.raises(stickslip.InvalidValue, match="at least 5 required"):
        stickslip.fit([1, 2], [1, 1])
    with pytest.raises(stickslip.InvalidValue, match="torque has 1 values, velocity 2"):
        stickslip.fit([1, 2], [1])
    with pytest.raises(stickslip.InvalidValue, match="Choose one of: both"):
        stickslip.fit([1, 2], [1, 1], side="left")
    with pytest.raises(TypeError):
        stickslip.fit([1, 2])


def test_a_rendered_design_is_measured_with_small_error(bench, curve):
    design = stickslip.design(stickslip.fit(curve).on(bench), [(0.5, 0.26), (2.0, 0.17), (30.0, 0.16)])
    assert design.renderable and design.summary["design.distance_from_points"] < 0.02
    rendered = stickslip.render(design.preset)
    desired = design.preset.friction("bench.desired").steady(rendered["velocity"])
    outside = np.abs(rendered["velocity"]) > bench.bench.fade_velocity
    error = np.sqrt(np.mean((rendered["torque"] - desired)[outside] ** 2))
    assert error < 0.01 * design.preset.bench.desired.breakaway_torque
    assert "svg" in rendered.html()


def test_a_design_beyond_the_load_motor_is_refused_with_reasons(bench):
    design = stickslip.design(bench.set({"bench.desired.breakaway_torque": 9.0, "bench.desired.kinetic_torque": 8.0}))
    assert not design.renderable and design.remarks
    with pytest.raises(stickslip.Error):
        stickslip.render(design.preset)


def test_loop_and_hunting_equal_those_of_the_command_line(program, bench, tmp_path):
    same(stickslip.loop(bench).summary, summary_of(program, "loop", out=tmp_path / "loop"))
    hunting = stickslip.hunting(bench, duration=10.0)
    same(hunting.summary, summary_of(program, "hunting", "--duration", "10", out=tmp_path / "hunting"))
    assert hunting.hunts is (hunting.amplitude > 0.0) is math.isfinite(hunting.interval)


def test_a_benchmark_returns_records_and_continues_from_its_folder(tmp_path):
    prototype = stickslip.preset("prototype")
    options = {"frictions": ["nominal"], "manoeuvres": ["reversal"], "seeds": 2, "quick": True, "folder": tmp_path}
    result = stickslip.benchmark(prototype, ["cascade", "cascade+feedforward"], **options)
    ranks = [it for it in result.summary.records if it["kind"] == "rank"]
    assert {it["controller"] for it in ranks} == {"cascade", "cascade+feedforward"}
    stages = []
    repeated = stickslip.benchmark(
        prototype, ["cascade", "cascade+feedforward"], progress=lambda *it: stages.append(it), **options
    )
    assert repeated.summary.records == result.summary.records
    with pytest.raises(stickslip.UnknownName, match="reversal"):
        stickslip.benchmark(prototype, ["cascade"], manoeuvres=["loop-the-loop"])


def test_fidelity_equals_that_of_the_command_line(program, tmp_path):
    ours = stickslip.fidelity(
        ["prototype"], laws=["paper"], rates=[4000], wheel=True, mismatches=["perfect"], scenarios=["sine_2hz"], seeds=2
    )
    options = "--preset prototype --law paper --rate 4000 --wheel pressed --mismatch perfect --scenario sine_2hz --seeds 2"
    same(ours.summary, summary_of(program, "fidelity", *options.split(), out=tmp_path))
    assert "paper" in repr(ours) and "svg" in ours.html()
    with pytest.raises(stickslip.UnknownName, match="sine_2hz"):
        stickslip.fidelity(scenarios=["sine_3hz"])


def test_results_are_written_as_the_command_line_writes_them(curve, tmp_path):
    written = curve.write(tmp_path)
    assert {it.name for it in tmp_path.iterdir()} == {"curve.csv", "curve.parquet", "curve.svg", "report.html", "report.json", "summary.json"}
    assert json.loads((tmp_path / "summary.json").read_text())["command"] == "measure friction"
    assert dict(written) == dict(curve.summary)
    with pytest.raises(stickslip.FileError):
        curve.write(tmp_path / "summary.json")


def test_results_convert_to_xarray_and_plot_with_matplotlib(curve):
    table = curve.to_xarray()
    assert table.torque.attrs["units"] == "N m" and table.torque.dims == ("velocity",)
    ax = curve.plot()
    assert ax.get_ylabel() == "torque [N m]" and ax.get_xlabel() == "velocity [rad/s]"
    ax = stickslip.fit(curve).plot(ax=ax)
    assert "fitted, with its 95 % band" in ax.get_legend_handles_labels()[1]
    assert curve.plot("standard_error").get_ylabel() == "[N m]"
    plt.close("all")


def test_an_exception_in_the_progress_callback_ends_the_work(bench):
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

    start = time.monotonic()
    timer = threading.Timer(0.3, signal.raise_signal, (signal.SIGINT,))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        stickslip.benchmark(stickslip.preset("prototype"))
    timer.join()
    # The whole benchmark takes many minutes.
    assert time.monotonic() - start < 60.0


def test_an_unknown_measurement_is_refused_with_the_known_ones(bench):
    with pytest.raises(stickslip.UnknownName, match="Choose one of: friction, breakaway"):
        stickslip.measure(bench, "temperature")
    with pytest.raises(stickslip.InvalidValue, match=r"speeds = -3 .*plan:"):
        stickslip.measure(bench, plan={"speeds": -3})
