"""From a controller in Python to a library that runs, with the time of each step."""

from __future__ import annotations

import argparse
import os
import random
import runpy
import sys
import time

from ._errors import Error, NotComputed
from ._law import ControlLaw, Library
from ._running import Sample

_STARTED = time.process_time()
"""Time of Python and the package up to here [s]."""

_TRIED = 200
"""Samples after which library and function must still agree."""


def main(arguments: list[str] | None = None) -> int:
    """Builds the controller of a file; 1 where it is refused."""
    parser = argparse.ArgumentParser(prog="python -m stickslip.target", description=__doc__)
    parser.add_argument("file", help="Python file with a function under @stickslip.controller")
    parser.add_argument("--name", help="which one, where the file has several")
    parser.add_argument("--out", help="library to write (NAME.so)")
    parser.add_argument("--c", metavar="FOLDER", help="folder for its project in C as well")
    parser.add_argument("--fmu", metavar="FILE", help="FMU to write as well")
    parser.add_argument("--sample-time", type=float, default=1e-3, help="of self-test, example and FMU, in s (0.001)")
    chosen = parser.parse_args(arguments)
    try:
        _build(chosen)
    except (Error, OSError, SyntaxError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _build(chosen: argparse.Namespace) -> None:
    begin = time.perf_counter()
    law = _law(chosen.file, chosen.name)
    read = time.perf_counter() - begin
    library = law.build(chosen.out or f"{law.name}.so")
    tried = time.perf_counter()
    _try(law, library)
    end = time.perf_counter()
    sizes = (_counted(len(law.parameters), "parameter"), _counted(len(law.states), "state"))
    print(f"{chosen.file}: {law.name}, {', '.join(sizes)}, {_counted(law.operations, 'operation')}")
    made = [("recorded", library.recorded), ("written", library.written), ("compiled", library.compiled)]
    for step, took in [("started", _STARTED), ("read", read), *made, ("loaded", end - tried)]:
        print(f"  {step:9} {took:7.3f} s")
    print(f"  {'in all':9} {_STARTED + end - begin:7.3f} s; {_TRIED} samples have the bits of the function")
    if chosen.c:
        law.generate(chosen.c, chosen.sample_time)
        print(f"Its project in C: {chosen.c}")
    if chosen.fmu:
        law.fmu(chosen.fmu, chosen.sample_time)
        print(f"Its FMU: {chosen.fmu}")
    print(f"To run it: stickslip load {os.path.relpath(library.path)}")


def _law(file: str, name: str | None) -> ControlLaw:
    """The controller of a file, which may import what lies beside it."""
    sys.path.insert(0, os.path.dirname(os.path.abspath(file)))
    found = {it.name: it for it in runpy.run_path(file, run_name="target").values() if isinstance(it, ControlLaw)}
    if name is None and len(found) == 1:
        return next(iter(found.values()))
    if name in found:
        return found[name or ""]
    if not found:
        raise Error(f"{file} has no controller. Put @stickslip.controller(…) over its function.")
    raise Error(f"{file} has {', '.join(found)}. Say which by --name.")


def _counted(count: int, of: str) -> str:
    return f"{count} {of}" if count == 1 else f"{count} {of}s"


def _try(law: ControlLaw, library: Library) -> None:
    """Takes samples with library and function side by side; an Error where they differ."""
    both = library.begin(), law.begin()
    dice = random.Random(1)
    for count in range(_TRIED):
        sample = Sample(1e-3 * count, *(dice.uniform(-1.0, 1.0) for _ in range(5)))
        torques = []
        for running in both:
            try:
                torques.append(running.step(sample).hex())
            except NotComputed:
                torques.append("none")
        if torques[0] != torques[1]:
            raise Error(f"{library.path} gives {torques[0]} where {law.name} gives {torques[1]}, at sample {count}. "
                        "Take another compiler by the variable CC, such as gcc or clang.")


if __name__ == "__main__":
    sys.exit(main())
