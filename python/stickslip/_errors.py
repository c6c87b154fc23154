"""Exceptions. Their messages are those of the command line: cause, place, both values, remedy."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


class Error(Exception):
    """Base class of all errors of stickslip."""


class InvalidValue(Error, ValueError):
    """Invalid value: outside its range, non-finite, too few values, or inconsistent with another parameter."""


class UnknownName(Error, KeyError, AttributeError):
    """Unknown name of a parameter, preset or other item. The message suggests the nearest known name."""

    # KeyError shows its message in quotes.
    __str__ = Exception.__str__


class FileError(Error, OSError):
    """The operating system cannot read or write a file."""


class BenchFault(Error, RuntimeError):
    """The supervision has stopped the bench, or does not permit the requested action."""


class NotRecordable(Error, TypeError):
    """A controller that cannot be recorded as a graph. `file`, `line` and `source` show the place."""

    def __init__(self, words: str, file: str | None = None, line: int | None = None, source: str | None = None) -> None:
        super().__init__(words)
        self.file, self.line, self.source = file, line, source

    def __str__(self) -> str:
        words = super().__str__()
        return words if self.file is None else f"{self.file}:{self.line}: `{self.source}`: {words}"


class NotComputed(Error, ArithmeticError):
    """A controller step with a non-finite torque or state."""


class Cancelled(Error):
    """The work was cancelled."""


@contextlib.contextmanager
def needing(extra: str) -> Iterator[None]:
    """Convert a failed import of an optional dependency into an Error that names the extra."""
    try:
        yield
    except ImportError as error:
        raise Error(f'{error}. Install it with pip install "stickslip[{extra}]".') from error


for _class in (Error, InvalidValue, UnknownName, FileError, BenchFault, NotRecordable, NotComputed, Cancelled):
    _class.__module__ = "stickslip"
