"""What the function of a controller has in its hands, and how it is refused: file, line, text, remedy."""

from __future__ import annotations

import difflib
import linecache
import os
import traceback
import types
from collections.abc import Callable, Iterable
from typing import Any

from . import _stickslip
from ._errors import NotRecordable
from ._stickslip import Number, Truth

_TAKES = (
    "Numbers of a controller take + - * /, abs, round, comparisons, & | ~ and stickslip.where, minimum, maximum, clip, "
    "sqrt, exp, log, sin, cos, floor, sign."
)
_HERE = os.path.dirname(os.path.abspath(__file__))


class Names:
    """Numbers under their names, as the function of a controller has them; those of the state can be set."""

    def __init__(self, kind: str, values: dict[str, Any], given: set[str] | None = None) -> None:
        for name, value in (("_kind", kind), ("_values", values), ("_given", given)):
            object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Any:
        if name in self._values:
            return self._values[name]
        if name.startswith("__"):
            raise AttributeError(name)
        raise NotRecordable(f"{self._kind} has no {name}.{nearest(name, self._values)}")

    def __setattr__(self, name: str, value: Any) -> None:
        if self._given is None:
            raise NotRecordable(f"{self._kind}.{name} cannot be set. What lasts is a state: controller(states=…).")
        if name not in self._values:
            words = f"States are declared: controller(states={{{name!r}: 0.0}})."
            raise NotRecordable(f"{self._kind} has no {name}.{nearest(name, self._values)} {words}")
        self._values[name] = number(f"{self._kind}.{name}", value)
        self._given.add(name)

    def __dir__(self) -> list[str]:
        return list(self._values)


def number(what: str, value: Any) -> Number:
    """The value as a number of a controller."""
    if isinstance(value, bool) or not isinstance(value, (Number, int, float)):
        kind = "condition" if isinstance(value, (bool, Truth)) else type(value).__name__
        words = "Of a condition stickslip.where(condition, 1.0, 0.0) is one."
        raise NotRecordable(f"{what} is a {kind}, not a number. {words}")
    return _stickslip.number(value)


def nearest(name: str, known: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, known, 1)
    return f" Did you mean {close[0]}?" if close else f" It has {', '.join(known) or 'nothing'}."


class Placed:
    """Whatever cannot be recorded within is refused with its place in the function of a controller."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: Any, error: BaseException | None, trace: types.TracebackType | None) -> None:
        if not isinstance(error, TypeError) or getattr(error, "line", None) is not None:
            return
        own = [it for it in traceback.extract_tb(trace) if os.path.dirname(os.path.abspath(it.filename)) != _HERE]
        code = self.function.__code__
        file, line = (own[-1].filename, own[-1].lineno) if own else (code.co_filename, _definition(code))
        words = str(error)
        if not isinstance(error, NotRecordable):
            words = f"{words}. {_TAKES}"
        source = linecache.getline(file, line or 0).strip()
        raise NotRecordable(words, file, line, source) from (None if isinstance(error, NotRecordable) else error)


def _definition(code: types.CodeType) -> int:
    """The line of `def`, behind what decorates it."""
    first = code.co_firstlineno
    behind = range(first, first + 100)
    lines = (line for line in behind if linecache.getline(code.co_filename, line).lstrip().startswith("def "))
    return next(lines, first)
