"""Parameters: reading, description, changes, comparison, pickles."""

import copy
import pickle

import numpy as np
import pytest

import stickslip


def test_values_are_read_by_path_and_by_attribute(bench):
    assert bench["model.own.breakaway_torque"] == bench.model.own.breakaway_torque == 0.3
    assert bench.model["own.breakaway_torque"] == bench["model"]["own"]["breakaway_torque"] == 0.3
    assert bench.bench.observer_poles == [250.0, 250.0, 250.0]
    assert bench["bench.observer_poles.1"] == 250.0
    assert bench.bench.controller.kind == "cascade"
    assert isinstance(bench.bench.control_divider, int) and isinstance(bench.bench.tick_rate, float)


def test_a_preset_is_a_mapping_of_paths(bench):
    values = bench.to_dict()
    assert len(values) == len(bench) == len(list(bench)) == len(bench.keys())
    assert all(path in bench and bench[path] == value for path, value in values.items())
    assert "model.own" in bench and "model.owm" not in bench
    assert bench.model.own.to_dict() == {
        path.removeprefix("model.own."): value for path, value in values.items() if path.startswith("model.own.")
    }
    assert "own" in dir(bench.model) and "describe" in dir(bench.model) and "plant" in dir(bench)


def test_an_unknown_name_gets_the_nearest_known_one(bench):
    with pytest.raises(stickslip.UnknownName, match=r"^unknown parameter model.own.breakawy. Did you mean model.own."):
        bench["model.own.breakawy"]
    with pytest.raises(AttributeError, match="Did you mean"):
        bench.model.own.breakaway_torqe
    with pytest.raises(KeyError):
        bench.model["x"]
    assert not hasattr(bench, "modle")
    with pytest.raises(stickslip.UnknownName, match="Did you mean prototype"):
        stickslip.preset("prototyp")
    with pytest.raises(stickslip.UnknownName, match=r"exists only with bench.law.kind = \"residual\""):
        bench.bench.law.missing_torque


def test_a_missing_file_raises_a_file_error(tmp_path):
    with pytest.raises(stickslip.FileError, match="absent.toml: cannot read it"):
        stickslip.preset(str(tmp_path / "absent.toml"))
    with pytest.raises(OSError):
        stickslip.preset(str(tmp_path / "absent.toml"))


def test_a_preset_from_a_file_or_text_preserves_comments(tmp_path):
    text = "# mine\n[model.own] # measured\nkinetic_torque = 0.2\n"
    file = tmp_path / "mine.toml"
    file.write_text(text)
    read = stickslip.preset(str(file))
    assert read == stickslip.preset(text=text) and read.model.own.kinetic_torque == 0.2
    assert read.set({"model.own.kinetic_torque": 0.25}).toml() == text.replace("0.2\n", "0.25\n")
    with pytest.raises(stickslip.InvalidValue):
        stickslip.preset()
    with pytest.raises(stickslip.InvalidValue, match="text:2"):
        stickslip.preset(text="[model.own]\nkinetic_torque = -1")


def test_set_changes_a_copy(bench):
    changed = bench.set({"model.own": {"breakaway_torque": 0.4, "kinetic_torque": np.float64(0.2)}})
    assert (changed.model.own.breakaway_torque, changed.model.own.kinetic_torque) == (0.4, 0.2)
    assert bench.model.own.breakaway_torque == 0.3
    assert bench.diff(changed) == [
        ("model.own.breakaway_torque", 0.3, 0.4),
        ("model.own.kinetic_torque", 0.18, 0.2),
    ]
    poles = bench.set({"bench.observer_poles": (100.0, 200.0, 300.0), "bench.control_divider": 2})
    assert poles.bench.observer_poles == [100.0, 200.0, 300.0] and poles.bench.control_divider == 2
    chosen = bench.set({"bench.controller": {"kind": "state-feedback", "compensates_load": True}})
    assert chosen.bench.controller.compensates_load is True
    assert bench.diff(bench) == []


def test_a_group_is_copied_as_a_whole(bench):
    other = stickslip.preset("prototype")
    changed = bench.set({"bench.desired": other.model.own, "plant.screw_friction": other.plant.screw_friction})
    assert changed.bench.desired == other.model.own
    assert changed.plant.screw_friction == other.plant.screw_friction
    assert changed.plant.screw_friction != bench.plant.screw_friction


def test_all_errors_are_reported_together_with_the_messages_of_the_command_line(bench):
    with pytest.raises(stickslip.InvalidValue) as caught:
        bench.set({"bench.tick_rate": -1, "model.own.breakaway_torque": float("nan")})
    assert "bench.tick_rate = -1 Hz is outside 500 … 20000 Hz (presets/clm-bench.toml:" in str(caught.value)
    assert "model.own.breakaway_torque = NaN is not finite" in str(caught.value)
    with pytest.raises(ValueError, match="Choose one of"):
        bench.set({"bench.controller.kind": "fuzzy"})
    with pytest.raises(stickslip.UnknownName):
        bench.set({"bench.tick": 1})
    with pytest.raises(TypeError, match="bench.tick_rate is a object"):
        bench.set({"bench.tick_rate": object()})


def test_descriptions_come_from_the_parameter_tables(bench):
    torque = bench.describe("model.own.breakaway_torque")
    assert (torque.symbol, torque.unit, torque.kind) == ("M_S", "N m", "real")
    assert torque.minimum < torque.default < torque.maximum
    assert torque.help.startswith("Torque at which the drive breaks away")
    kind = bench.describe("bench.controller.kind")
    assert kind.kind == "choice" and "cascade" in kind.variants and kind.unit == "" and kind.default is None
    assert bench.bench.describe("controller.position_gain").only_with == 'bench.controller.kind = "cascade"'
    assert all(it.path.startswith("model.own.") for it in bench.descriptions("model.own"))
    assert len(bench.descriptions()) > len(bench)
    with pytest.raises(stickslip.UnknownName, match="is a group"):
        bench.describe("model.own")


def test_copies_and_pickles_preserve_every_bit(bench):
    changed = bench.set({"model.own.kinetic_torque": 0.1 + 0.2 - 0.15})
    for restored in (pickle.loads(pickle.dumps(changed)), copy.copy(changed), copy.deepcopy(changed)):
        assert restored == changed and hash(restored) == hash(changed) and restored.toml() == changed.toml()
    assert changed != bench
    assert stickslip.preset(text=changed.toml(complete=True)) == changed
    assert pickle.loads(pickle.dumps(changed.model.own)) == changed.model.own
    friction = bench.friction("plant.screw_friction")
    assert pickle.loads(pickle.dumps(friction)) == friction


def test_values_show_their_units(bench):
    assert "breakaway_torque = 0.3 N m" in repr(bench.model.own)
    assert "bench.tick_rate = 4000 Hz" in str(bench)
    assert repr(bench).startswith("Preset of presets/clm-bench.toml: ")


def test_the_built_in_presets_are_listed():
    assert {"clm-bench", "prototype", "emps"} <= set(stickslip.presets())
    for name in stickslip.presets():
        assert len(stickslip.preset(name)) > 100
