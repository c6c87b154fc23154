"""FMUs in an importer (FMPy): validation, simulation, saved states, misuse."""

import ctypes
import json
import pathlib
import resource
import shutil
import subprocess

import numpy as np
import pytest

fmpy = pytest.importorskip("fmpy")
from fmpy.validation import validate_fmu  # noqa: E402
from importer import Importer  # noqa: E402

if shutil.which("cc") is None:
    pytest.skip("there is no C compiler", allow_module_level=True)

STEP = 25e-6
VERSIONS = pytest.mark.parametrize("version", [2, 3])


@pytest.fixture(scope="module")
def fmus(program, tmp_path_factory):
    """Folder with the FMUs and C projects of some blocks."""
    folder = tmp_path_factory.mktemp("fmu")
    for block in ("friction", "bench", "position_controller"):
        subprocess.run([program, "generate", "fmu", block, "--out", folder, "--quiet"], check=True)
        subprocess.run([program, "generate", "c", block, "--out", folder / block, "--quiet"], check=True)
    return folder


@pytest.fixture(scope="module")
def importers(fmus):
    return {(block, version): Importer(fmus / f"{block}-fmi{version}.fmu") for block in ("friction", "bench", "position_controller") for version in (2, 3)}


def run(instance, steps, amplitude=1.0):
    """Return the torques of a contact whose velocity oscillates."""
    torques = []
    for k in range(steps):
        instance.set({"input.velocity": amplitude * np.sin(2e-3 * k)})
        instance.step(k * STEP, STEP)
        torques.append(instance.get(["output.torque"])[0])
    return np.array(torques)


@VERSIONS
@pytest.mark.parametrize("block", ["friction", "bench", "position_controller"])
def test_an_fmu_is_valid_and_simulates(fmus, block, version):
    file = str(fmus / f"{block}-fmi{version}.fmu")
    assert validate_fmu(file) == []
    result = fmpy.simulate_fmu(file, stop_time=0.01, output_interval=1e-3)
    assert len(result) == 11 and all(np.isfinite(result[name]).all() for name in result.dtype.names)


@VERSIONS
def test_units_values_and_causalities_come_from_the_block(importers, version):
    of = importers["friction", version].description
    variables = {variable.name: variable for variable in of.modelVariables}
    stiffness = next(variable for name, variable in variables.items() if name.endswith("bristle_stiffness"))
    assert (stiffness.unit, stiffness.causality, stiffness.variability) == ("N.m/rad", "parameter", "tunable")
    assert float(stiffness.start) == 60.0 and float(stiffness.min) == 1e-3
    unit = next(unit for unit in of.unitDefinitions if unit.name == "N.m/rad")
    assert (unit.baseUnit.kg, unit.baseUnit.m, unit.baseUnit.s, unit.baseUnit.rad) == (1, 2, -2, -1)


@VERSIONS
@pytest.mark.parametrize("block", ["friction", "bench"])
def test_results_have_the_bits_of_the_generated_code(fmus, importers, block, version):
    folder = fmus / block
    library = fmus / f"{block}.so"
    subprocess.run(["cc", "-std=c99", "-O2", "-fPIC", "-shared", folder / f"{block}.c", "-o", library, "-lm"], check=True)
    native = ctypes.CDLL(str(library))
    sizes = json.loads((folder / "summary.json").read_text())["results"]
    array = lambda kind: (ctypes.c_double * int(sizes[f"generate.{kind}"]["value"]))()  # noqa: E731
    parameters, state, native_inputs, native_outputs = (array(kind) for kind in ("parameters", "states", "inputs", "outputs"))
    getattr(native, f"{block}_parameters_init")(parameters)
    getattr(native, f"{block}_init")(state)
    step = getattr(native, f"{block}_step")
    step.argtypes = [ctypes.c_void_p] * 3 + [ctypes.c_double, ctypes.c_void_p]
    of = importers[block, version]
    instance, dt = of.instance(), sizes["generate.step"]["value"]
    inputs, outputs, states = of.names("input"), of.names("output"), of.names("state")
    assert [len(it) for it in (inputs, outputs, states)] == [len(it) for it in (native_inputs, native_outputs, state)]
    random = np.random.default_rng(1)
    start, moved = instance.get(inputs), False
    for k in range(400):
        values = start + random.normal(scale=0.3, size=len(inputs)) * (k % 3 > 0)
        native_inputs[:] = values
        assert step(parameters, state, native_inputs, dt, native_outputs) == 0
        instance.set(dict(zip(inputs, values)))
        instance.step(k * dt, dt)
        np.testing.assert_array_equal(instance.get(outputs), np.array(native_outputs))
        np.testing.assert_array_equal(instance.get(states), np.array(state))
        moved = moved or (k > 0 and list(native_outputs) != before)
        before = list(native_outputs)
    assert moved
    instance.free()


@VERSIONS
def test_a_hundred_parallel_instances_are_independent(importers, version):
    of = importers["friction", version]
    alone = []
    for k in range(100):
        instance = of.instance()
        alone.append(run(instance, 30, 0.1 * k))
        instance.free()
    instances = [of.instance() for _ in range(100)]
    together = np.empty((100, 30))
    for step in range(30):
        for k, instance in enumerate(instances):
            instance.set({"input.velocity": 0.1 * k * np.sin(2e-3 * step)})
            instance.step(step * STEP, STEP)
            together[k, step] = instance.get(["output.torque"])[0]
    np.testing.assert_array_equal(together, np.array(alone))
    assert len(np.unique(together[:, -1])) == 100
    for instance in instances:
        instance.free()


@VERSIONS
def test_saved_restored_and_reset_states_continue_with_the_same_bits(importers, version):
    of = importers["bench", version]
    dt, outputs = of.description.defaultExperiment.stepSize, of.names("output")
    dt = float(dt)
    instance = of.instance()

    def course(instance, first, count):
        rows = []
        for k in range(first, first + count):
            instance.step(k * dt, dt)
            rows.append(instance.get(outputs))
        return np.array(rows)

    before = course(instance, 0, 20)
    state, saved = instance.state(), instance.saved()
    after = course(instance, 20, 20)
    instance.restore(state)
    np.testing.assert_array_equal(course(instance, 20, 20), after)
    instance.fmu.freeFMUState(state)
    other = of.instance()
    other.restore_saved(saved)
    np.testing.assert_array_equal(course(other, 20, 20), after)
    instance.fmu.reset()
    instance.begin()
    np.testing.assert_array_equal(course(instance, 0, 20), before)
    broken = bytearray(saved)
    broken[3] ^= 1
    instance.refused("not saved by this model", instance.restore_saved, bytes(broken))
    instance.refused("not saved by this model", instance.restore_saved, saved[:-1])
    instance.free()
    other.free()


@VERSIONS
def test_results_do_not_depend_on_the_communication_steps(importers, version):
    of = importers["friction", version]
    torques = []
    for lengths in ([STEP] * 40, [40 * STEP], [0.4 * STEP] * 100, [3.0 * STEP, 0.5 * STEP, 20.25 * STEP, 16.25 * STEP]):
        instance = of.instance(start=0.5)
        instance.set({"input.velocity": 0.3})
        point = 0.5
        for length in lengths:
            instance.step(point, length)
            point += length
        assert abs(point - 0.5 - 40 * STEP) < 1e-12
        torques.append(instance.get(["output.torque", *of.names("state")]))
        instance.free()
    for other in torques[1:]:
        np.testing.assert_array_equal(torques[0], other)


@VERSIONS
@pytest.mark.parametrize("start", [0.0, 1e6])
def test_results_do_not_depend_on_how_the_importer_computes_its_time(importers, version, start):
    """Importers add up steps, multiply them, or pass the difference of two times as the length."""
    of = importers["friction", version]
    instances = [of.instance(start=start) for _ in range(3)]
    added = start
    for k in range(10000):
        now, after = start + k * STEP, start + (k + 1) * STEP
        rows = []
        for instance, point, length in zip(instances, (now, added, now), (STEP, STEP, after - now)):
            instance.set({"input.velocity": 0.3 if k // 40 % 2 else -0.3})
            instance.step(point, length)
            rows.append(instance.get(["output.torque"])[0])
        assert rows[0] == rows[1] == rows[2], k
        added += STEP
    for instance in instances:
        instance.free()


@VERSIONS
def test_invalid_calls_are_refused_with_a_message_and_change_nothing(importers, version):
    of = importers["friction", version]
    with pytest.raises(Exception, match="nstantiate"):
        of.bare(token="{00000000-0000-0000-0000-000000000000}")
    instance = of.instance()
    stiffness = next(name for name in of.names("parameters") if name.endswith("bristle_stiffness"))
    instance.refused("no variable of value reference 9999", instance.take, [9999])
    instance.refused("no variable of value reference 9999", instance.put, [of.references["input.velocity"], 9999], [0.7, 1.0])
    assert instance.get(["input.velocity"])[0] == 0.0
    for value in (np.nan, np.inf):
        instance.refused("is not finite", instance.set, {"input.velocity": value})
    instance.refused("is computed", instance.set, {"output.torque": 1.0})
    instance.refused("after initialization ends", instance.set, {of.names("state")[0]: 1.0})
    for point, length, words in ((0.0, -STEP, "is not valid"), (0.0, np.nan, "is not valid"), (1.0, STEP, "the instance is at 0 s")):
        instance.refused(words, instance.step, point, length)
    instance.set({stiffness: -1.0})
    instance.refused("bristle_stiffness", instance.step, 0.0, STEP)
    instance.set({stiffness: 60.0})
    untouched = of.instance()
    np.testing.assert_array_equal(run(instance, 10), run(untouched, 10))
    if version == 3:
        instance.refused("2 values for 1 variables", instance.fmu.getFloat64, [1], 2)
    instance.fmu.terminate()
    instance.refused("only between initialization", instance.step, 10 * STEP, STEP)
    instance.free()
    untouched.free()


@VERSIONS
def test_a_parameter_change_affects_only_later_steps(importers, version):
    of = importers["friction", version]
    name = next(name for name in of.names("parameters") if name.endswith("kinetic_torque"))
    one, other = of.instance(), of.instance()
    np.testing.assert_array_equal(run(one, 20), run(other, 20))
    other.set({name: 0.8 * other.get([name])[0]})
    for instance in (one, other):
        instance.set({"input.velocity": 20.0})
        instance.step(20 * STEP, 2000 * STEP)
    first, second = (instance.get(["output.torque"])[0] for instance in (one, other))
    assert second < 0.9 * first
    one.free()
    other.free()


@VERSIONS
def test_the_rounding_mode_of_the_importer_is_preserved(importers, version):
    of = importers["friction", version]
    expected = run(of.instance(), 50)
    library = ctypes.CDLL("libm.so.6")
    upward = 0x800  # FE_UPWARD of x86
    instance = of.instance()
    torques = []
    for k in range(50):
        velocity = np.sin(2e-3 * k)
        instance.set({"input.velocity": velocity})
        try:
            library.fesetround(upward)
            instance.step(k * STEP, STEP)
            assert library.fegetround() == upward
        finally:
            library.fesetround(0)
        torques.append(instance.get(["output.torque"])[0])
    np.testing.assert_array_equal(np.array(torques), expected)


@VERSIONS
@pytest.mark.parametrize("block", ["friction", "position_controller"])
def test_derivatives_are_the_slopes_of_a_step(importers, block, version):
    of = importers[block, version]
    dt = float(of.description.defaultExperiment.stepSize)
    instance = of.instance()
    inputs, states, outputs = of.names("input"), of.names("state"), of.names("output")
    random = np.random.default_rng(3)
    start = instance.get(inputs)
    for k in range(20):
        instance.set(dict(zip(inputs, start + random.normal(scale=0.05, size=len(inputs)))))
        instance.step(k * dt, dt)
    saved, values = instance.saved(), instance.get(inputs)
    unknowns = [of.references[name] for name in [*states, *outputs]]

    def after(name, value):
        instance.restore_saved(saved)
        instance.set({name: value})
        instance.step(20 * dt, dt)
        return instance.take(unknowns)

    slopes = {}
    for name, value in zip(inputs, values):
        instance.restore_saved(saved)
        slopes[name] = np.array(instance.fmu.getDirectionalDerivative(unknowns, [of.references[name]], [1.0]))
        width = 1e-6 * max(1.0, abs(value))
        differences = (after(name, value + width) - after(name, value - width)) / (2.0 * width)
        # Second differences of 1e-6 and rounding of 1e-16/1e-6, over the size of the numbers.
        np.testing.assert_allclose(slopes[name], differences, rtol=1e-5, atol=1e-6 * max(1.0, np.abs(differences).max()))
    assert any(np.abs(slope).max() > 0.0 for slope in slopes.values())
    # Derivatives are linear in the direction, and exist for states as well as for inputs.
    instance.restore_saved(saved)
    seeds = random.normal(size=len(inputs))
    together = instance.fmu.getDirectionalDerivative(unknowns, [of.references[name] for name in inputs], list(seeds))
    np.testing.assert_allclose(together, sum(seed * slopes[name] for seed, name in zip(seeds, inputs)), rtol=1e-9, atol=1e-12)
    by_state = instance.fmu.getDirectionalDerivative([of.references[states[0]]], [of.references[states[0]]], [1.0])
    assert np.isfinite(by_state).all()
    if version == 3:
        weights, known_references = random.normal(size=len(unknowns)), [of.references[name] for name in inputs]
        adjoint = instance.fmu.getAdjointDerivative(unknowns, known_references, list(weights), len(known_references))
        np.testing.assert_allclose(adjoint, [weights @ slopes[name] for name in inputs], rtol=1e-9, atol=1e-12)
        several = [unknowns[0]] * (len(unknowns) + 1)
        instance.refused("but the model computes", instance.fmu.getAdjointDerivative, several, known_references, [1.0] * len(several), len(known_references))
        instance.refused("Each unknown has one seed", instance.fmu.getAdjointDerivative, unknowns, known_references, list(weights), 1)
    parameter = of.references[of.names("parameters")[0]]
    instance.refused("has no derivatives", instance.fmu.getDirectionalDerivative, [parameter], [unknowns[0]], [1.0])
    output = of.references[outputs[0]]
    instance.refused("it is an output", instance.fmu.getDirectionalDerivative, [output], [output], [1.0])
    instance.free()


@VERSIONS
def test_freed_instances_leave_no_memory(importers, version):
    of = importers["bench", version]

    def create_and_free(count):
        for _ in range(count):
            instance = of.instance()
            instance.step(0.0, 1e-3)
            instance.restore_saved(instance.saved())
            instance.fmu.freeInstance = lambda: None
            (instance.fmu.fmi2FreeInstance if version == 2 else instance.fmu.fmi3FreeInstance)(instance.fmu.component)

    size = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # noqa: E731
    create_and_free(50)
    before = size()
    create_and_free(4000)
    instance = of.instance()
    bytes_each = len(instance.saved())
    instance.free()
    # A leaked instance or state would add all of its bytes; the interpreter itself uses some megabytes.
    assert (size() - before) * 1024 < 0.7 * 4000 * bytes_each, (size() - before, bytes_each)


def test_an_fmu_contains_compilable_sources(fmus):
    import zipfile

    for version, description in ((2, "modelDescription.xml"), (3, "sources/buildDescription.xml")):
        with zipfile.ZipFile(fmus / f"bench-fmi{version}.fmu") as archive:
            names = archive.namelist()
            assert {"sources/bench.c", "sources/bench.h", f"sources/fmi{version}.c", "documentation/index.html"} <= set(names)
            assert f'"fmi{version}.c"' in archive.read(description).decode()
            folder = pathlib.Path(fmus) / f"unpacked{version}"
            archive.extractall(folder)
        command = ["cc", "-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", f"fmi{version}.c"]
        subprocess.run(command, cwd=folder / "sources", check=True)
