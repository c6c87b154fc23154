"""Library of frictions identified on physical machines."""

import numpy as np
import pytest

import stickslip


@pytest.mark.parametrize("name", stickslip.friction_library())
def test_each_friction_states_its_source_and_scales(name):
    identified = stickslip.identified_friction(name)
    assert identified.title == stickslip.friction_library()[name] and identified.source and identified.licence and identified.remarks
    torque, deviation = identified.torque([-1.0, 1.0])
    assert torque.tolist() == identified.friction.steady(np.array([-1.0, 1.0])).tolist()
    assert np.all(deviation >= 0.0) and (identified.standard_deviations or not deviation.any())
    assert identified.speeds is None or 0.0 <= identified.speeds[0] <= identified.speeds[1]
    assert identified.title in repr(identified)
    twice = identified.scaled(2.0)
    assert twice.torque([1.0])[0] == pytest.approx(2.0 * torque[1:])
    assert twice.inertia == pytest.approx(2.0 * identified.inertia) if identified.inertia else twice.inertia is None


def test_a_friction_becomes_the_desired_or_the_own_friction():
    bench = stickslip.preset("prototype")
    servo = stickslip.identified_friction("dc-servo")
    desired, own = servo.on(bench), servo.on(bench, "own")
    assert desired.friction("bench.desired").steady(1.0) == pytest.approx(servo.friction.steady(1.0))
    assert desired.plant.screw_friction == bench.plant.screw_friction
    assert own.friction("plant.screw_friction").steady(1.0) == servo.friction.steady(1.0)
    assert own.plant.wheel.preload == 0.0


def test_unknown_names_and_invalid_factors_are_refused():
    servo = stickslip.identified_friction("dc-servo")
    with pytest.raises(stickslip.UnknownName, match="dc-servo"):
        stickslip.identified_friction("dc-serve")
    with pytest.raises(stickslip.UnknownName, match="Choose one of: desired, own"):
        servo.on(stickslip.preset("prototype"), "wanted")
    with pytest.raises(stickslip.InvalidValue, match="factor = -1"):
        servo.scaled(-1.0)
