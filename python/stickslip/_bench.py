"""The experiment in steps: measure, fit, design, render; and what is predicted of controllers."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _stickslip
from ._law import ControlLaw
from ._results import Design, Fit, FrictionCurve, Hunting, Loop, Result, Simulation
from ._signals import Signals
from ._stickslip import Measured, Parameter, Preset, Setpoint

Progress = Callable[[str, float], object]
"""Is called with the name of a stage and the part of it that is done, 0 … 1. An exception in it ends the work."""

Controller = Callable[[Setpoint, Measured], float]
"""A controller: set-point and measurement to torque of the drive [N m], once a sample."""


def measure(
    bench: Preset,
    what: str = "friction",
    *,
    plan: Mapping[str, Any] | None = None,
    thorough: bool = False,
    preload: float | None = None,
    seed: int = 1,
    progress: Progress | None = None,
) -> Result:
    """Measures on the virtual bench: homes it, presses the linings on (`preload`, 0 … 1), runs a plan.

    `what` is "friction" (at constant speeds), "breakaway", "presliding", "response", "learning" or "tracking"; `plan`
    changes values of its plan, whose names and units `plan_parameters` tells; `thorough` takes longer and tells more.
    The same `seed` gives the same numbers, those of `stickslip measure`. Of "friction" a FrictionCurve comes.

    >>> import stickslip
    >>> curve = stickslip.measure(stickslip.preset("clm-bench"), plan={"speeds": 5, "slowest": 1.0})
    >>> curve["torque"].shape, curve.units["torque"]
    ((10,), 'N m')
    """
    outcome = _stickslip.measure_on_preset(bench, what, plan, thorough, preload, seed, progress)
    made_by = f"stickslip.measure(bench, {what!r}, plan={plan}, thorough={thorough}, preload={preload}, seed={seed})"
    return FrictionCurve(outcome, made_by) if what == "friction" else Result(outcome, made_by)


def plan_parameters(what: str = "friction") -> list[Parameter]:
    """What can be said of the plan of a measurement, each with unit, range and meaning.

    >>> import stickslip
    >>> [it.unit for it in stickslip.plan_parameters("friction") if it.path == "slowest"]
    ['rad/s']
    """
    return _stickslip.plan_of(what)


def read_curves(
    path: str | os.PathLike[str],
    *,
    velocity: str | None = None,
    torque: str | None = None,
    standard_error: str | None = None,
    group: str | None = None,
) -> dict[str, Signals]:
    """Friction curves of a file (CSV, MAT, Parquet or MDF 4), a row a speed: what `fit` takes, in SI units.

    Columns are found by their names, as "omega" or "torque"; where they are not, give the names. `group` is the column
    of a number that tells several curves apart; each has its name in what comes, a single one "".
    """
    found = _stickslip.curves_of(os.fspath(path), velocity, torque, standard_error, group)
    return {name: Signals(columns) for name, columns in found}


def fit(
    velocity: ArrayLike | Signals,
    torque: ArrayLike | None = None,
    standard_error: ArrayLike | None = None,
    *,
    side: str = "both",
    linear: bool = False,
) -> Fit:
    """Fits a Stribeck curve to measured friction: a curve that was measured or read, or arrays of your own.

    Velocities [rad/s] are signed and not 0, torques [N m] have their sign; with `linear` they are m/s and N. With
    standard errors [N m] these are believed, without them the scatter tells. Points far off the curve count for little.
    `side` takes "positive" or "negative" velocities only. The numbers are those of `stickslip fit`.

    >>> import numpy as np, stickslip
    >>> velocity = np.geomspace(0.1, 50, 20)
    >>> torque = 0.2 + 0.1 * np.exp(-velocity / 2) + 0.004 * velocity
    >>> found = stickslip.fit(velocity, torque, side="positive")
    >>> {name: round(value, 6) for name, value in found.parameters.items()}
    {'breakaway_torque': 0.3, 'kinetic_torque': 0.2, 'stribeck_velocity': 2.0, 'viscous_friction': 0.004}
    """
    preload, source = None, "arrays"
    if isinstance(velocity, Signals):
        if torque is not None or standard_error is not None:
            raise TypeError("A curve has its own torques and errors: give it alone.")
        curve, source = velocity, "a curve that was read"
        if isinstance(curve, FrictionCurve):
            preload, source = curve.preload, curve.made_by
        linear = curve.units["velocity"] == "m/s"
        velocity, torque, standard_error = curve["velocity"], curve["torque"], curve.get("standard_error")
    if torque is None:
        raise TypeError("Give torques beside the velocities, or a friction curve that was measured or read.")
    force = "N" if linear else "N m"
    columns = [
        ("velocity", "m/s" if linear else "rad/s", np.asarray(velocity, float)),
        ("torque", force, np.asarray(torque, float)),
    ]
    if standard_error is not None:
        columns.append(("standard_error", force, np.asarray(standard_error, float)))
    return Fit(columns, side, linear, preload, source)


def design(bench: Preset, points: Sequence[tuple[float, float]] = (), *, acceleration: float | None = None) -> Design:
    """The desired friction, and what the load motor of a bench can do about it.

    `points` are speeds [rad/s] and torques [N m] that the curve shall go through, by least squares; what they leave open
    stays as `bench.desired` has it, and without points all does. `acceleration` [rad/s²] is how fast the drive shall
    change its speed under the rendering law. The numbers are those of `stickslip design`.

    >>> import stickslip
    >>> wanted = stickslip.design(stickslip.preset("clm-bench"), [(0.5, 0.4), (20.0, 0.3)])
    >>> wanted.preset.bench.desired.breakaway_torque > 0.3
    True
    """
    designed, outcome, renderable = _stickslip.design_for(bench, [tuple(it) for it in points], acceleration)
    return Design(outcome, f"stickslip.design(bench, {points}, acceleration={acceleration})", designed, renderable)


def render(bench: Preset, *, corrections: int = 0, seed: int = 1, progress: Progress | None = None) -> Result:
    """Renders `bench.desired` on the virtual bench, with `model.own` as its own friction, and measures it again.

    `corrections`: measure, correct the torque by what is missing, measure again, at most so many times. The data are the
    rendered friction: `velocity` [rad/s], `torque` [N m], `standard_error` [N m].
    """
    made_by = f"stickslip.render(bench, corrections={corrections}, seed={seed})"
    return Result(_stickslip.render_on(bench, corrections, seed, progress), made_by)


def demo(bench: Preset, *, seed: int = 1, progress: Progress | None = None) -> Result:
    """The whole experiment on one bench: measure, fit, design, render, measure again, as `stickslip demo` does."""
    return Result(_stickslip.demo_on(bench, seed, progress), f"stickslip.demo(bench, seed={seed})")


def loop(bench: Preset, *, speed: float = 10.0, tune: bool = False, progress: Progress | None = None) -> Loop:
    """How far the loop of a position controller is from oscillation: margins, sensitivity, bandwidth, noise.

    The load slides at `speed` [rad/s], or is stuck. With `tune` the gains are found first, as for every controller of a
    benchmark; they are in the `preset` of what comes.

    >>> import stickslip
    >>> margins = stickslip.loop(stickslip.preset("clm-bench"))
    >>> margins.summary["loop.sliding.phase_margin"] > 0
    True
    """
    tuned, outcome = _stickslip.loop_of(bench, speed, tune, progress)
    return Loop(outcome, f"stickslip.loop(bench, speed={speed}, tune={tune})", tuned)


def hunting(
    bench: Preset, *, desired: bool = False, duration: float | None = None, progress: Progress | None = None
) -> Hunting:
    """Whether a controller will hunt about a set-point that rests, predicted from what is believed of the axis.

    With `desired` on the friction that is rendered. `duration` [s] is how long the drive is followed.
    """
    cycle, outcome = _stickslip.hunting_of(bench, desired, duration, progress)
    return Hunting(outcome, f"stickslip.hunting(bench, desired={desired}, duration={duration})", cycle)


def benchmark(
    bench: Preset,
    controllers: Sequence[str] | None = None,
    *,
    frictions: Sequence[str] | None = None,
    manoeuvres: Sequence[str] | None = None,
    quick: bool = False,
    seeds: int | None = None,
    places: int | None = None,
    threads: int | None = None,
    folder: str | os.PathLike[str] | None = None,
    machine: str = "bench",
    progress: Progress | None = None,
) -> Result:
    """Which controller is the best for which friction: tuned by the same rules, run on the same machines, ranked.

    `controllers` are names as "pid+feedforward" or parameter files; without them those of the house. What there is, a
    wrong name tells. What is finished lies in `folder`, and a benchmark that goes on takes it from there. The ranks and
    measures are the `records` of its summary.
    """
    with tempfile.TemporaryDirectory() as own:
        outcome = _stickslip.benchmark_on(
            bench,
            machine,
            None if controllers is None else list(controllers),
            None if frictions is None else list(frictions),
            None if manoeuvres is None else list(manoeuvres),
            quick,
            seeds,
            places,
            threads,
            os.path.join(folder or own, "cells"),
            progress,
        )
    return Result(outcome, f"stickslip.benchmark(bench, {controllers}, quick={quick})")


def fidelity(
    presets: Sequence[str] = (),
    *,
    laws: Sequence[str] = (),
    rates: Sequence[float] = (),
    wheel: bool | None = None,
    mismatches: Sequence[str] = (),
    scenarios: Sequence[str] = (),
    quick: bool = False,
    seeds: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Result:
    """Whether a controller notices that its friction is rendered: 0 is indistinguishable, 1 as if nothing were rendered.

    `presets` are names or parameter files. What is not chosen is all that the benchmark has, which takes long; `rates`
    are in Hz. The rows are the `records` of its summary, the numbers those of `stickslip fidelity`.

    >>> import stickslip
    >>> found = stickslip.fidelity(["prototype"], laws=["paper"], rates=[4000], wheel=True,
    ...     mismatches=["perfect"], scenarios=["sine_2hz"], seeds=2)
    >>> found.summary.records[0]["difference"] < 0.2
    True
    """
    outcome = _stickslip.fidelity_of(
        list(presets),
        list(laws),
        list(rates),
        wheel,
        list(mismatches),
        list(scenarios),
        quick,
        seeds,
        threads,
        progress,
    )
    chosen = f"{presets}, laws={laws}, rates={rates}, wheel={wheel}, mismatches={mismatches}, scenarios={scenarios}"
    return Result(outcome, f"stickslip.fidelity({chosen}, quick={quick}, seeds={seeds})")


def simulate(
    bench: Preset,
    reference: str | Mapping[str, Any] | ArrayLike,
    duration: float | None = None,
    *,
    controller: Controller | ControlLaw | None = None,
    render: bool = False,
    rest: float = 0.0,
    place: float = 0.5,
    seed: int = 1,
    progress: Progress | None = None,
) -> Simulation:
    """Simulates the closed loop: what the axis truly does beside what is measured, with names and units.

    `reference` is the name of a manoeuvre of the benchmark, as "reversal"; a reference as in a parameter file, as
    `{"reference": "sine", "amplitude": 2.0, "frequency": 0.5}`; or an array of positions [rad], one for each sample of
    the controller. `duration` [s] is needed for what has no end. Before it the axis rests for `rest` [s] at 0.

    `controller` takes the place of the one of the preset, and of its compensation: a function that is called at each
    sample with set-point (`position`, `velocity`, `acceleration`) and measurement (`time`, `angle`, `velocity`), and
    returns the torque of the drive [N m]. It comes into force a sample later, as that of any controller; NaN is no
    torque. An exception in it ends the run and is raised as it is. One made by `stickslip.controller` runs compiled.

    With `render` the load motor renders `bench.desired`. `place` (0 … 1) chooses where a manoeuvre rests that rests
    somewhere. A run that the limits of supervision (`bench.safety`) end says why in `stopped`.

    >>> import stickslip
    >>> p = stickslip.preset("clm-bench")
    >>> run = stickslip.simulate(p, {"reference": "sine", "amplitude": 1.0, "frequency": 2.0}, 0.5)
    >>> run["true_angle"].shape, run.units["commanded_torque"], run.stopped
    ((500,), 'N m', None)
    >>> damped = stickslip.simulate(p, [0.1] * 500, controller=lambda r, m: 2.0 * (r.position - m.angle))
    >>> len(damped["time"])
    500
    """
    if isinstance(controller, ControlLaw):
        controller = controller.controls(bench)
    columns, stopped = _stickslip.simulate_on(
        bench, reference, duration, controller, render, rest, place, seed, progress
    )
    return Simulation(columns, stopped)
