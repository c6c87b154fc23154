"""
The compiled part of stickslip.
"""

from _typeshed import SupportsGetItem, SupportsLenAndGetItem
from numpy import float64
from numpy.typing import ArrayLike, NDArray
from os import PathLike
from typing import Any, Final, SupportsFloat, SupportsIndex, final

__all__ = ["__version__", "Code", "Friction", "Group", "IdentifiedFriction", "Measured", "Number", "Outcome", "Parameter", "Preset", "Recording", "Setpoint", "StribeckFit", "StudyParts", "StudyWork", "Truth", "_friction", "_restored", "benchmark_on", "clip", "cos", "curves_of", "demo_on", "design_for", "exp", "fidelity_of", "fit_points", "floor", "friction_library", "hunting_of", "identified_friction", "log", "loop_of", "maximum", "measure_on_preset", "minimum", "number", "open_study", "plan_of", "preset", "presets", "record_controller", "render_on", "sampling_of", "sign", "simulate_on", "sin", "sqrt", "where"]

__version__: Final[str]
"""
Version of the package.
"""

@final
class Code:
    """
    A controller as C.
    """
    def compile(self, /, path: str | PathLike[str]) -> None:
        """
        Compiles the library, which takes the place of what is at `path` as a whole.
        """
    def fmu(self, /, path: str | PathLike[str], version: SupportsIndex) -> None:
        """
        Writes the FMU of it, FMI 2 or 3.
        """
    def generate(self, /, folder: str | PathLike[str], diagram: bool) -> None:
        """
        Writes the project into a folder.
        """
    @property
    def sources(self, /) -> list[tuple[str, str]]:
        """
        Name and text of what the library is compiled of.
        """

@final
class Friction:
    """
    A friction model: static, Dahl, LuGre, elasto-plastic or Maxwell slip, with what it depends on.

    `values` has the same names as the friction of a parameter file (`stickslip params describe plant.screw_friction`);
    what is not given has its default.

    >>> import numpy as np, stickslip
    >>> lugre = stickslip.Friction({"model.kind": "lugre", "model.sliding.kinetic_torque": 0.2})
    >>> lugre.steady(np.array([-10.0, 10.0])).round(3).tolist()
    [-0.206, 0.206]
    """
    def __eq__(self, other: object, /) -> bool: ...
    def __new__(cls, /, values: Any) -> Friction: ...
    def __reduce__(self, /) -> "tuple[object, ...]": ...
    def __repr__(self, /) -> str: ...
    def course(self, /, velocity: ArrayLike, dt: SupportsFloat | SupportsIndex, *, angle: ArrayLike | None = None, load: ArrayLike | None = None, arrest: ArrayLike | None = None, deflection: SupportsFloat | SupportsIndex = 0.0) -> tuple[NDArray[float64], NDArray[float64]]:
        """
        Friction torque over a course of velocities: presliding, breakaway and sliding.

        `velocity` [rad/s] has one value a step, held over it, and `dt` [s] is the length of a step; a course of the
        velocities in the middle of each step is of second order. `angle` [rad] and `load` [N m] are arrays of the same
        length where friction depends on them, `deflection` [rad] is what the bristles or elements begin with. `arrest` [N m] is the
        torque that would bring the load to rest within a step: static friction, which has no bristles, takes up that much at
        velocity 0, and nothing without it.

        Returns two arrays: the mean torque of each step [N m], against positive motion, and the deflection at its end [rad].

        >>> import numpy as np, stickslip
        >>> screw = stickslip.preset("prototype").friction("plant.wheel.friction")
        >>> time = np.arange(0, 1, 1e-4)
        >>> torque, deflection = screw.course(0.01 * np.cos(2 * np.pi * time), 1e-4)
        >>> torque.shape == time.shape
        True
        """
    def steady(self, /, velocity: ArrayLike, *, angle: SupportsFloat | SupportsIndex = 0.0, load: SupportsFloat | SupportsIndex = 0.0) -> Any:
        """
        Friction torque [N m] at constant velocities [rad/s], against positive motion: what a measurement at constant
        speed sees. An array of any shape gives one of the same shape, a number gives a number.

        `angle` [rad] and `load` [N m] are where friction depends on them.

        >>> import numpy as np, stickslip
        >>> wheel = stickslip.preset("prototype").friction("plant.wheel.friction")
        >>> wheel.steady(np.linspace(-5, 5, 100)).shape
        (100,)
        """

@final
class Group:
    """
    Parameters that belong together, as `p.model.own`: read by attribute or by path, like the preset that they are of.

    >>> import stickslip
    >>> own = stickslip.preset("prototype").model.own
    >>> print(own.describe("kinetic_torque").unit)
    N m
    """
    def __contains__(self, path: str, /) -> bool: ...
    def __dir__(self, /) -> list[str]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __getattr__(self, name: str, /) -> Any: ...
    def __getitem__(self, path: str, /) -> Any:
        """
        What lies at a dotted path below: a value, a list, or a group.
        """
    def __iter__(self, /) -> Any: ...
    def __len__(self, /) -> int: ...
    def __reduce__(self, /) -> "tuple[object, ...]": ...
    def __repr__(self, /) -> str: ...
    def describe(self, /, path: str) -> Parameter:
        """
        What is known of the parameter at a path from here: unit, range, default, meaning.
        """
    def keys(self, /) -> list[str]:
        """
        The paths of all values below, from here.
        """
    def to_dict(self, /) -> "dict[str, float | int | bool | str]":
        """
        All values under their paths from here.
        """

@final
class IdentifiedFriction:
    """
    Friction that was identified on a real machine: where it comes from, its numbers, and how far they go.
    """
    def __repr__(self, /) -> str: ...
    @property
    def friction(self, /) -> Friction:
        """
        The friction model.
        """
    @property
    def inertia(self, /) -> float | None:
        """
        Inertia that it was identified with [kg m²]; None where that is not known.
        """
    @property
    def licence(self, /) -> str:
        """
        On what terms it may be used.
        """
    @property
    def name(self, /) -> str:
        """
        Its name, or the file that it comes from.
        """
    def on(self, /, bench: Preset, role: str = "desired") -> Preset:
        """
        A bench of which this is the friction: as `role` "desired" what the load motor shall render, as "own" what the
        machine has and believes that it has, the friction wheel lifted off.

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> q = stickslip.identified_friction("dc-servo").on(p)
        >>> q.bench.desired == p.bench.desired
        False
        """
    @property
    def remarks(self, /) -> list[str]:
        """
        What it cannot represent, what its source does not tell, and the step that follows it.
        """
    def scaled(self, /, factor: SupportsFloat | SupportsIndex) -> IdentifiedFriction:
        """
        The same motion on a machine of another size: all torques and the inertia multiplied.
        """
    @property
    def source(self, /) -> str:
        """
        Who measured and identified it, and how.
        """
    @property
    def speeds(self, /) -> tuple[float, float] | None:
        """
        Lowest and highest speed at which something was measured [rad/s]; None where that is not known.
        """
    @property
    def standard_deviations(self, /) -> dict[str, float]:
        """
        Standard deviations of its parameters by their paths, in their units; those that the source tells.
        """
    @property
    def title(self, /) -> str:
        """
        What it is, in a line.
        """
    def torque(self, /, velocity: ArrayLike) -> tuple[NDArray[float64], NDArray[float64]]:
        """
        Friction torque [N m] at constant velocities [rad/s] and its standard deviation [N m], as far as the source tells
        deviations; as if they were independent.

        >>> import stickslip
        >>> torque, deviation = stickslip.identified_friction("emps").torque([1.0, 10.0])
        >>> torque.shape, bool((deviation > 0).all())
        ((2,), True)
        """

@final
class Measured:
    """
    What a controller measures at a sample.
    """
    def __repr__(self, /) -> str: ...
    @property
    def angle(self, /) -> float:
        """
        Angle of the screw by the encoder, unwrapped [rad].
        """
    @property
    def time(self, /) -> float:
        """
        Time since the begin of the run [s].
        """
    @property
    def velocity(self, /) -> float:
        """
        Velocity of the motor by the tacho [rad/s].
        """

@final
class Number:
    """
    A number of a controller: a float while it runs, all that it may be while it is recorded.

    It takes `+ - * /`, `abs`, `round`, comparisons and the functions of stickslip; `float` gives its value while it
    runs.
    """
    __array_ufunc__: Final[bool | None]
    """
    NumPy leaves arithmetic with its numbers to this class, and takes it into none of its functions.
    """
    def __abs__(self, /) -> Number: ...
    def __add__(self, other: object, /) -> Number: ...
    def __bool__(self, /) -> bool: ...
    def __eq__(self, other: object, /) -> Any: ...
    def __float__(self, /) -> float: ...
    def __format__(self, /, format: str) -> str: ...
    def __ge__(self, other: object, /) -> Any: ...
    def __gt__(self, other: object, /) -> Any: ...
    def __le__(self, other: object, /) -> Any: ...
    def __lt__(self, other: object, /) -> Any: ...
    def __mul__(self, other: object, /) -> Number: ...
    def __ne__(self, other: object, /) -> Any: ...
    def __neg__(self, /) -> Number: ...
    def __pos__(self, /) -> Number: ...
    def __radd__(self, other: object, /) -> Number: ...
    def __repr__(self, /) -> str: ...
    def __rmul__(self, other: object, /) -> Number: ...
    def __round__(self, /, digits: SupportsIndex | None = None) -> Number: ...
    def __rsub__(self, other: object, /) -> Number: ...
    def __rtruediv__(self, other: object, /) -> Number: ...
    def __sub__(self, other: object, /) -> Number: ...
    def __truediv__(self, other: object, /) -> Number: ...

@final
class Outcome:
    """
    What came of a piece of work.
    """
    def columns(self, /) -> list[tuple[str, str, NDArray[float64]]]:
        """
        The data: name, unit and values of each column.
        """
    def html(self, /, command: str) -> str:
        """
        The report as one page of HTML; `command` is what it was made by.
        """
    def lines(self, /) -> list[str]:
        """
        What the terminal shows.
        """
    def remarks(self, /) -> list[str]:
        """
        What a reader should know, each with a remedy.
        """
    def summary(self, /) -> str:
        """
        The text of `summary.json`.
        """
    def write(self, /, folder: str | PathLike[str], command: str) -> str:
        """
        Writes report, data and `summary.json` into a folder; returns the text of the summary.
        """

@final
class Parameter:
    """
    What is known of a parameter: unit, range, default and meaning.

    `str()` of it is what `stickslip params describe` prints.
    """
    def __repr__(self, /) -> str: ...
    def __str__(self, /) -> str: ...
    @property
    def default(self, /) -> float | None:
        """
        Value unless given, in the unit; None for a choice.
        """
    @property
    def help(self, /) -> str:
        """
        What it means.
        """
    @property
    def kind(self, /) -> str:
        """
        "real", "whole", "flag" or "choice".
        """
    @property
    def maximum(self, /) -> float | None:
        """
        Largest allowed value, in the unit; None for a choice.
        """
    @property
    def minimum(self, /) -> float | None:
        """
        Smallest allowed value, in the unit; None for a choice.
        """
    @property
    def only_with(self, /) -> str | None:
        """
        The choice that must be made for it to exist, as `friction.model = "lugre"`; None where it always exists.
        """
    @property
    def path(self, /) -> str:
        """
        Dotted path.
        """
    @property
    def symbol(self, /) -> str:
        """
        As in an equation; empty where there is none.
        """
    @property
    def unit(self, /) -> str:
        """
        SI unit; "1" for a pure number, empty for a choice.
        """
    @property
    def variants(self, /) -> dict[str, str]:
        """
        What there is to choose from, each with its meaning; empty for a number.
        """

@final
class Preset:
    """
    The parameters of a bench: the virtual machine (`plant`), what the software believes of it (`model`), how it runs
    (`bench`).

    Values are read by attribute or by path, all in SI units. A preset never changes: `set` returns another.

    >>> import stickslip
    >>> p = stickslip.preset("prototype")
    >>> p["model.own.breakaway_torque"] == p.model.own.breakaway_torque
    True
    >>> stiff = p.set({"bench.tick_rate": 8000})
    >>> stiff.bench.tick_rate, p.bench.tick_rate
    (8000.0, 4000.0)
    """
    def __contains__(self, path: str, /) -> bool: ...
    def __copy__(self, /) -> Preset: ...
    def __deepcopy__(self, /, _memo: Any) -> Preset: ...
    def __dir__(self, /) -> list[str]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __getattr__(self, name: str, /) -> Any: ...
    def __getitem__(self, path: str, /) -> Any:
        """
        What lies at a dotted path: a value, a list, or a group.
        """
    def __hash__(self, /) -> int: ...
    def __iter__(self, /) -> Any: ...
    def __len__(self, /) -> int: ...
    def __reduce__(self, /) -> "tuple[object, ...]": ...
    def __repr__(self, /) -> str: ...
    def __str__(self, /) -> str: ...
    def describe(self, /, path: str) -> Parameter:
        """
        What is known of the parameter at a path: unit, range, default, meaning.

        >>> import stickslip
        >>> print(stickslip.preset("prototype").describe("bench.tick_rate"))
        bench.tick_rate
            f_tick [Hz], 500 … 20000, default 4000
            Rate of sensors, observer, rendering law and load-motor current control.
        """
    def descriptions(self, /, path: str = "") -> list[Parameter]:
        """
        What is known of each parameter at or below a path; without a path, of all. One that several variants of a
        choice have stands once for each.

        >>> import stickslip
        >>> [it.symbol for it in stickslip.preset("prototype").descriptions("model.own")][:2]
        ['M_S', 'M_K']
        """
    def diff(self, /, other: Preset) -> "list[tuple[str, float | int | bool | str | None, float | int | bool | str | None]]":
        """
        What is not the same in another preset: path, value here, value there; None where a preset has no such value.

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> p.diff(p.set({"bench.tick_rate": 8000}))
        [('bench.tick_rate', 4000.0, 8000.0)]
        """
    def friction(self, /, path: str) -> Friction:
        """
        The friction at a path: of the virtual machine (`plant.screw_friction`), or a curve (`model.own`).

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> p.friction("model.own").steady(1e-6) > 0.9 * p.model.own.breakaway_torque
        True
        """
    def keys(self, /) -> list[str]:
        """
        The paths of all values, in the order of a parameter file.
        """
    def set(self, /, values: Any) -> Preset:
        """
        This preset with other values.

        `values` has paths and values; a mapping as value stands for all that lies below its path, and a group of a preset
        is taken over as a whole. All are checked together: names, types, ranges, laws between parameters.

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> q = p.set({"model.own": {"breakaway_torque": 0.4, "kinetic_torque": 0.2}, "bench.desired": p.model.own})
        >>> q.model.own.breakaway_torque
        0.4
        >>> p.set({"bench.tick_rate": -1})
        Traceback (most recent call last):
        stickslip.InvalidValue: bench.tick_rate = -1 Hz is outside 500 … 20000 Hz (presets/prototype.toml:...
        """
    def to_dict(self, /) -> "dict[str, float | int | bool | str]":
        """
        All values under their paths.

        >>> import stickslip
        >>> stickslip.preset("prototype").to_dict()["bench.tick_rate"]
        4000.0
        """
    def toml(self, /, *, complete: bool = False) -> str:
        """
        The text of a parameter file. As it was read and changed; with `complete`, every parameter with its unit, range
        and meaning as comments.

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> stickslip.preset(text=p.toml(complete=True)) == p
        True
        """

@final
class Recording:
    """
    The graph of a controller.
    """
    @property
    def operations(self, /) -> int:
        """
        How many operations it has.
        """
    def write(self, /, sample_time: SupportsFloat | SupportsIndex) -> Code:
        """
        Writes it as C, with self-test and example for samples of `sample_time` [s].
        """

@final
class Setpoint:
    """
    What a controller shall follow, as it stands at a sample.
    """
    def __repr__(self, /) -> str: ...
    @property
    def acceleration(self, /) -> float:
        """
        Its second derivative [rad/s²].
        """
    @property
    def position(self, /) -> float:
        """
        Screw angle [rad].
        """
    @property
    def velocity(self, /) -> float:
        """
        Its first derivative [rad/s].
        """

@final
class StribeckFit:
    """
    A Stribeck curve through points.
    """
    def at(self, /, velocity: ArrayLike) -> tuple[NDArray[float64], NDArray[float64]]:
        """
        The curve at velocities, and half the width of its 95 % band there.
        """
    @property
    def chi_square(self, /) -> float:
        """
        Weighted sum of their squares.
        """
    @property
    def covariance(self, /) -> NDArray[float64]:
        """
        Covariance of the parameters, in the order of `parameters`.
        """
    @property
    def degrees_of_freedom(self, /) -> int:
        """
        Points less parameters.
        """
    def fragment(self, /) -> str:
        """
        The own friction as a part of a parameter file.
        """
    @property
    def intervals(self, /) -> dict[str, tuple[float, float]]:
        """
        Ends of their 95 % intervals.
        """
    @property
    def known(self, /) -> dict[str, bool]:
        """
        Whether the points tell each of them.
        """
    @property
    def lack_of_fit(self, /) -> float:
        """
        How far the form of the curve is from the friction that was measured, as a standard deviation.
        """
    def outcome(self, /) -> Outcome:
        """
        Numbers, remarks and report.
        """
    @property
    def parameters(self, /) -> dict[str, float]:
        """
        Values of the parameters.
        """
    @property
    def residuals(self, /) -> NDArray[float64]:
        """
        Measured less fitted, positive away from zero, in the order of the points that count.
        """
    @property
    def rms(self, /) -> float:
        """
        Root mean square of the residuals.
        """
    @property
    def standard_errors(self, /) -> dict[str, float]:
        """
        Their standard errors; infinite where the points do not tell a parameter.
        """

@final
class StudyParts:
    """
    A study in its folder.
    """
    def finish(self, /) -> tuple[Outcome, list[tuple[str, str, NDArray[float64]]], dict[int, str], list[str], list[NDArray[float64]] | None, int]:
        """
        Makes the file of the study, and what it tells.
        """
    def missing(self, /) -> list[tuple[int, int]]:
        """
        The parts that were missing when it was opened, and the cases of each.
        """
    def put(self, /, index: SupportsIndex, bytes: bytes) -> None:
        """
        Takes the bytes of a part that was run elsewhere.
        """
    def run(self, /, threads: SupportsIndex | None, progress: Any | None) -> None:
        """
        Runs them here, on as many threads as there are processors unless it is said how many.
        """
    def work(self, /) -> str:
        """
        What it takes to run them, as a text.
        """

@final
class StudyWork:
    """
    What it takes to run the parts of a study, wherever.
    """
    def __new__(cls, /, text: str) -> StudyWork:
        """
        From its text, if it is of this version.
        """
    def part(self, /, index: SupportsIndex) -> bytes:
        """
        The bytes of a part, run on one thread.
        """

@final
class Truth:
    """
    Whether something holds: `True` or `False` while a controller runs, open while it is recorded.

    `& | ~` join conditions; `stickslip.where` chooses by them.
    """
    def __and__(self, other: object, /) -> Truth: ...
    def __bool__(self, /) -> bool: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __ge__(self, other: object, /) -> bool: ...
    def __gt__(self, other: object, /) -> bool: ...
    def __invert__(self, /) -> Truth: ...
    def __le__(self, other: object, /) -> bool: ...
    def __lt__(self, other: object, /) -> bool: ...
    def __ne__(self, other: object, /) -> bool: ...
    def __or__(self, other: object, /) -> Truth: ...
    def __rand__(self, other: object, /) -> Truth: ...
    def __repr__(self, /) -> str: ...
    def __ror__(self, other: object, /) -> Truth: ...

def _friction(text: str) -> Friction:
    """
    A friction from its text: what a pickle calls.
    """

def _restored(text: str, file: str) -> Preset:
    """
    A preset from its text, which messages call `file`: what a pickle calls.
    """

def benchmark_on(preset: Preset, machine: str, controllers: SupportsGetItem[int, str] | None, frictions: SupportsGetItem[int, str] | None, manoeuvres: SupportsGetItem[int, str] | None, quick: bool, seeds: SupportsIndex | None, places: SupportsIndex | None, threads: SupportsIndex | None, folder: str | PathLike[str], progress: Any | None) -> Outcome:
    """
    Runs controllers on frictions and manoeuvres; what is finished lies in the folder, and is taken from there.
    """

def clip(x: SupportsFloat, low: SupportsFloat, high: SupportsFloat) -> Number:
    """
    Limited to `low` … `high`; a NaN stays NaN.

    >>> import stickslip
    >>> stickslip.clip(5.0, -1.0, 1.0)
    1.0
    """

def cos(x: SupportsFloat) -> Number:
    """
    Cosine, within 2 units in the last place up to 1e6 rad.

    >>> import stickslip
    >>> stickslip.cos(0.0)
    1.0
    """

def curves_of(path: str | PathLike[str], velocity: str | None, torque: str | None, standard_error: str | None, group: str | None) -> list[tuple[str, list[tuple[str, str, NDArray[float64]]]]]:
    """
    Reads friction curves of a file: name and columns of each.
    """

def demo_on(preset: Preset, seed: SupportsIndex, progress: Any | None) -> Outcome:
    """
    The whole experiment: measure, fit, design, render, measure again.
    """

def design_for(preset: Preset, points: SupportsGetItem[int, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]], acceleration: SupportsFloat | SupportsIndex | None) -> tuple[Preset, Outcome, bool]:
    """
    The desired friction through reference points, what the load motor can do about it, and the preset with it.
    """

def exp(x: SupportsFloat) -> Number:
    """
    Exponential, within 2 units in the last place; 0 in place of a subnormal number.

    >>> import stickslip
    >>> stickslip.exp(0.0)
    1.0
    """

def fidelity_of(presets: SupportsGetItem[int, str], laws: SupportsGetItem[int, str], rates: SupportsGetItem[int, SupportsFloat | SupportsIndex], wheel: bool | None, mismatches: SupportsGetItem[int, str], scenarios: SupportsGetItem[int, str], quick: bool, seeds: SupportsIndex | None, threads: SupportsIndex | None, progress: Any | None) -> Outcome:
    """
    Compares what is rendered with what is truly there.
    """

def fit_points(velocity: ArrayLike, torque: ArrayLike, standard_error: ArrayLike | None, side: str, linear: bool, preload: SupportsFloat | SupportsIndex | None, source: str) -> StribeckFit:
    """
    Fits points: velocities, torques or forces, and their standard errors where they are known.
    """

def floor(x: SupportsFloat) -> Number:
    """
    Largest whole number not above.

    >>> import stickslip
    >>> stickslip.floor(-0.5)
    -1.0
    """

def friction_library() -> "dict[str, str]":
    """
    The frictions of the library: name, and what each is.

    >>> import stickslip
    >>> "emps" in stickslip.friction_library()
    True
    """

def hunting_of(preset: Preset, desired: bool, duration: SupportsFloat | SupportsIndex | None, progress: Any | None) -> tuple[tuple[float, float] | None, Outcome]:
    """
    Whether the controller of a preset hunts, over a duration [s].
    """

def identified_friction(source: str) -> IdentifiedFriction:
    """
    The friction of the library of that name, or of a file like those of `data/friction`.

    >>> import stickslip
    >>> servo = stickslip.identified_friction("dc-servo")
    >>> servo.friction.steady(1.0) > 0.0
    True
    """

def log(x: SupportsFloat) -> Number:
    """
    Natural logarithm of a normal positive number, within 2 units in the last place; of others not defined.

    >>> import stickslip
    >>> stickslip.log(1.0)
    0.0
    """

def loop_of(preset: Preset, speed: SupportsFloat | SupportsIndex, tune: bool, progress: Any | None) -> tuple[Preset, Outcome]:
    """
    The loop of the position controller of a preset, at a speed [rad/s] at which the load slides; with the gains that
    are in it, or tuned. Returns the preset with that controller as well.
    """

def maximum(a: SupportsFloat, b: SupportsFloat) -> Number:
    """
    The larger; the second if either is NaN.

    >>> import stickslip
    >>> stickslip.maximum(2.0, 1.0)
    2.0
    """

def measure_on_preset(preset: Preset, kind: str, plan: Any | None, thorough: bool, preload: SupportsFloat | SupportsIndex | None, seed: SupportsIndex, progress: Any | None) -> Outcome:
    """
    Runs a measurement on the virtual bench of a preset.
    """

def minimum(a: SupportsFloat, b: SupportsFloat) -> Number:
    """
    The smaller; the second if either is NaN.

    >>> import stickslip
    >>> stickslip.minimum(2.0, 1.0)
    1.0
    """

def number(value: SupportsFloat) -> Number:
    """
    As a number of a controller.
    """

def open_study(file: str | PathLike[str] | None, text: str, preset: Preset | None, folder: str | PathLike[str], progress: Any | None) -> StudyParts:
    """
    Opens the study of a file, or of a text that a program made, on a preset instead of the one that the text names.
    """

def plan_of(kind: str) -> list[Parameter]:
    """
    What can be said of the plan of a measurement: its parameters.
    """

def preset(source: str | None = None, *, text: str | None = None) -> Preset:
    """
    The preset of a name, or of a parameter file.

    `source` is a name that `presets()` lists or the path of a file; or else `text` is the text of a file (TOML).

    >>> import stickslip
    >>> stickslip.preset("clm-bench").bench.tick_rate
    4000.0
    >>> stickslip.preset(text="[model.own]\\nkinetic_torque = 0.2").model.own.kinetic_torque
    0.2
    """

def presets() -> dict[str, str]:
    """
    The presets that come along: name, and what each is.

    >>> import stickslip
    >>> "prototype" in stickslip.presets()
    True
    """

def record_controller(name: str, help: str, parameters: SupportsGetItem[int, tuple[str, str, str, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]], state: SupportsGetItem[int, tuple[str, str, str, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]], step: Any) -> Recording:
    """
    Records a controller: `step(parameters, state, sample, dt)` is called once with lists of numbers and returns the new
    state and the torque.
    """

def render_on(preset: Preset, corrections: SupportsIndex, seed: SupportsIndex, progress: Any | None) -> Outcome:
    """
    Renders the desired friction of a preset on its virtual bench, and measures it again.
    """

def sampling_of(preset: Preset) -> tuple[float, float]:
    """
    Time from sample to sample of the controllers of a preset [s], and the largest torque of its drive [N m].
    """

def sign(x: SupportsFloat) -> Number:
    """
    Sign: -1, 0 or 1; 0 for NaN.

    >>> import stickslip
    >>> stickslip.sign(-3.0)
    -1.0
    """

def simulate_on(preset: Preset, reference: Any, duration: SupportsFloat | SupportsIndex | None, controller: Any | None, render: bool, rest: SupportsFloat | SupportsIndex, place: SupportsFloat | SupportsIndex, seed: SupportsIndex, progress: Any | None) -> tuple[list[tuple[str, str, NDArray[float64]]], str | None]:
    """
    Simulates the closed loop of a preset: signals, and why it ended before its time.
    """

def sin(x: SupportsFloat) -> Number:
    """
    Sine, within 2 units in the last place up to 1e6 rad.

    >>> import stickslip
    >>> stickslip.sin(0.0)
    0.0
    """

def sqrt(x: SupportsFloat) -> Number:
    """
    Square root, within 1 unit in the last place; NaN below 0, 0 of a subnormal number.

    >>> import stickslip
    >>> stickslip.sqrt(9.0)
    3.0
    """

def where(condition: Any, yes: SupportsFloat, no: SupportsFloat) -> Number:
    """
    `yes` where the condition holds, `no` elsewhere. Both are computed, one counts.

    >>> import stickslip
    >>> stickslip.where(2.0 > 1.0, 5.0, 0.0)
    5.0
    """
