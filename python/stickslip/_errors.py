"""What can go wrong. The words are those of the command line: what, where, both values, the remedy."""


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


class Cancelled(Error):
    """The work was cancelled."""


for _class in (Error, InvalidValue, UnknownName, FileError, BenchFault, Cancelled):
    _class.__module__ = "stickslip"
