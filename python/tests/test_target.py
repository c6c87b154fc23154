"""Controllers written in Python: function, C and library have the same bits; errors name the line."""

import ctypes
import inspect
import itertools
import math
import os
import pathlib
import random
import struct
import subprocess
import sys

import numpy as np
import pytest

import stickslip
from stickslip import NotRecordable, Sample, Tunable, clip, maximum, minimum, where
from stickslip._law import ControlLaw
from stickslip._running import functions

SINE = {"reference": "sine", "amplitude": 1.0, "frequency": 2.0}
ODD = [0.0, -0.0, 5e-324, -5e-324, 1e-310, 1.0, -1.5, 1e300, -1e308, math.inf, -math.inf, math.nan]
NUMBER = Tunable(1.0)


@stickslip.controller(
    position_gain=Tunable(20.0, "1/s", minimum=0.0, maximum=1e4, help='Gain of the "position".'),
    velocity_gain=Tunable(0.08, "N m s/rad", minimum=0.0, maximum=1e3),
    integral_gain=Tunable(1.0, "N m/rad", minimum=0.0),
    states={"integral": 0.0, "last": 0.25},
)
def law(p, state, sample, dt):
    """A cascade."""
    wanted = p.position_gain * (sample.reference_position - sample.measured_angle) + sample.reference_velocity
    deviation = wanted - sample.measured_velocity
    torque = p.velocity_gain * deviation + state.integral
    free = (abs(torque) < sample.torque_limit) & ~(deviation != deviation)
    state.integral = where(free, state.integral + p.integral_gain * deviation * dt, state.integral)
    state.last = deviation
    return torque


@stickslip.controller(gain=Tunable(0.5, "1"), weight=Tunable(2.0, "1", minimum=0.1), states={"slow": 1.0})
def everything(p, state, sample, dt):
    """Uses every supported function."""
    a, b = sample.reference_position, sample.measured_angle
    total = p.gain * stickslip.sin(a) + stickslip.cos(b) / p.weight - stickslip.exp(-abs(a))
    for power in range(3):
        total = total + (0.5**power) * stickslip.sign(sample.measured_velocity - power)
    total += round(a) + stickslip.floor(b) + stickslip.log(maximum(abs(b), 1e-300))
    steady = (a <= b) | (a >= 2.0 * b) & ~(a == 0.0)
    state.slow = minimum(state.slow + dt * clip(total, -1.0, 1.0), 3.0)
    return where(steady, total, -total) + state.slow + 1.0 / (1.0 + a * a) + np.float64(0.25) * b


@stickslip.controller()
def bare(p, state, sample, dt):
    return 1.0 / sample.reference_position


@stickslip.controller(states={"sum": 0.0})
def roots(p, state, sample, dt):
    state.sum = stickslip.sqrt(sample.reference_velocity * sample.reference_velocity)
    return stickslip.sqrt(sample.reference_position) + state.sum


def bits(number):
    return struct.pack("<d", number)


def outcome(running, sample):
    """Return the bits of the torque; None without a finite one."""
    try:
        return bits(running.step(sample))
    except stickslip.NotComputed:
        return None


@pytest.fixture(scope="module")
def libraries():
    return {it.name: it.build() for it in (law, everything, bare, roots)}


@pytest.mark.parametrize("name", ["law", "everything", "bare", "roots"])
def test_the_library_has_the_bits_of_the_function_for_odd_inputs(libraries, name):
    library = libraries[name]
    generator = random.Random(3)
    compiled, interpreted = library.begin(1e-3, 0.5), library.law.begin(1e-3, 0.5)
    counts = {True: 0, False: 0}
    pairs = list(itertools.product(ODD, repeat=2))
    odd = [Sample(0.0, *pair, 0.0, *rest) for pair in pairs for rest in [(1.0, 2.0), pair]]
    usual = [Sample(*(generator.gauss(0.0, 10.0 ** generator.randint(-3, 3)) for _ in range(6))) for _ in range(500)]
    for sample in odd + usual:
        expected = outcome(interpreted, sample)
        assert outcome(compiled, sample) == expected, sample
        counts[expected is None] += 1
    assert min(counts.values()) > 5, "samples with and without a finite torque"


def test_a_whole_closed_loop_is_the_same_compiled_and_over_floats(bench, monkeypatch):
    over_floats = law.set()
    monkeypatch.setattr("stickslip._law.has_compiler", lambda: False)
    plain = stickslip.simulate(bench, SINE, 1.0, controller=over_floats)
    assert over_floats._library is None
    monkeypatch.undo()
    compiled = law.set()
    run = stickslip.simulate(bench, SINE, 1.0, controller=compiled)
    assert compiled._library is not None and run.stopped is None
    for name, values in run.items():
        assert values.tobytes() == plain[name].tobytes(), name
    assert np.abs(run["reference_position"] - run["true_angle"]).max() < 0.3
    other = stickslip.simulate(bench, SINE, 1.0, controller=law.set(position_gain=5.0))
    assert not np.array_equal(other["true_angle"], run["true_angle"])


def test_a_hundred_instances_are_independent(libraries):
    gains = [1.0 + 0.1 * k for k in range(100)]
    together = [libraries["law"].begin(1e-3, 0.5, position_gain=gain) for gain in gains]
    alone = [law.begin(1e-3, 0.5, position_gain=gain) for gain in gains]
    generator = random.Random(5)
    for count in range(20):
        for k in generator.sample(range(100), 100):
            sample = Sample(count * 1e-3, generator.uniform(-1, 1), measured_velocity=generator.uniform(-1, 1))
            assert together[k].step(sample) == alone[k].step(sample)
        k = generator.randrange(100)
        for running in (together[k], alone[k]):
            running.set(velocity_gain=0.01 * count)


def test_a_failed_step_does_not_change_the_state(libraries):
    for running in (libraries["law"].begin(), law.begin()):
        running.step(Sample(measured_angle=0.01))
        with pytest.raises(stickslip.NotComputed, match="law computes a non-finite torque"):
            running.step(Sample(measured_angle=math.nan))
    compiled, interpreted = libraries["law"].begin(), law.begin()
    for angle in (0.01, math.inf, 0.02, math.nan, 0.03):
        assert outcome(compiled, Sample(measured_angle=angle)) == outcome(interpreted, Sample(measured_angle=angle))


def test_the_library_describes_its_parameters(libraries):
    class Parameter(ctypes.Structure):
        _fields_ = [(it, ctypes.c_char_p) for it in ("name", "unit", "help")]
        _fields_ += [(it, ctypes.c_double) for it in ("minimum", "maximum", "initial")]

    class Description(ctypes.Structure):
        _fields_ = [("abi", ctypes.c_uint32), ("count", ctypes.c_uint32), ("name", ctypes.c_char_p)]
        _fields_ += [("parameters", ctypes.POINTER(Parameter))]

    def described(name):
        return ctypes.cast(functions(libraries[name].path).stickslip_describe(), ctypes.POINTER(Description)).contents

    it = described("law")
    assert (it.abi, it.count, it.name) == (1, 3, b"law")
    first, *_, last = it.parameters[:3]
    assert (first.name, first.unit, first.help) == (b"position_gain", b"1/s", b'Gain of the "position".')
    assert (first.minimum, first.maximum, first.initial) == (0.0, 1e4, 20.0)
    assert last.maximum == sys.float_info.max, "a parameter without a bound has a finite range"
    assert described("bare").count == 0 and not described("bare").parameters


def test_the_library_refuses_invalid_parameters_and_times(libraries):
    library = functions(libraries["law"].path)
    good = [20.0, 0.08, 1.0]

    def starts(sample_time, limit, values):
        controller = library.stickslip_begin(sample_time, limit, (ctypes.c_double * 3)(*values))
        if controller:
            library.stickslip_end(controller)
        return bool(controller)

    assert starts(1e-3, 0.5, good)
    for wrong in (math.nan, math.inf, -1.0, 1e5):
        assert not starts(1e-3, 0.5, [wrong, *good[1:]]), wrong
    for sample_time, limit in ((0.0, 1.0), (math.nan, 1.0), (math.inf, 1.0), (1e-3, -1.0), (1e-3, math.nan)):
        assert not starts(sample_time, limit, good)
    controller = library.stickslip_begin(1e-3, 0.5, (ctypes.c_double * 3)(*good))
    torque, sample = ctypes.c_double(), (ctypes.c_double * 6)(0.0, 0.01)
    assert library.stickslip_step(controller, sample, ctypes.byref(torque)) == 0
    assert library.stickslip_set(controller, (ctypes.c_double * 3)(math.nan, 0.08, 1.0)) != 0
    later = ctypes.c_double()
    assert library.stickslip_step(controller, (ctypes.c_double * 6)(), ctypes.byref(later)) == 0
    assert later.value == pytest.approx(20.0 * 0.01 * 1e-3), "the previous parameters remain active"
    library.stickslip_end(controller)


def test_python_refuses_values_outside_the_ranges_with_a_message(libraries):
    for it in (law, libraries["law"]):
        with pytest.raises(stickslip.InvalidValue, match=r"position_gain = nan 1/s is outside 0 … 10000 1/s"):
            it.begin(position_gain=math.nan)
        with pytest.raises(stickslip.UnknownName, match="Did you mean position_gain"):
            it.begin(position_gian=1.0)
        with pytest.raises(stickslip.InvalidValue, match="sample_time"):
            it.begin(0.0)
        with pytest.raises(stickslip.InvalidValue, match="torque_limit"):
            it.begin(1e-3, math.nan)


def test_functions_have_their_stated_accuracy():
    generator = random.Random(7)
    for _ in range(20_000):
        x = generator.uniform(1.0, 4.0) * 2.0 ** generator.randint(-1000, 1000)
        assert abs(float(stickslip.sqrt(x)) - math.sqrt(x)) <= math.ulp(math.sqrt(x)), x
        y = generator.uniform(-300.0, 300.0)
        assert abs(float(stickslip.exp(y)) - math.exp(y)) <= 2 * math.ulp(math.exp(y)), y
        assert abs(float(stickslip.log(x)) - math.log(x)) <= 2 * math.ulp(math.log(x)), x
        assert abs(float(stickslip.sin(y)) - math.sin(y)) <= 2 * math.ulp(math.sin(y)), y
    assert [float(stickslip.sqrt(x)) for x in (0.0, 1e-310, math.inf)] == [0.0, 0.0, math.inf]
    assert bits(float(stickslip.sqrt(-0.0))) == bits(-0.0)
    assert all(math.isnan(float(stickslip.sqrt(x))) for x in (-1.0, -math.inf, math.nan))
    assert [float(stickslip.sign(x)) for x in (-2.0, 0.0, 3.0, math.nan)] == [-1.0, 0.0, 1.0, 0.0]
    assert [float(round(stickslip.clip(x, -10.0, 10.0))) for x in (0.5, 1.5, -2.5, 99.0)] == [0.0, 2.0, -2.0, 10.0]


# Functions that cannot be recorded. "# here" marks the line that the error must name.


def branch(p, state, sample, dt):
    if sample.measured_velocity > 0.0:  # here
        return 1.0
    return 0.0


def both(p, state, sample, dt):
    return where(sample.time > 1.0 and sample.time < 2.0, 1.0, 0.0)  # here


def built_in(p, state, sample, dt):
    return max(sample.time, 1.0)  # here


def floated(p, state, sample, dt):
    return float(sample.time)  # here


def of_math(p, state, sample, dt):
    return math.sin(sample.time)  # here


def of_numpy(p, state, sample, dt):
    return np.sin(sample.time)  # here


def chosen_by_numpy(p, state, sample, dt):
    return np.where(sample.time > 1.0, 1.0, 0.0)  # here


def compared(p, state, sample, dt):
    return where((sample.time > 1.0) == (sample.measured_angle > 1.0), 1.0, 0.0)  # here


def a_key(p, state, sample, dt):
    return {1.0: 2.0}[sample.time]  # here


def loop(p, state, sample, dt):
    x = sample.time
    while x > 1.0:  # here
        x = x - 1.0
    return x


def counted(p, state, sample, dt):
    for _ in range(sample.time):  # here
        pass
    return 0.0


def power(p, state, sample, dt):
    return sample.time**2  # here


def silent(p, state, sample, dt):  # here
    p.gain * sample.time


def texts(p, state, sample, dt):  # here
    return "much"


def whether(p, state, sample, dt):  # here
    return sample.time > 1.0


def flag(p, state, sample, dt):
    state.memory = sample.time > 1.0  # here
    return 0.0


def misspelt(p, state, sample, dt):
    return p.gian * sample.time  # here


def signal(p, state, sample, dt):
    return sample.measured_angel  # here


def undeclared(p, state, sample, dt):
    state.memroy = 1.0  # here
    return 0.0


def forgotten(p, state, sample, dt):  # here
    return state.memory


def tuned(p, state, sample, dt):
    p.gain = 2.0  # here
    return 0.0


def helper(x):
    return 1.0 if x > 0.0 else 0.0  # here


def within_a_function(p, state, sample, dt):
    return helper(sample.time)


REFUSED = {
    branch: "stickslip.where(condition, a, b)",
    both: "& | ~ join conditions",
    built_in: "stickslip.where(condition, a, b)",
    floated: "Use stickslip.sin",
    of_math: "Use stickslip.sin",
    of_numpy: "stickslip.where, minimum, maximum",
    chosen_by_numpy: "stickslip.where(condition, a, b)",
    compared: "conditions cannot be compared. Join them with & | ~",
    a_key: "unhashable",
    loop: "stickslip.where(condition, a, b)",
    counted: "'stickslip.Number' object cannot be interpreted as an integer",
    power: "Numbers of a controller support + - * /",
    silent: "silent returns nothing. Return the torque",
    texts: "the torque is a str",
    whether: "the torque is a condition, not a number. Convert a condition with stickslip.where",
    flag: "state.memory is a condition",
    misspelt: "p has no gian. Did you mean gain?",
    signal: "sample has no measured_angel. Did you mean measured_angle?",
    undeclared: "state has no memroy. Did you mean memory?",
    forgotten: "state.memory is never assigned",
    tuned: "p.gain cannot be set",
    within_a_function: "stickslip.where(condition, a, b)",
}


@pytest.mark.parametrize("function, remedy", REFUSED.items(), ids=[it.__name__ for it in REFUSED])
def test_an_unrecordable_function_is_refused_with_line_and_remedy(function, remedy):
    uses_state = function in (flag, undeclared, forgotten)
    refused = ControlLaw(function, {"gain": NUMBER}, {"memory": 0.0} if uses_state else {})
    with pytest.raises(NotRecordable) as caught:
        refused.c()
    lines, first = inspect.getsourcelines(helper if function is within_a_function else function)
    expected = first + next(number for number, line in enumerate(lines) if "# here" in line)
    it = caught.value
    assert (it.file, it.line) == (__file__, expected) and "# here" in it.source
    assert f"{__file__}:{expected}: `" in str(it) and remedy in str(it)
    # The failed recording has no effect on the next one.
    assert "law_step" in law.c()["law.c"]


def test_loops_and_branches_over_constants_are_unrolled():
    taps = [0.5, 0.25, 0.0, 0.125]

    @stickslip.controller(states={f"x{k}": 0.0 for k in range(len(taps))})
    def filtered(p, state, sample, dt):
        total = 0.0
        for k in reversed(range(len(taps))):
            before = getattr(state, f"x{k - 1}") if k > 0 else sample.measured_angle
            setattr(state, f"x{k}", before)
            if taps[k] != 0.0:
                total = total + taps[k] * before
        return total

    compiled, interpreted = filtered.build().begin(), filtered.begin()
    for angle in (1.0, 0.0, -2.0, 0.5):
        assert compiled.step(Sample(measured_angle=angle)) == interpreted.step(Sample(measured_angle=angle))
    assert interpreted.state == {"x0": 0.5, "x1": -2.0, "x2": 0.0, "x3": 1.0}


def test_a_thousand_operations_compile_to_a_library(tmp_path):
    @stickslip.controller(gain=NUMBER, states={f"x{k}": 0.0 for k in range(200)})
    def filtered(p, state, sample, dt):
        total = 0.0
        for k in reversed(range(200)):
            before = getattr(state, f"x{k - 1}") if k > 0 else sample.measured_angle
            setattr(state, f"x{k}", before)
            total = total + where(before > 0.01 * k, before * 0.5**k, p.gain * stickslip.sin(before))
        return total

    assert filtered.operations > 1000
    compiled, interpreted = filtered.build().begin(), filtered.begin()
    for count in range(250):
        sample = Sample(measured_angle=math.sin(count))
        assert compiled.step(sample) == interpreted.step(sample)
    filtered.generate(tmp_path, diagram=False)
    assert (tmp_path / "filtered_selftest.c").exists() and not list(tmp_path.glob("diagram/*"))


def test_a_number_of_an_ended_recording_is_refused():
    numbers = []

    def leaks(p, state, sample, dt):
        numbers.append(sample.time)
        return numbers[0] + sample.time

    ControlLaw(leaks, {}, {}).c()
    with pytest.raises(NotRecordable, match="recording that has ended"):
        numbers[0] + 1.0
    with pytest.raises(NotRecordable, match=r"numbers\[0\] \+ sample.time"):
        ControlLaw(leaks, {}, {}).c()


def test_other_errors_of_the_function_are_raised_unchanged():
    def fails(p, state, sample, dt):
        return sample.time / {}["nothing"]

    with pytest.raises(KeyError, match="nothing"):
        ControlLaw(fails, {}, {}).c()


@pytest.mark.parametrize(
    "declared, words",
    [
        ({"gain": 1.0}, r"Use stickslip.Tunable\(1.0"),
        ({"Gain": NUMBER}, "lower-case"),
        ({"gain": Tunable(2.0, minimum=0.0, maximum=1.0)}, "gain = 2.0 1 is outside 0 … 1 1"),
        ({"gain": Tunable(1.0, 'N"m')}, "printable"),
        ({"states": {"x": math.nan}}, "Invalid initial state"),
    ],
)
def test_a_wrong_declaration_is_refused(declared, words):
    with pytest.raises(stickslip.InvalidValue, match=words):
        stickslip.controller(**declared)(lambda p, state, sample, dt: 0.0)
    with pytest.raises(stickslip.InvalidValue, match=r"def <lambda>\(p, state, sample, dt\)"):
        stickslip.controller()(lambda sample: 0.0)
    with pytest.raises(stickslip.InvalidValue, match="Invalid controller name <lambda>. Use def"):
        stickslip.controller()(lambda p, state, sample, dt: 0.0)

    def double(p, state, sample, dt):
        return 0.0

    with pytest.raises(stickslip.Error, match='"double" is not a valid name.*no keyword. Give the function another name'):
        ControlLaw(double, {}, {}).c()
    double.__name__ = "stickslip_step"
    with pytest.raises(stickslip.InvalidValue, match="does not begin with stickslip"):
        ControlLaw(double, {}, {})


def test_a_missing_or_failing_compiler_is_named_with_the_remedy(monkeypatch):
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(stickslip.Error, match="no-such-compiler does not compile the generated code.*variable CC"):
        law.build()
    monkeypatch.setenv("CC", "false")
    with pytest.raises(stickslip.Error, match="false does not compile the generated code: no message"):
        law.build()


def test_a_running_library_is_not_affected_by_its_replacement(tmp_path):
    file = tmp_path / "law.so"
    before = law.build(file).begin()
    after = law.set(velocity_gain=1.0).build(file).begin()
    sample = Sample(reference_velocity=1.0)
    assert (before.step(sample), after.step(sample)) == (0.08, 1.0)


def test_the_c_project_passes_its_self_test_and_the_library_has_build_times(tmp_path, libraries):
    everything.generate(tmp_path)
    assert (tmp_path / "README.md").exists() and list((tmp_path / "diagram").glob("*.svg"))
    sources = ["everything.c", "everything_selftest.c", "main.c"]
    subprocess.run(["cc", "-std=c99", "-O2", "-o", "example", *sources], cwd=tmp_path, check=True)
    table = subprocess.run(["./example"], cwd=tmp_path, check=True, capture_output=True, text=True).stdout
    assert len(table.splitlines()) == 401
    library = libraries["everything"]
    assert min(library.recorded, library.written, library.compiled) > 0.0
    assert "recorded in" in repr(library) and library.path in repr(library)


def test_the_fmu_of_a_controller_has_the_same_bits(tmp_path):
    fmpy = pytest.importorskip("fmpy")
    law.fmu(tmp_path / "law.fmu")
    description = fmpy.read_model_description(tmp_path / "law.fmu")
    names = {variable.name for variable in description.modelVariables}
    assert {"parameters.position_gain", "input.measured_angle", "output.torque", "state.integral"} <= names
    start = {"input.reference_position": 0.01, "input.torque_limit": 0.5}
    result = fmpy.simulate_fmu(str(tmp_path / "law.fmu"), stop_time=0.005, start_values=start, output=["output.torque"])
    running = law.begin(1e-3, 0.5)
    assert [running.step(Sample(reference_position=0.01)) for _ in range(5)] == result["output.torque"][1:].tolist()


def test_the_command_builds_a_library_and_prints_each_step(tmp_path):
    example = pathlib.Path(__file__).parents[1] / "examples" / "own_controller.py"
    command = [sys.executable, "-m", "stickslip.target"]
    options = [str(example), "--out", "own.so", "--c", "project", "--fmu", "own.fmu"]
    ran = subprocess.run([*command, *options], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    for step in ("started", "read", "recorded", "written", "compiled", "loaded", "total"):
        assert f"  {step:9} " in ran.stdout
    assert ran.stdout.splitlines()[-1] == "To run it: stickslip load own.so"
    assert all((tmp_path / name).exists() for name in ("own.so", "project/cascade.c", "own.fmu"))
    (tmp_path / "wrong.py").write_text(
        "import stickslip\n\n@stickslip.controller()\ndef law(p, state, sample, dt):\n"
        "    return abs(sample.time) ** 2\n"
    )
    ran = subprocess.run([*command, "wrong.py"], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 1 and "wrong.py:5: `return abs(sample.time) ** 2`" in ran.stderr
    assert "Traceback" not in ran.stderr and not (tmp_path / "law.so").exists()


def test_the_program_loads_a_python_controller(program, tmp_path):
    example = pathlib.Path(__file__).parents[1] / "examples" / "own_controller.py"
    text = "import stickslip\n\n@stickslip.controller()\ndef law(p, state, sample, dt):\n    return 0.0\n"
    (tmp_path / "law.py").write_text(text)
    (tmp_path / "wrong.py").write_text(text.replace("0.0", "abs(sample.time) ** 2"))

    def load(file, python=sys.executable):
        command = [program, "load", str(file), "--duration", "1", "--out", "there"]
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, env=os.environ | {"PYTHON": python})

    ran = load(example)
    assert ran.returncode == 0, ran.stderr
    assert "  compiled " in ran.stderr and "  total " in ran.stderr, ran.stderr
    assert "cascade, SHA-256 " in ran.stdout and "sine_0.5hz" in ran.stdout
    # Without a torque the load does not follow; the supervision stops the run, and the output until then remains.
    ran = load("law.py")
    assert ran.returncode != 0 and "law, SHA-256 " in ran.stdout and "following error" in ran.stderr, ran.stderr
    ran = load("wrong.py")
    assert ran.returncode == 1 and "wrong.py:5: `return abs(sample.time) ** 2`" in ran.stderr
    assert "cannot be started" in load("law.py", "nopython").stderr
