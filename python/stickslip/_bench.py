"""Steps of the experiment (measure, fit, design, render) and predictions for controllers."""

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
"""Callback with the name of a stage and its completed share, 0 … 1. An exception in it ends the work."""

Controller = Callable[[Setpoint, Measured], float]
"""Controller function: called once per sample with set-point and measurement, returns the drive torque [N m]."""


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
    """Measure on the virtual bench: home the axis, set the friction wheel, run a measurement plan.

    - `what`: "friction" (at constant speeds), "breakaway", "presliding", "response", "learning" or "tracking".
    - `plan`: values that differ from the standard plan; `plan_parameters` lists their names and units.
    - `thorough`: use the thorough plan, which takes longer and gives more detail.
    - `preload`: preload of the friction wheel, 0 … 1. Default: `plant.wheel.preload` of the preset.
    - `seed`: seed of the noise. The numbers equal those of `stickslip measure` with the same seed.

    Returns a FrictionCurve for "friction", a Result for the other measurements. Raises UnknownName for another `what`,
    InvalidValue for a value outside its range, BenchFault where the supervision stops the bench.

    >>> import stickslip
    >>> curve = stickslip.measure(stickslip.preset("clm-bench"), plan={"speeds": 5, "slowest": 1.0})
    >>> curve["torque"].shape, curve.units["torque"]
    ((10,), 'N m')
    """
    outcome = _stickslip.measure_on_preset(bench, what, plan, thorough, preload, seed, progress)
    made_by = f"stickslip.measure(bench, {what!r}, plan={plan}, thorough={thorough}, preload={preload}, seed={seed})"
    return FrictionCurve(outcome, made_by) if what == "friction" else Result(outcome, made_by)


def plan_parameters(what: str = "friction") -> list[Parameter]:
    """List the parameters of a measurement plan, each with unit, range and meaning.

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
    """Read friction curves from a file (CSV, MAT, Parquet or MDF 4) with one row per speed.

    - `velocity`, `torque`, `standard_error`: names of the columns. Default: recognised names such as "omega", "torque".
    - `group`: name of a column whose number identifies the curve of each row. Default: one curve.

    Returns the curves by name, in SI units, as inputs for `fit`. The name of a single curve is "". Raises Error where a
    column is missing, FileError where the file cannot be read.
    """
    curves = _stickslip.curves_of(os.fspath(path), velocity, torque, standard_error, group)
    return {name: Signals(columns) for name, columns in curves}


def fit(
    velocity: ArrayLike | Signals,
    torque: ArrayLike | None = None,
    standard_error: ArrayLike | None = None,
    *,
    side: str = "both",
    linear: bool = False,
) -> Fit:
    """Fit a Stribeck curve to measured friction: a curve from `measure` or `read_curves`, or arrays.

    - `velocity`: signed velocities, not 0 [rad/s], or a friction curve.
    - `torque`: signed torques [N m]; only with arrays.
    - `standard_error`: standard errors of the torques [N m]. Default: estimated from the scatter of the points.
    - `side`: "both", "positive" or "negative" velocities.
    - `linear`: velocities are in m/s, torques are forces in N.

    Outliers get little weight. The numbers equal those of `stickslip fit`. Raises InvalidValue for an invalid point,
    too few points or arrays of different lengths, TypeError where torques are missing.

    >>> import numpy as np, stickslip
    >>> velocity = np.geomspace(0.1, 50, 20)
    >>> torque = 0.2 + 0.1 * np.exp(-velocity / 2) + 0.004 * velocity
    >>> fitted = stickslip.fit(velocity, torque, side="positive")
    >>> {name: round(value, 6) for name, value in fitted.parameters.items()}
    {'breakaway_torque': 0.3, 'kinetic_torque': 0.2, 'stribeck_velocity': 2.0, 'viscous_friction': 0.004}
    """
    preload, source = None, "arrays"
    if isinstance(velocity, Signals):
        if torque is not None or standard_error is not None:
            raise TypeError("Torques or errors in addition to a curve, which contains them. Pass the curve alone.")
        curve, source = velocity, "a curve from a file"
        if isinstance(curve, FrictionCurve):
            preload, source = curve.preload, curve.made_by
        linear = curve.units["velocity"] == "m/s"
        velocity, torque, standard_error = curve["velocity"], curve["torque"], curve.get("standard_error")
    if torque is None:
        raise TypeError("Missing torques. Pass velocities and torques, or a friction curve of measure or read_curves.")
    force = "N" if linear else "N m"
    columns = [
        ("velocity", "m/s" if linear else "rad/s", np.asarray(velocity, float)),
        ("torque", force, np.asarray(torque, float)),
    ]
    if standard_error is not None:
        columns.append(("standard_error", force, np.asarray(standard_error, float)))
    return Fit(columns, side, linear, preload, source)


def design(bench: Preset, points: Sequence[tuple[float, float]] = (), *, acceleration: float | None = None) -> Design:
    """Design the desired friction and check whether the load motor can render it.

    - `points`: pairs of speed [rad/s] and torque [N m], fitted by least squares. Parameters that the points do not
      determine keep their values of `bench.desired`. Default: no points, `bench.desired` is unchanged.
    - `acceleration`: largest acceleration of the drive under the rendering law [rad/s²]. Default: 200 rad/s².

    Returns the Design with the new preset. The numbers equal those of `stickslip design`.

    >>> import stickslip
    >>> desired = stickslip.design(stickslip.preset("clm-bench"), [(0.5, 0.4), (20.0, 0.3)])
    >>> desired.preset.bench.desired.breakaway_torque > 0.3
    True
    """
    designed, outcome, renderable = _stickslip.design_for(bench, [tuple(it) for it in points], acceleration)
    return Design(outcome, f"stickslip.design(bench, {points}, acceleration={acceleration})", designed, renderable)


def render(bench: Preset, *, corrections: int = 0, seed: int = 1, progress: Progress | None = None) -> Result:
    """Render `bench.desired` on the virtual bench with `model.own` as its own friction, and measure the result.

    - `corrections`: largest number of passes that correct the torque by the remaining error and measure again.
    - `seed`: seed of the noise.

    Returns the rendered friction: `velocity` [rad/s], `torque` [N m], `standard_error` [N m]. Raises an Error where the
    load motor cannot render it.
    """
    made_by = f"stickslip.render(bench, corrections={corrections}, seed={seed})"
    return Result(_stickslip.render_on(bench, corrections, seed, progress), made_by)


def demo(bench: Preset, *, seed: int = 1, progress: Progress | None = None) -> Result:
    """Run the whole experiment on one bench, as `stickslip demo`: measure, fit, design, render, measure again."""
    return Result(_stickslip.demo_on(bench, seed, progress), f"stickslip.demo(bench, seed={seed})")


def loop(bench: Preset, *, speed: float = 10.0, tune: bool = False, progress: Progress | None = None) -> Loop:
    """Compute the stability margins, sensitivity, bandwidth and noise of the position loop.

    - `speed`: speed at which the load slides [rad/s]. The results also cover the stuck load.
    - `tune`: tune the gains first, by the same rules as in a benchmark.

    Returns the Loop; its `preset` has the controller with these gains.

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
    """Predict from the model whether the controller hunts at a constant set-point.

    - `desired`: predict with the rendered friction (`bench.desired`) in place of the own friction (`model.own`).
    - `duration`: simulated time [s]. Default: 30 s.
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
    """Rank controllers on several frictions: all tuned by the same rules and run on the same machines.

    - `controllers`: names such as "pid+feedforward", or parameter files. Default: the built-in selection.
    - `frictions`, `manoeuvres`: names. Default: those of the standard benchmark.
    - `quick`: run the short benchmark.
    - `seeds`: noise seeds per manoeuvre. Default: 6, with `quick` 2.
    - `places`: set-points of manoeuvres that hold a position. Default: 12, with `quick` 4.
    - `threads`: number of threads. Default: one per processor.
    - `folder`: folder for finished cells. A repeated call with the same folder continues there.
    - `machine`: name of the bench in the report.

    Returns a Result; ranks and metrics are the `records` of its summary. Raises UnknownName for an unknown
    name; the message lists the known ones.
    """
    with tempfile.TemporaryDirectory() as temporary:
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
            os.path.join(folder or temporary, "cells"),
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
    observers: Sequence[str] = (),
    scenarios: Sequence[str] = (),
    quick: bool = False,
    seeds: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Result:
    """Compare rendered with true friction under the same controller: 0 is indistinguishable, 1 is without rendering.

    - `presets`: names or parameter files.
    - `laws`, `mismatches`, `scenarios`: names of rendering laws, model errors and scenarios.
    - `observers`: "accelerometer" or "model", a bench without accelerometer and tacho.
    - `rates`: tick rates [Hz].
    - `wheel`: with the friction wheel pressed (True) or released (False).
    - `quick`: run the short comparison.
    - `seeds`, `threads`: number of noise seeds and of threads.

    The default selection is the full benchmark, which takes long. Returns a Result; its rows are the `records` of its
    summary. The numbers equal those of `stickslip fidelity`. Raises UnknownName for an unknown name.

    >>> import stickslip
    >>> result = stickslip.fidelity(["prototype"], laws=["paper"], rates=[4000], wheel=True,
    ...     mismatches=["perfect"], scenarios=["sine_2hz"], seeds=2)
    >>> result.summary.records[0]["difference"] < 0.2
    True
    """
    outcome = _stickslip.fidelity_of(
        list(presets),
        list(laws),
        list(rates),
        wheel,
        list(mismatches),
        list(observers),
        list(scenarios),
        quick,
        seeds,
        threads,
        progress,
    )
    chosen = f"{presets}, laws={laws}, rates={rates}, wheel={wheel}, mismatches={mismatches}"
    chosen += f", observers={observers}, scenarios={scenarios}"
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
    """Simulate the closed loop and return true and measured signals with their units.

    - `reference`: name of a benchmark manoeuvre such as "reversal"; a reference as in a parameter file, such as
      `{"reference": "sine", "amplitude": 2.0, "frequency": 0.5}`; or an array of positions [rad], one per controller
      sample.
    - `duration`: simulated time [s]; required for a reference without an end.
    - `controller`: replaces controller and compensation of the preset. A function that is called at each sample with
      set-point (`position`, `velocity`, `acceleration`) and measurement (`time`, `angle`, `velocity`) and returns the
      drive torque [N m]; or a controller made by `stickslip.controller`, which runs compiled. The torque becomes active
      one sample later, as for every controller. NaN counts as 0 N m.
    - `render`: the load motor renders `bench.desired`.
    - `rest`: time at rest at position 0 before the reference starts [s].
    - `place`: 0 … 1, selects the set-point of a manoeuvre that holds a position.
    - `seed`: seed of the noise.

    Returns a Simulation. Where the supervision (`bench.safety`) ends the run, `stopped` states the reason. An exception
    of the controller ends the run and is raised unchanged. Raises InvalidValue where `duration` is missing, UnknownName
    for an unknown manoeuvre.

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
