"""Running controllers, sample by sample: in Python or as compiled library."""

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
    """Inputs of a controller in a sample, as `stickslip_sample` in C.

    Time since the start [s], set-point of the screw angle [rad] with its derivatives [rad/s, rad/s²], measured screw
    angle [rad] and measured motor velocity [rad/s].
    """

    time: float = 0.0
    reference_position: float = 0.0
    reference_velocity: float = 0.0
    reference_acceleration: float = 0.0
    measured_angle: float = 0.0
    measured_velocity: float = 0.0


class Running:
    """A running controller. Do not use it in two threads at the same time."""

    def __init__(self, law: ControlLaw, sample_time: float, torque_limit: float, parameters: dict[str, float]) -> None:
        self.law, self.sample_time, self.torque_limit = law, float(sample_time), float(torque_limit)
        self.parameters = parameters
        if not (math.isfinite(self.sample_time) and self.sample_time > 0.0):
            raise InvalidValue(f"sample_time = {sample_time} s is not a positive, finite time. Give seconds above 0.")
        if not (math.isfinite(self.torque_limit) and self.torque_limit >= 0.0):
            raise InvalidValue(f"torque_limit = {torque_limit} N m is negative or not finite. Give a magnitude in N m.")

    def step(self, sample: Sample) -> float:
        """Run one sample and return the drive torque [N m].

        Raises NotComputed where the torque or a state would be NaN or infinite; the state is then unchanged.
        """
        signals: Any = dataclasses.astuple(sample)
        return self.torque(signals)

    def set(self, **parameters: float) -> None:
        """Change parameters between two samples. Raises UnknownName or InvalidValue."""
        from ._law import chosen

        values = chosen(self.law, self.parameters, parameters)
        self._set(values)
        self.parameters = values

    def torque(self, signals: tuple[float, float, float, float, float, float]) -> float:
        """Run one sample, as `step`, with the fields of a Sample as a tuple."""
        raise NotImplementedError

    def _set(self, parameters: dict[str, float]) -> None:
        pass

    def _not_computed(self) -> NotComputed:
        return NotComputed(f"{self.law.name} computes a non-finite torque or state. Guard its denominators.")


class Interpreted(Running):
    """A controller run by its Python function."""

    def __init__(self, law: ControlLaw, sample_time: float, torque_limit: float, parameters: dict[str, float]) -> None:
        super().__init__(law, sample_time, torque_limit, parameters)
        self.state = dict(law.states)

    def torque(self, signals: tuple[float, float, float, float, float, float]) -> float:
        from ._law import SIGNALS

        number = _stickslip.number
        state: dict[str, Any] = {name: number(value) for name, value in self.state.items()}
        parameters = {name: number(value) for name, value in self.parameters.items()}
        inputs = {name: number(value) for name, value in zip(SIGNALS, (*signals, self.torque_limit))}
        torque = float(self.law.evaluate(parameters, state, inputs, number(self.sample_time)))
        next_state = {name: float(value) for name, value in state.items()}
        if not all(map(math.isfinite, (torque, *next_state.values()))):
            raise self._not_computed()
        self.state = next_state
        return torque


class Compiled(Running):
    """A controller run by the five functions of its library."""

    def __init__(self, library: Library, sample_time: float, torque_limit: float, parameters: dict[str, float]) -> None:
        super().__init__(library.law, sample_time, torque_limit, parameters)
        self._library = library
        self._functions = functions(library.path)
        self._controller = self._functions.stickslip_begin(self.sample_time, self.torque_limit, self._array(parameters))
        if not self._controller:
            raise InvalidValue(f"{library.path} rejects the parameters {parameters}. Check their ranges.")
        weakref.finalize(self, self._functions.stickslip_end, self._controller)
        self._sample, self._torque = (ctypes.c_double * 6)(), ctypes.c_double()

    def torque(self, signals: tuple[float, float, float, float, float, float]) -> float:
        self._sample[:] = list(signals)
        if self._functions.stickslip_step(self._controller, self._sample, ctypes.byref(self._torque)) != 0:
            raise self._not_computed()
        return self._torque.value

    def _set(self, parameters: dict[str, float]) -> None:
        if self._functions.stickslip_set(self._controller, self._array(parameters)) != 0:
            raise InvalidValue(f"{self._library.path} rejects the parameters {parameters}. Check their ranges.")

    def _array(self, parameters: dict[str, float]) -> Any:
        return (ctypes.c_double * max(len(parameters), 1))(*parameters.values())


def functions(path: str) -> Any:
    """Return the functions of a library with their types; a sample is an array of six numbers."""
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
