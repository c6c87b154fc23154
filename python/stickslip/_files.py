"""Mappings as the text of TOML files."""

from __future__ import annotations

import json
import numbers
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np


def lines(values: Mapping[str, Any], group: str = "") -> Iterator[str]:
    """Yield the lines of the equivalent file: a dotted key and its value."""
    for name, value in values.items():
        parts = name.split(".")
        key = group + ".".join(it if re.fullmatch(r"[\w-]+", it, re.ASCII) else json.dumps(it) for it in parts)
        if isinstance(value, Mapping):
            yield from lines(value, f"{key}.")
        else:
            yield f"{key} = {_value(key, value)}"


def _value(key: str, value: Any) -> str:
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    # Check bool before numbers: in Python a bool is an int.
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, numbers.Integral):
        return str(int(value))
    if isinstance(value, numbers.Real):
        return repr(float(value))
    if isinstance(value, Iterable):
        return f"[{', '.join(_value(key, it) for it in value)}]"
    raise TypeError(f"{key} is a {type(value).__name__}. Give a number, True or False, a name, or a list of them.")
