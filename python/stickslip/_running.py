"""A controller at work, sample by sample: over floats, or as compiled library."""

from __future__ import annotations

import ctypes
import dataclasses
import math
import weakref
from typing import TYPE_CHECKING, Any

from . import _stickslip
from ._errors import InvalidValue, NotComputed

if TYPE_CHECKING:
    from ._law import ControlLaw, Library


@dataclasses.dataclass(frozen=True)
class Sample:
    """What a controller reads in a sample, as `stickslip_sample` in C.

    Time since its begin [s], the wanted angle of the screw [rad] with its derivatives [rad/s, rad/s²], its measured
    angle [rad] and the measured velocity of the motor [rad/s].
    """

    time: float = 0.0
    reference_position: float = 0.0
    reference_velocity: float = 0.0
    reference_acceleration: float = 0.0
    measured_angle: float = 0.0
    measured_velocity: float = 0.0


class Running:
    """A controller at work. It may not be used by two threads at once."""

    def __init__(self, law: ControlLaw, sample_time: float, torque_limit: float, parameters: dict[str, float]) -> None:
        self.law, self.sample_time, self.torque_limit = law, float(sample_time), float(torque_limit)
        self.parameters = parameters
        if not (math.isfinite(self.sample_time) and self.sample_time > 0.0):
            raise InvalidValue(f"sample_time = {sample_time} s is no time from sample to sample. Give seconds above 0.")
        if not (math.isfinite(self.torque_limit) and self.torque_limit >= 0.0):
            raise InvalidValue(f"torque_limit = {torque_limit} N m is no limit. Give a magnitude in N m.")

    def step(self, sample: Sample) -> float:
        """The torque of the drive [N m] after one more sample. Where it or a state would be NaN or infinite,
        NotComputed is raised, and the state is as before."""
        signals: Any = dataclasses.astuple(sample)
        return self.torque(signals)

    def set(self, **parameters: float) -> None:
        """Takes other values of its parameters, between two samples."""
        from ._law import chosen

        values = chosen(self.law, self.parameters, parameters)
        self._set(values)
        self.parameters = values

    def torque(self, signals: tuple[float, float, float, float, float, float]) -> float:
        """As `step`, with the numbers of a sample in their order."""
        raise NotImplementedError

    def _set(self, parameters: dict[str, float]) -> None:
        pass

    def _lost(self) -> NotComputed:
        words = f"{self.law.name} gives no finite torque, or leaves a state that is not finite. Guard its denominators."
        return NotComputed(words)


class Interpreted(Running):
    """Over floats, by the function itself."""

    def __init__(self, law: ControlLaw, sample_time: float, torque_limit: float, parameters: dict[str, float]) -> None:
        super().__init__(law, sample_time, torque_limit, parameters)
        self.state = dict(law.states)

    def torque(self, signals: tuple[float, float, float, float, float, float]) -> float:
        from ._law import SIGNALS

        of = _stickslip.number
        state: dict[str, Any] = {name: of(value) for name, value in self.state.items()}
        parameters = {name: of(value) for name, value in self.parameters.items()}
        given = {name: of(value) for name, value in zip(SIGNALS, (*signals, self.torque_limit))}
        torque = float(self.law.evaluate(parameters, state, given, of(self.sample_time)))
        after = {name: float(value) for name, value in state.items()}
        if not all(map(math.isfinite, (torque, *after.values()))):
            raise self._lost()
        self.state = after
        return torque


class Compiled(Running):
    """By the five functions of its library."""

    def __init__(self, library: Library, sample_time: float, torque_limit: float, parameters: dict[str, float]) -> None:
        super().__init__(library.law, sample_time, torque_limit, parameters)
        self._library = library
        self._functions = functions(library.path)
        self._controller = self._functions.stickslip_begin(self.sample_time, self.torque_limit, self._array(parameters))
        if not self._controller:
            raise InvalidValue(f"{library.path} refuses to begin with {parameters}. Are they within their ranges?")
        weakref.finalize(self, self._functions.stickslip_end, self._controller)
        self._sample, self._torque = (ctypes.c_double * 6)(), ctypes.c_double()

    def torque(self, signals: tuple[float, float, float, float, float, float]) -> float:
        self._sample[:] = list(signals)
        if self._functions.stickslip_step(self._controller, self._sample, ctypes.byref(self._torque)) != 0:
            raise self._lost()
        return self._torque.value

    def _set(self, parameters: dict[str, float]) -> None:
        if self._functions.stickslip_set(self._controller, self._array(parameters)) != 0:
            raise InvalidValue(f"{self._library.path} refuses {parameters}. Are they within their ranges?")

    def _array(self, parameters: dict[str, float]) -> Any:
        return (ctypes.c_double * max(len(parameters), 1))(*parameters.values())


def functions(path: str) -> Any:
    """The functions of a library with their types; a sample is its six numbers."""
    library = ctypes.CDLL(path)
    numbers = ctypes.POINTER(ctypes.c_double)
    for name, result, arguments in (
        ("describe", ctypes.c_void_p, []),
        ("begin", ctypes.c_void_p, [ctypes.c_double, ctypes.c_double, numbers]),
        ("set", ctypes.c_int32, [ctypes.c_void_p, numbers]),
        ("step", ctypes.c_int32, [ctypes.c_void_p, numbers, numbers]),
        ("end", None, [ctypes.c_void_p]),
    ):
        function = getattr(library, f"stickslip_{name}")
        function.restype, function.argtypes = result, arguments
    return library
