"""What can go wrong. The words are those of the command line: what, where, both values, the remedy."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


class Error(Exception):
    """Any failure of stickslip."""


class InvalidValue(Error, ValueError):
    """A value that cannot be: outside its range, not finite, too few of them, or against a law between parameters."""


class UnknownName(Error, KeyError, AttributeError):
    """A parameter, preset or part that there is not. The message has the nearest name that there is."""

    # A KeyError would show its words in quotes.
    __str__ = Exception.__str__


class FileError(Error, OSError):
    """The operating system refused a file."""


class BenchFault(Error, RuntimeError):
    """Supervision has taken the torque away, or does not admit what was asked for."""


class NotRecordable(Error, TypeError):
    """A controller that no graph can be made of. `file`, `line` and `source` are where."""

    def __init__(self, words: str, file: str | None = None, line: int | None = None, source: str | None = None) -> None:
        super().__init__(words)
        self.file, self.line, self.source = file, line, source

    def __str__(self) -> str:
        words = super().__str__()
        return words if self.file is None else f"{self.file}:{self.line}: `{self.source}`: {words}"


class NotComputed(Error, ArithmeticError):
    """A controller that gives no finite torque, or would leave a state that is not finite."""


class Cancelled(Error):
    """The work was cancelled."""


@contextlib.contextmanager
def needing(extra: str) -> Iterator[None]:
    """Imports of what an extra of the package installs."""
    try:
        yield
    except ImportError as error:
        raise Error(f'{error}. Install what is missing with pip install "stickslip[{extra}]".') from error


for _class in (Error, InvalidValue, UnknownName, FileError, BenchFault, NotRecordable, NotComputed, Cancelled):
    _class.__module__ = "stickslip"
