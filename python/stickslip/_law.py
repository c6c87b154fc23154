"""Controllers as Python functions: interpreted, recorded as a graph, written as C, compiled to a library."""

from __future__ import annotations

import dataclasses
import inspect
import math
import os
import re
import shutil
import tempfile
import time
import types
import weakref
from collections.abc import Callable, Mapping
from typing import Any

from . import _stickslip
from ._errors import InvalidValue, NotRecordable, UnknownName
from ._names import Names, Placed, nearest, number
from ._running import Compiled, Interpreted, Running, Sample
from ._stickslip import Code, Measured, Number, Recording, Setpoint

SIGNALS = [field.name for field in dataclasses.fields(Sample)] + ["torque_limit"]
"""Inputs of a controller in a sample, in the order of its graph."""

_NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclasses.dataclass(frozen=True)
class Tunable:
    """Parameter of a controller that may change while it runs: default value, SI unit, range, help text.

    >>> import stickslip
    >>> stickslip.Tunable(20.0, "1/s", minimum=0.0, maximum=1e4, help="Gain of the position.").unit
    '1/s'
    """

    value: float
    unit: str = "1"
    minimum: float = -math.inf
    maximum: float = math.inf
    help: str = ""

    def check(self, name: str, value: float) -> float:
        """Return the value as float. Raises InvalidValue outside the range."""
        value = float(value)
        if math.isfinite(value) and self.minimum <= value <= self.maximum:
            return value
        cause = f"{name} = {value!r} {self.unit} is outside {self.minimum:g} … {self.maximum:g} {self.unit}."
        raise InvalidValue(f"{cause} Give a finite number within this range.")


class ControlLaw:
    """A controller written as a Python function; `stickslip.controller` creates it.

    `parameters` are its tunables, `states` its initial states. `begin` runs it in Python, `build` compiles it to a
    library, `c` and `generate` return and write C code, `fmu` writes an FMU. `stickslip.simulate(controller=…)` closes
    the loop with it.
    """

    def __init__(
        self, function: Callable[..., Any], parameters: Mapping[str, Tunable], states: Mapping[str, float]
    ) -> None:
        self.function = function
        self.name = function.__name__
        self.help = inspect.getdoc(function) or ""
        self.parameters = types.MappingProxyType(dict(parameters))
        self.states = types.MappingProxyType({name: float(value) for name, value in states.items()})
        self._recording: tuple[Recording, float] | None = None
        self._library: Library | None = None
        _check(self)

    def __call__(self, p: Any, state: Any, sample: Any, dt: Any) -> Any:
        """Call the function."""
        return self.function(p, state, sample, dt)

    def set(self, **values: float) -> ControlLaw:
        """Return the same controller with other parameter values. Raises UnknownName or InvalidValue."""
        changed = chosen(self, {}, values)
        parameters = {
            name: dataclasses.replace(it, value=changed.get(name, it.value)) for name, it in self.parameters.items()
        }
        return ControlLaw(self.function, parameters, self.states)

    def begin(self, sample_time: float = 1e-3, torque_limit: float = 1.0, **parameters: float) -> Running:
        """Start the controller in Python in its initial state.

        - `sample_time`: time between samples [s].
        - `torque_limit`: torque limit of the drive [N m].
        - `parameters`: values that differ from the defaults.

        Raises UnknownName or InvalidValue for a wrong parameter.
        """
        return Interpreted(self, sample_time, torque_limit, chosen(self, self._values(), parameters))

    def c(self, sample_time: float = 1e-3) -> dict[str, str]:
        """Return the C source of the library: file names and texts. `generate` also writes self-test and example."""
        return dict(self._write(sample_time).sources)

    def generate(self, folder: str | os.PathLike[str], sample_time: float = 1e-3, diagram: bool = True) -> None:
        """Write the C project into a folder, as `stickslip generate c`: code, self-test, example, page, diagram.

        - `sample_time`: time between samples of self-test and example [s].
        - `diagram`: draw the signal-flow diagram. For several hundred operations this takes minutes.
        """
        self._write(sample_time).generate(os.fspath(folder), diagram)

    def fmu(self, path: str | os.PathLike[str], sample_time: float = 1e-3, version: int = 3) -> None:
        """Write an FMU for co-simulation (FMI 2 or 3) with steps of `sample_time` [s]."""
        if version not in (2, 3):
            raise InvalidValue(f"FMI version {version} is not supported. Use 2 or 3.")
        self._write(sample_time).fmu(os.fspath(path), version)

    def build(self, path: str | os.PathLike[str] | None = None) -> Library:
        """Compile the controller with `$CC` (default: `cc`) to a library for `stickslip load`.

        - `path`: file to write. Default: a temporary folder that is deleted together with the Library object.

        Controllers that already run from an older file at `path` are not affected. Raises Error where there is no
        compiler or where it fails.
        """
        _, recorded = self._record()
        start = time.perf_counter()
        code = self._write(1e-3)
        written = time.perf_counter()
        folder = "" if path is not None else tempfile.mkdtemp(prefix="stickslip-")
        file = os.path.join(folder, f"{self.name}.so") if path is None else os.fspath(path)
        code.compile(file)
        library = Library(self, os.path.abspath(file), recorded, written - start, time.perf_counter() - written)
        if path is None:
            weakref.finalize(library, _remove, file)
        return library

    @property
    def operations(self) -> int:
        """Number of operations of the recorded graph."""
        return self._record()[0].operations

    def evaluate(self, p: Mapping[str, Any], state: dict[str, Any], signals: Mapping[str, Any], dt: Any) -> Number:
        """Return the torque and put the new state into `state`. The numbers may be floats or those of a graph."""
        assigned: set[str] = set()
        with Placed(self.function):
            sample = Names("sample", dict(signals))
            torque = self.function(Names("p", dict(p)), Names("state", state, assigned), sample, dt)
            if torque is None:
                raise NotRecordable(f"{self.name} returns nothing. Return the torque of the drive [N m].")
            missing = [name for name in self.states if name not in assigned]
            if missing:
                remedy = "Assign its value for the next sample, or declare it as a parameter."
                raise NotRecordable(f"state.{missing[0]} is never assigned. {remedy}")
            return number("the torque", torque)

    def controls(self, bench: Any) -> Callable[[Setpoint, Measured], float]:
        """Return the controller for a preset: compiled if there is a compiler, else in Python, with the same bits."""
        period, limit = _stickslip.sampling_of(bench)
        if self._library is None and has_compiler():
            self._library = self.build()
        running = (self._library or self).begin(period, limit)

        def torque(reference: Setpoint, measured: Measured) -> float:
            setpoint = (reference.position, reference.velocity, reference.acceleration)
            return running.torque((measured.time, *setpoint, measured.angle, measured.velocity))

        return torque

    def _values(self) -> dict[str, float]:
        return {name: it.value for name, it in self.parameters.items()}

    def _record(self) -> tuple[Recording, float]:
        if self._recording is None:
            start = time.perf_counter()
            rows = [(name, it.unit, it.help, it.minimum, it.maximum, it.value) for name, it in self.parameters.items()]
            states = [(name, "1", "", -math.inf, math.inf, value) for name, value in self.states.items()]

            def step(p: list[Number], s: list[Number], sample: list[Number], dt: Number) -> tuple[list[Number], Number]:
                state = dict(zip(self.states, s))
                torque = self.evaluate(dict(zip(self.parameters, p)), state, dict(zip(SIGNALS, sample)), dt)
                return list(state.values()), torque

            recording = _stickslip.record_controller(self.name, self.help, rows, states, step)
            self._recording = recording, time.perf_counter() - start
        return self._recording

    def _write(self, sample_time: float) -> Code:
        return self._record()[0].write(sample_time)

    def __repr__(self) -> str:
        parameters = ", ".join(f"{name}={it.value!r} {it.unit}" for name, it in self.parameters.items())
        return f"ControlLaw({self.name}: {parameters or 'no parameters'}; states {', '.join(self.states) or 'none'})"


@dataclasses.dataclass(frozen=True, eq=False)
class Library:
    """A compiled controller: its file and the duration of each build step [s]."""

    law: ControlLaw
    path: str
    recorded: float
    written: float
    compiled: float

    def begin(self, sample_time: float = 1e-3, torque_limit: float = 1.0, **parameters: float) -> Running:
        """Start an independent instance in its initial state, with the arguments of `ControlLaw.begin`."""
        return Compiled(self, sample_time, torque_limit, chosen(self.law, self.law._values(), parameters))

    def __repr__(self) -> str:
        steps = f"recorded in {self.recorded:.4f} s, written in {self.written:.4f} s, compiled in {self.compiled:.3f} s"
        return f"{self.path}: {steps}"


def controller(
    *, states: Mapping[str, float] | None = None, **parameters: Tunable
) -> Callable[[Callable[..., Any]], ControlLaw]:
    """Create a controller from a function `law(p, state, sample, dt)` that returns the drive torque [N m].

    - `states`: names and initial values of the states.
    - `parameters`: Tunables by name.

    The function reads parameters (`p.gain`), states (`state.integral`), the sample (`sample.reference_position`, the
    other fields of `Sample`, and `sample.torque_limit`) and the time between samples `dt` [s]. It assigns each state
    its value for the next sample. It is recorded once for all samples: use `stickslip.where` instead of `if` for
    conditions on signals. Raises InvalidValue for a wrong declaration.

    >>> import stickslip
    >>> @stickslip.controller(gain=stickslip.Tunable(2.0, "N m/rad", minimum=0.0), states={"last": 0.0})
    ... def law(p, state, sample, dt):
    ...     deviation = sample.reference_position - sample.measured_angle
    ...     rate = (deviation - state.last) / dt
    ...     state.last = deviation
    ...     return stickslip.clip(p.gain * deviation + 0.01 * rate, -sample.torque_limit, sample.torque_limit)
    >>> round(law.begin(torque_limit=0.5).step(stickslip.Sample(reference_position=0.01)), 6)
    0.12
    """
    return lambda function: ControlLaw(function, parameters, states or {})


def has_compiler() -> bool:
    """Return whether a C compiler is available."""
    return shutil.which(os.environ.get("CC") or "cc") is not None


def chosen(law: ControlLaw, defaults: Mapping[str, float], changes: Mapping[str, float]) -> dict[str, float]:
    """Return parameter values with checked changes."""
    values = dict(defaults)
    for name, value in changes.items():
        if name not in law.parameters:
            raise UnknownName(f"{law.name} has no parameter {name}.{nearest(name, law.parameters)}")
        values[name] = law.parameters[name].check(name, value)
    return values


def _check(law: ControlLaw) -> None:
    """Check the declarations. Raises InvalidValue."""
    for name in [*law.parameters, *law.states]:
        if not _NAME.fullmatch(name):
            raise InvalidValue(f"Invalid name {name} of a parameter or state. Use lower-case letters, digits and _.")
    for name, it in law.parameters.items():
        if not isinstance(it, Tunable):
            raise InvalidValue(f"{name} = {it!r} has neither unit nor range. Use stickslip.Tunable({it!r}, unit, …).")
        for text in (it.unit, it.help):
            if not text.isprintable() or '"' in it.unit or "\\" in it.unit:
                raise InvalidValue(f"Invalid unit or help text {text!r} of {name}. Use printable text on one line.")
        it.check(name, it.value)
    for name, value in law.states.items():
        if not math.isfinite(value):
            raise InvalidValue(f"Invalid initial state {name} = {value}. Give a finite number.")
    try:
        inspect.signature(law.function).bind(*"psid")
    except TypeError:
        raise InvalidValue(f"{law.name} must take four arguments: def {law.name}(p, state, sample, dt).") from None
    # The generated library defines functions with these names.
    if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", law.name) or law.name.lower().startswith("stickslip"):
        remedy = "Use def with a name of letters, digits and _ that does not begin with stickslip."
        raise InvalidValue(f"Invalid controller name {law.name}. {remedy}")


def _remove(file: str) -> None:
    shutil.rmtree(os.path.dirname(file), ignore_errors=True)
