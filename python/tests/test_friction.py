"""Friction models over arrays."""

import numpy as np
import pytest

import stickslip

STRIBECK = {"breakaway_torque": 0.3, "kinetic_torque": 0.2, "stribeck_velocity": 2.0, "viscous_friction": 0.01}


def stribeck(velocity):
    """Equation (1) of the paper."""
    drop = 0.1 * np.exp(-np.abs(velocity) / 2.0)
    return np.sign(velocity) * (0.2 + drop) + 0.01 * velocity


@pytest.mark.parametrize("model", ["static", "lugre", "elasto-plastic", "maxwell-slip"])
def test_the_steady_curve_is_the_stribeck_curve(model):
    sliding = "model.lugre.sliding" if model == "elasto-plastic" else "model.sliding"
    friction = stickslip.Friction({"model.kind": model, sliding: STRIBECK})
    velocity = np.linspace(-20.0, 20.0, 401).reshape(1, -1)
    torque = friction.steady(velocity)
    assert torque.shape == velocity.shape and torque.dtype == np.float64
    # The exponential is a built-in kernel, accurate to a few units in the last place.
    np.testing.assert_allclose(torque, stribeck(velocity), rtol=1e-14, atol=1e-15)
    assert friction.steady(3.0) == pytest.approx(stribeck(3.0), rel=1e-14) and isinstance(friction.steady(3.0), float)
    assert friction.steady([1, 2]).tolist() == friction.steady(np.array([1.0, 2.0])).tolist()


def test_the_frictions_of_a_preset_are_found_by_their_paths(bench):
    curve = bench.friction("model.own")
    assert curve.steady(10.0) == pytest.approx(0.18 + 0.12 * np.exp(-10.0 / 3.0) + 2e-4 * 10.0)
    wheel = bench.friction("plant.wheel.friction")
    assert wheel.steady(50.0) == pytest.approx(0.14, rel=1e-5)
    with pytest.raises(stickslip.UnknownName, match="model.drive is not a friction"):
        bench.friction("model.drive")
    with pytest.raises(stickslip.UnknownName, match="unknown parameter"):
        bench.friction("model.nothing")


def test_bristles_deflect_break_away_and_slide(bench):
    wheel = bench.friction("plant.wheel.friction")
    stiffness = bench.plant.wheel.friction.model.lugre.bristle_stiffness
    dt, velocity = 1e-5, 0.01
    torque, deflection = wheel.course(np.full(2_000_000, velocity), dt)
    # At first the bristles only deflect.
    early = 1000
    assert deflection[early] == pytest.approx(velocity * dt * (early + 1), rel=1e-9)
    assert torque[early] - torque[early - 1] == pytest.approx(stiffness * velocity * dt, rel=0.01)
    assert torque[-1] == pytest.approx(wheel.steady(velocity), rel=1e-6)
    # A trajectory can continue where another one ended.
    first, middle = wheel.course(np.full(1_000_000, velocity), dt)
    second, _ = wheel.course(np.full(1_000_000, velocity), dt, deflection=middle[-1])
    assert np.array_equal(np.concatenate([first, second]), torque)


def test_friction_depends_on_angle_and_load():
    rippled = stickslip.Friction({
        "model": {"kind": "lugre", "sliding": STRIBECK},
        "position": {"shape": "ripple", "amplitude": 0.1},
        "load.sensitivity": 0.5,
    })
    plain = stickslip.Friction({"model": {"kind": "lugre", "sliding": STRIBECK}})
    assert rippled.steady(5.0, angle=np.pi / 2, load=2.0) == pytest.approx(1.1 * 2.0 * plain.steady(5.0))
    steps = 20_000
    angle, load = np.full(steps, np.pi / 2), np.full(steps, 2.0)
    torque, _ = rippled.course(np.full(steps, 5.0), 1e-4, angle=angle, load=load)
    assert torque[-1] == pytest.approx(rippled.steady(5.0, angle=np.pi / 2, load=2.0))


def test_static_friction_at_rest_takes_up_the_arresting_torque():
    static = stickslip.Friction({"model": {"kind": "static", "sliding": STRIBECK}})
    torque, _ = static.course(np.zeros(3), 1e-4, arrest=[0.1, -0.2, 5.0])
    assert torque.tolist() == [0.1, -0.2, 0.3]
    assert static.course(np.zeros(1), 1e-4)[0].tolist() == [0.0]


def test_invalid_arguments_are_refused():
    friction = stickslip.Friction({"model.kind": "lugre"})
    with pytest.raises(stickslip.InvalidValue, match="dt = 0 s is not a positive"):
        friction.course([1.0], 0.0)
    with pytest.raises(stickslip.InvalidValue, match="load has 1 values, velocity 2"):
        friction.course([1.0, 2.0], 1e-3, load=[0.0])
    with pytest.raises(stickslip.InvalidValue, match=r"model.bristle_stiffness = -1 N m/rad is outside"):
        stickslip.Friction({"model.kind": "lugre", "model.bristle_stiffness": -1})
    with pytest.raises(ValueError, match="velocity"):
        friction.steady("fast")
