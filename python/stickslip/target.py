"""Build a library from a controller in Python and print the duration of each step."""

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
"""Start-up time of Python and the package [s]."""

_SAMPLES = 200
"""Number of samples in the comparison of library and function."""


def main(arguments: list[str] | None = None) -> int:
    """Build the controller of a file. Returns the exit code: 0, or 1 after an error."""
    parser = argparse.ArgumentParser(prog="python -m stickslip.target", description=__doc__)
    parser.add_argument("file", help="Python file with a function decorated by @stickslip.controller")
    parser.add_argument("--name", help="name of the controller, if the file has several")
    parser.add_argument("--out", help="library to write (default: NAME.so)")
    parser.add_argument("--c", metavar="FOLDER", help="also write the C project into FOLDER")
    parser.add_argument("--fmu", metavar="FILE", help="also write an FMU to FILE")
    sample_time = "sample time of self-test, example and FMU in s (default: 0.001)"
    parser.add_argument("--sample-time", type=float, default=1e-3, help=sample_time)
    options = parser.parse_args(arguments)
    try:
        _build(options)
    except (Error, OSError, SyntaxError) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def _build(options: argparse.Namespace) -> None:
    start = time.perf_counter()
    law = _law(options.file, options.name)
    read = time.perf_counter() - start
    library = law.build(options.out or f"{law.name}.so")
    built = time.perf_counter()
    _compare(law, library)
    end = time.perf_counter()
    sizes = (_counted(len(law.parameters), "parameter"), _counted(len(law.states), "state"))
    print(f"{options.file}: {law.name}, {', '.join(sizes)}, {_counted(law.operations, 'operation')}")
    stages = [("recorded", library.recorded), ("written", library.written), ("compiled", library.compiled)]
    for step, took in [("started", _STARTED), ("read", read), *stages, ("loaded", end - built)]:
        print(f"  {step:9} {took:7.3f} s")
    print(f"  {'total':9} {_STARTED + end - start:7.3f} s; {_SAMPLES} samples are bit-identical to the function")
    if options.c:
        law.generate(options.c, options.sample_time)
        print(f"C project: {options.c}")
    if options.fmu:
        law.fmu(options.fmu, options.sample_time)
        print(f"FMU: {options.fmu}")
    print(f"To run it: stickslip load {os.path.relpath(library.path)}")


def _law(file: str, name: str | None) -> ControlLaw:
    """Return the controller of a file. The file may import modules of its folder."""
    sys.path.insert(0, os.path.dirname(os.path.abspath(file)))
    laws = {it.name: it for it in runpy.run_path(file, run_name="target").values() if isinstance(it, ControlLaw)}
    if name is None and len(laws) == 1:
        return next(iter(laws.values()))
    if name in laws:
        return laws[name or ""]
    if not laws:
        raise Error(f"{file} has no controller. Decorate its function with @stickslip.controller(…).")
    raise Error(f"{file} has the controllers {', '.join(laws)}. Choose one with --name.")


def _counted(count: int, of: str) -> str:
    return f"{count} {of}" if count == 1 else f"{count} {of}s"


def _compare(law: ControlLaw, library: Library) -> None:
    """Run random samples with library and function. Raises Error where they differ."""
    both = library.begin(), law.begin()
    generator = random.Random(1)
    for count in range(_SAMPLES):
        sample = Sample(1e-3 * count, *(generator.uniform(-1.0, 1.0) for _ in range(5)))
        torques = []
        for running in both:
            try:
                torques.append(running.step(sample).hex())
            except NotComputed:
                torques.append("none")
        if torques[0] != torques[1]:
            raise Error(f"{library.path} returns {torques[0]}, but {law.name} returns {torques[1]} at sample {count}. "
                        "Set CC to another C99 compiler, such as gcc or clang.")


if __name__ == "__main__":
    sys.exit(main())
