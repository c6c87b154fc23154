"""Friction that was identified on real machines, by name."""

import numpy as np
import pytest

import stickslip


@pytest.mark.parametrize("name", stickslip.friction_library())
def test_each_friction_says_where_it_comes_from_and_goes_onto_a_bench(name):
    found = stickslip.identified_friction(name)
    assert found.title == stickslip.friction_library()[name] and found.source and found.licence and found.remarks
    torque, deviation = found.torque([-1.0, 1.0])
    assert torque.tolist() == found.friction.steady(np.array([-1.0, 1.0])).tolist()
    assert np.all(deviation >= 0.0) and (found.standard_deviations or not deviation.any())
    assert found.speeds is None or 0.0 <= found.speeds[0] <= found.speeds[1]
    assert found.title in repr(found)
    twice = found.scaled(2.0)
    assert twice.torque([1.0])[0] == pytest.approx(2.0 * torque[1:])
    assert twice.inertia == pytest.approx(2.0 * found.inertia) if found.inertia else twice.inertia is None


def test_a_friction_is_what_is_rendered_or_what_the_machine_has():
    bench = stickslip.preset("prototype")
    servo = stickslip.identified_friction("dc-servo")
    desired, own = servo.on(bench), servo.on(bench, "own")
    assert desired.friction("bench.desired").steady(1.0) == pytest.approx(servo.friction.steady(1.0))
    assert desired.plant.screw_friction == bench.plant.screw_friction
    assert own.friction("plant.screw_friction").steady(1.0) == servo.friction.steady(1.0)
    assert own.plant.wheel.preload == 0.0


def test_what_there_is_not_is_told():
    servo = stickslip.identified_friction("dc-servo")
    with pytest.raises(stickslip.UnknownName, match="dc-servo"):
        stickslip.identified_friction("dc-serve")
    with pytest.raises(stickslip.UnknownName, match="There are: desired, own"):
        servo.on(stickslip.preset("prototype"), "wanted")
    with pytest.raises(stickslip.InvalidValue, match="factor = -1"):
        servo.scaled(-1.0)
