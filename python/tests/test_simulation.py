"""The closed loop, with the controller of the bench and with one written in Python."""

import math

import numpy as np
import pytest

import stickslip

SINE = {"reference": "sine", "amplitude": 1.0, "frequency": 2.0}


def test_signals_have_names_units_and_equal_length(bench):
    run = stickslip.simulate(bench, SINE, 0.5)
    assert run.stopped is None and {len(values) for values in run.values()} == {500}
    assert run["time"][1] == pytest.approx(1e-3)
    assert np.abs(run["reference_position"] - run["true_angle"]).max() < 0.2
    assert np.abs(run["true_angle"] - run["measured_angle"]).max() < 2 * math.tau / 10_000
    assert run.to_xarray().commanded_torque.attrs["units"] == "N m"
    assert len(run.plot().get_lines()) == 2


def test_the_same_seed_gives_the_same_bits_and_another_does_not(bench):
    runs = [stickslip.simulate(bench, SINE, 0.2, seed=seed)["true_angle"] for seed in (5, 5, 6)]
    assert np.array_equal(runs[0], runs[1]) and not np.array_equal(runs[0], runs[2])


@pytest.mark.parametrize("module, call, extra", [("xarray", "to_xarray", "xarray"), ("matplotlib.pyplot", "plot", "plot")])
def test_a_missing_package_is_named_with_the_command_to_install_it(bench, monkeypatch, module, call, extra):
    import sys

    run = stickslip.simulate(bench, "reversal")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(stickslip.Error, match=rf'{module}.*pip install "stickslip\[{extra}\]"'):
        getattr(run, call)()


def test_manoeuvres_and_samples_are_followed(bench):
    run = stickslip.simulate(bench, "reversal", 0.5)
    assert run["reference_position"][-1] == pytest.approx(20 * math.sin(math.tau * 0.1 * run["time"][-1]))
    positions = 0.5 * (1 - np.cos(np.linspace(0, math.pi, 400)))
    run = stickslip.simulate(bench, positions)
    assert len(run["time"]) == 400
    np.testing.assert_allclose(run["reference_position"], positions, atol=1e-12)


def test_rendering_changes_the_torque_of_the_drive(bench):
    heavy = bench.set({"bench.desired": {"kinetic_torque": 0.25, "breakaway_torque": 0.35}})
    ramp = {"reference": "ramp", "velocity": 10.0, "acceleration": 50.0, "hold_time": 1.0}
    plain = stickslip.simulate(heavy, ramp, 1.0)["commanded_torque"][-300:].mean()
    rendered = stickslip.simulate(heavy, ramp, 1.0, render=True)["commanded_torque"][-300:].mean()
    difference = heavy.friction("bench.desired").steady(10.0) - heavy.friction("model.own").steady(10.0)
    assert rendered - plain == pytest.approx(difference, rel=0.03)


def test_a_controller_written_in_python_closes_the_loop(bench):
    samples = []

    def proportional(reference, measured):
        samples.append((measured.time, reference.velocity))
        return 1.5 * (reference.position - measured.angle) + 0.05 * (reference.velocity - measured.velocity)

    run = stickslip.simulate(bench, SINE, 0.5, controller=proportional)
    assert run.stopped is None and len(samples) == 500
    assert [time for time, _ in samples[:3]] == pytest.approx([0.0, 1e-3, 2e-3])
    assert np.abs(run["reference_position"] - run["true_angle"]).max() < 0.5
    # A returned torque is active in the next sample, rounded to the volts of the amplifier.
    limit = bench.plant.servo.torque_per_volt * bench.plant.servo.input_limit
    assert np.abs(run["commanded_torque"]).max() <= limit + 1e-12


def test_a_torque_becomes_active_one_sample_later(bench):
    torques = iter(np.linspace(0.001, 0.1, 100))
    run = stickslip.simulate(bench, [0.0] * 100, controller=lambda *_: next(torques))
    assert run["commanded_torque"][0] == 0.0
    np.testing.assert_allclose(run["commanded_torque"][1:], np.linspace(0.001, 0.1, 100)[:-1], rtol=1e-12)


def test_an_exception_in_a_controller_is_raised_unchanged(bench):
    class ControllerError(Exception):
        pass

    calls = 0

    def fails(reference, measured):
        nonlocal calls
        calls += 1
        if calls == 20:
            raise ControllerError("at rest")
        return 0.0

    with pytest.raises(ControllerError, match="at rest"):
        stickslip.simulate(bench, [0.0] * 100, controller=fails)
    assert calls == 20
    with pytest.raises(TypeError, match="The controller returned a str, not a torque"):
        stickslip.simulate(bench, [0.0] * 10, controller=lambda *_: "much")


def test_nan_counts_as_zero_torque_and_a_lost_loop_states_the_reason(bench):
    resting = [stickslip.simulate(bench, [0.0] * 50, controller=lambda *_: it) for it in (math.nan, 0.0)]
    assert np.array_equal(resting[0]["true_angle"], resting[1]["true_angle"])
    lost = stickslip.simulate(bench, SINE | {"amplitude": 20.0}, 1.0, controller=lambda *_: math.nan)
    assert "bench.safety.following_error" in lost.stopped and len(lost["time"]) < 1000
    assert "Stopped: at" in repr(lost)


def test_progress_is_reported_with_either_controller(bench):
    for controller in (None, lambda reference, measured: 0.0):
        calls = []
        rest = {"reference": "constant"}
        stickslip.simulate(bench, rest, 1.0, controller=controller, progress=lambda *it: calls.append(it))
        assert calls and all(stage == "simulate" and 0.0 <= done <= 1.0 for stage, done in calls)
        assert [done for _, done in calls] == sorted(done for _, done in calls)


def test_ctrl_c_ends_a_controller_written_in_python(bench):
    import signal

    def interrupts(reference, measured):
        if measured.time > 0.05:
            signal.raise_signal(signal.SIGINT)
        return 0.0

    with pytest.raises(KeyboardInterrupt):
        stickslip.simulate(bench, [0.0] * 100_000, controller=interrupts)


def test_an_invalid_reference_is_refused(bench):
    with pytest.raises(stickslip.InvalidValue, match="duration of a simulation = inf"):
        stickslip.simulate(bench, SINE)
    with pytest.raises(stickslip.UnknownName, match="reversal"):
        stickslip.simulate(bench, "somersault")
    with pytest.raises(stickslip.UnknownName, match="amplitude"):
        stickslip.simulate(bench, {"reference": "sine", "amplitud": 1.0}, 1.0)
    with pytest.raises(TypeError, match="Invalid reference"):
        stickslip.simulate(bench, object(), 1.0)
