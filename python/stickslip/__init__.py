"""The friction bench: measure, fit, design, render, measure again, rank controllers.

All numbers are SI: torques on the screw in N m, angles in rad, velocities in rad/s.
"""

from ._bench import (
    Controller,
    Progress,
    benchmark,
    demo,
    design,
    fit,
    hunting,
    loop,
    measure,
    plan_parameters,
    read_curves,
    render,
    simulate,
)
from ._errors import BenchFault, Cancelled, Error, FileError, InvalidValue, UnknownName
from ._results import Design, Fit, FrictionCurve, Hunting, Loop, Result, Simulation, Summary
from ._signals import Signals
from ._stickslip import Friction, Group, Measured, Parameter, Preset, Setpoint, __version__, preset, presets

__all__ = [
    "BenchFault",
    "Cancelled",
    "Controller",
    "Design",
    "Error",
    "FileError",
    "Fit",
    "Friction",
    "FrictionCurve",
    "Group",
    "Hunting",
    "InvalidValue",
    "Loop",
    "Measured",
    "Parameter",
    "Preset",
    "Progress",
    "Result",
    "Setpoint",
    "Signals",
    "Simulation",
    "Summary",
    "UnknownName",
    "__version__",
    "benchmark",
    "demo",
    "design",
    "fit",
    "hunting",
    "loop",
    "measure",
    "plan_parameters",
    "preset",
    "presets",
    "read_curves",
    "render",
    "simulate",
]
