"""Arguments of a controller function, and errors in it with file, line, source and remedy."""

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

_OPERATIONS = (
    "Numbers of a controller support + - * /, abs, round, comparisons, & | ~ and stickslip.where, minimum, maximum, "
    "clip, sqrt, exp, log, sin, cos, floor, sign."
)
_PACKAGE = os.path.dirname(os.path.abspath(__file__))


class Names:
    """Named numbers as arguments of a controller function; only states can be assigned."""

    def __init__(self, kind: str, values: dict[str, Any], assigned: set[str] | None = None) -> None:
        for name, value in (("_kind", kind), ("_values", values), ("_assigned", assigned)):
            object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Any:
        if name in self._values:
            return self._values[name]
        if name.startswith("__"):
            raise AttributeError(name)
        raise NotRecordable(f"{self._kind} has no {name}.{nearest(name, self._values)}")

    def __setattr__(self, name: str, value: Any) -> None:
        if self._assigned is None:
            raise NotRecordable(f"{self._kind}.{name} cannot be set. Declare a state for it: controller(states=…).")
        if name not in self._values:
            remedy = f"Declare a new state with controller(states={{{name!r}: 0.0}})."
            raise NotRecordable(f"{self._kind} has no {name}.{nearest(name, self._values)} {remedy}")
        self._values[name] = number(f"{self._kind}.{name}", value)
        self._assigned.add(name)

    def __dir__(self) -> list[str]:
        return list(self._values)


def number(what: str, value: Any) -> Number:
    """Return the value as a number of a controller; `what` names it in the error."""
    if isinstance(value, bool) or not isinstance(value, (Number, int, float)):
        kind = "condition" if isinstance(value, (bool, Truth)) else type(value).__name__
        remedy = "Convert a condition with stickslip.where(condition, 1.0, 0.0)."
        raise NotRecordable(f"{what} is a {kind}, not a number. {remedy}")
    return _stickslip.number(value)


def nearest(name: str, names: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, names, 1)
    return f" Did you mean {close[0]}?" if close else f" Known names: {', '.join(names) or 'none'}."


class Placed:
    """Context that adds the place in the controller function to errors of recording."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: Any, error: BaseException | None, trace: types.TracebackType | None) -> None:
        if not isinstance(error, TypeError) or getattr(error, "line", None) is not None:
            return
        frames = [it for it in traceback.extract_tb(trace) if os.path.dirname(os.path.abspath(it.filename)) != _PACKAGE]
        code = self.function.__code__
        file, line = (frames[-1].filename, frames[-1].lineno) if frames else (code.co_filename, _definition(code))
        words = str(error)
        if not isinstance(error, NotRecordable):
            words = f"{words}. {_OPERATIONS}"
        source = linecache.getline(file, line or 0).strip()
        raise NotRecordable(words, file, line, source) from (None if isinstance(error, NotRecordable) else error)


def _definition(code: types.CodeType) -> int:
    """Return the line of `def`, after the decorators."""
    first = code.co_firstlineno
    candidates = range(first, first + 100)
    lines = (line for line in candidates if linecache.getline(code.co_filename, line).lstrip().startswith("def "))
    return next(lines, first)
