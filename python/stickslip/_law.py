"""A controller as a function in Python: run over floats, recorded, written as C, compiled to a library."""

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
"""What a controller reads in a sample, in the order of its graph."""

_NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclasses.dataclass(frozen=True)
class Tunable:
    """A number of a controller that may be changed while it runs: value unless given, SI unit, range, meaning.

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
        """The value, where it lies within the range; else InvalidValue is raised."""
        value = float(value)
        if math.isfinite(value) and self.minimum <= value <= self.maximum:
            return value
        words = f"{name} = {value!r} {self.unit} is outside {self.minimum:g} … {self.maximum:g} {self.unit}."
        raise InvalidValue(f"{words} Give a finite number within it.")


class ControlLaw:
    """A controller that is written as a function, as `stickslip.controller` makes it.

    `parameters` are its tunables, `states` what it begins with. `begin` runs it over floats, `build` as compiled
    library; `c` and `generate` have its C, `fmu` writes its FMU. `stickslip.simulate(controller=…)` closes the loop with it.
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
        """The function itself."""
        return self.function(p, state, sample, dt)

    def set(self, **values: float) -> ControlLaw:
        """The same with other values of its parameters."""
        changed = chosen(self, {}, values)
        parameters = {
            name: dataclasses.replace(it, value=changed.get(name, it.value)) for name, it in self.parameters.items()
        }
        return ControlLaw(self.function, parameters, self.states)

    def begin(self, sample_time: float = 1e-3, torque_limit: float = 1.0, **parameters: float) -> Running:
        """Begins it at rest over floats, with samples every `sample_time` [s] and a drive of `torque_limit` [N m]."""
        return Interpreted(self, sample_time, torque_limit, chosen(self, self._values(), parameters))

    def c(self, sample_time: float = 1e-3) -> dict[str, str]:
        """Its library in C: the text of each file. Self-test and example are among what `generate` writes."""
        return dict(self._write(sample_time).sources)

    def generate(self, folder: str | os.PathLike[str], sample_time: float = 1e-3, diagram: bool = True) -> None:
        """Writes its project in C, as `stickslip generate c` does: code, self-test, example, page, diagram. The diagram
        of some hundred operations takes minutes; without `diagram` there is none."""
        self._write(sample_time).generate(os.fspath(folder), diagram)

    def fmu(self, path: str | os.PathLike[str], sample_time: float = 1e-3, version: int = 3) -> None:
        """Writes it as FMU for co-simulation, FMI 2 or 3, with steps of `sample_time` [s]."""
        if version not in (2, 3):
            raise InvalidValue(f"There is no FMI {version} here. Take 2 or 3.")
        self._write(sample_time).fmu(os.fspath(path), version)

    def build(self, path: str | os.PathLike[str] | None = None) -> Library:
        """Compiles it by `$CC`, or `cc`, to a library for `stickslip load`: at `path`, or in a folder of its own that
        goes with the library. What runs already with an older one goes on with that."""
        _, recorded = self._record()
        begin = time.perf_counter()
        code = self._write(1e-3)
        written = time.perf_counter()
        folder = "" if path is not None else tempfile.mkdtemp(prefix="stickslip-")
        file = os.path.join(folder, f"{self.name}.so") if path is None else os.fspath(path)
        code.compile(file)
        library = Library(self, os.path.abspath(file), recorded, written - begin, time.perf_counter() - written)
        if path is None:
            weakref.finalize(library, _remove, file)
        return library

    @property
    def operations(self) -> int:
        """How many operations its graph has."""
        return self._record()[0].operations

    def evaluate(self, p: Mapping[str, Any], state: dict[str, Any], signals: Mapping[str, Any], dt: Any) -> Number:
        """The torque; the new state is in `state`. Numbers of a graph go in where it is recorded."""
        given: set[str] = set()
        with Placed(self.function):
            sample = Names("sample", dict(signals))
            torque = self.function(Names("p", dict(p)), Names("state", state, given), sample, dt)
            if torque is None:
                raise NotRecordable(f"{self.name} returns nothing. Return the torque of the drive [N m].")
            missing = [name for name in self.states if name not in given]
            if missing:
                words = "Give it its value for the next sample, or make it a parameter."
                raise NotRecordable(f"state.{missing[0]} is never given. {words}")
            return number("the torque", torque)

    def controls(self, bench: Any) -> Callable[[Setpoint, Measured], float]:
        """It in the loop of a preset: compiled where there is a compiler, else over floats; the bits are the same."""
        period, limit = _stickslip.sampling_of(bench)
        if self._library is None and has_compiler():
            self._library = self.build()
        running = (self._library or self).begin(period, limit)

        def torque(reference: Setpoint, measured: Measured) -> float:
            it = (measured.time, reference.position, reference.velocity, reference.acceleration)
            return running.torque((*it, measured.angle, measured.velocity))

        return torque

    def _values(self) -> dict[str, float]:
        return {name: it.value for name, it in self.parameters.items()}

    def _record(self) -> tuple[Recording, float]:
        if self._recording is None:
            begin = time.perf_counter()
            rows = [(name, it.unit, it.help, it.minimum, it.maximum, it.value) for name, it in self.parameters.items()]
            states = [(name, "1", "", -math.inf, math.inf, value) for name, value in self.states.items()]

            def step(p: list[Number], s: list[Number], sample: list[Number], dt: Number) -> tuple[list[Number], Number]:
                state = dict(zip(self.states, s))
                torque = self.evaluate(dict(zip(self.parameters, p)), state, dict(zip(SIGNALS, sample)), dt)
                return list(state.values()), torque

            found = _stickslip.record_controller(self.name, self.help, rows, states, step)
            self._recording = found, time.perf_counter() - begin
        return self._recording

    def _write(self, sample_time: float) -> Code:
        return self._record()[0].write(sample_time)

    def __repr__(self) -> str:
        parameters = ", ".join(f"{name}={it.value!r} {it.unit}" for name, it in self.parameters.items())
        return f"ControlLaw({self.name}: {parameters or 'no parameters'}; states {', '.join(self.states) or 'none'})"


@dataclasses.dataclass(frozen=True, eq=False)
class Library:
    """A compiled controller: its file, and how long each step took [s]."""

    law: ControlLaw
    path: str
    recorded: float
    written: float
    compiled: float

    def begin(self, sample_time: float = 1e-3, torque_limit: float = 1.0, **parameters: float) -> Running:
        """Begins one more of it at rest, as `ControlLaw.begin`; any number of them run side by side."""
        return Compiled(self, sample_time, torque_limit, chosen(self.law, self.law._values(), parameters))

    def __repr__(self) -> str:
        steps = f"recorded in {self.recorded:.4f} s, written in {self.written:.4f} s, compiled in {self.compiled:.3f} s"
        return f"{self.path}: {steps}"


def controller(
    *, states: Mapping[str, float] | None = None, **parameters: Tunable
) -> Callable[[Callable[..., Any]], ControlLaw]:
    """Makes a controller of a function `law(p, state, sample, dt)` that returns the torque of the drive [N m].

    It reads parameters (`p.gain`), states (`state.integral`), a sample (`sample.reference_position`, the other fields
    of `Sample`, and `sample.torque_limit`) and the time between samples `dt` [s], and gives each state its next value.
    The function is recorded once for all samples: `stickslip.where` in place of `if` on what is measured.

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
    """Whether there is a C compiler."""
    return shutil.which(os.environ.get("CC") or "cc") is not None


def chosen(law: ControlLaw, usual: Mapping[str, float], changes: Mapping[str, float]) -> dict[str, float]:
    """Values of parameters, with changes that are checked."""
    values = dict(usual)
    for name, value in changes.items():
        if name not in law.parameters:
            raise UnknownName(f"{law.name} has no parameter {name}.{nearest(name, law.parameters)}")
        values[name] = law.parameters[name].check(name, value)
    return values


def _check(law: ControlLaw) -> None:
    """Refuses what is declared wrongly."""
    for name in [*law.parameters, *law.states]:
        if not _NAME.fullmatch(name):
            raise InvalidValue(f"{name} names no parameter and no state. Use lower-case letters, digits and _.")
    for name, it in law.parameters.items():
        if not isinstance(it, Tunable):
            raise InvalidValue(f"{name} = {it!r} says neither unit nor range. Give stickslip.Tunable({it!r}, unit, …).")
        for text in (it.unit, it.help):
            if not text.isprintable() or '"' in it.unit or "\\" in it.unit:
                raise InvalidValue(f"{text!r} cannot be unit or help of {name}. Use printable text on one line.")
        it.check(name, it.value)
    for name, value in law.states.items():
        if not math.isfinite(value):
            raise InvalidValue(f"{name} = {value} cannot be the begin of a state. Give a finite number.")
    try:
        inspect.signature(law.function).bind(*"psid")
    except TypeError:
        raise InvalidValue(f"{law.name} must take four: def {law.name}(p, state, sample, dt).") from None
    # What it becomes has functions of its own of these names.
    if not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", law.name) or law.name.lower().startswith("stickslip"):
        words = "Use def, and a name of letters, digits and _ that does not begin with stickslip."
        raise InvalidValue(f"{law.name} cannot name a controller. {words}")


def _remove(file: str) -> None:
    shutil.rmtree(os.path.dirname(file), ignore_errors=True)
