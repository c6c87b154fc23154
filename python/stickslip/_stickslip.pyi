"""
The compiled part of stickslip.
"""

from _typeshed import SupportsGetItem, SupportsLenAndGetItem
from numpy import float64
from numpy.typing import ArrayLike, NDArray
from os import PathLike
from pathlib import Path
from typing import Any, Final, SupportsFloat, SupportsIndex, final

__all__ = ["__version__", "Code", "Friction", "Group", "IdentifiedFriction", "MachineFile", "Measured", "Number", "Outcome", "Parameter", "Preset", "Recording", "Setpoint", "StribeckFit", "StudyParts", "StudyWork", "Table", "Truth", "_friction", "_restored", "benchmark_on", "calibrate_bench", "clip", "cos", "curves_of", "demo_on", "design_for", "exp", "fidelity_of", "fit_points", "floor", "folder_of_run", "friction_library", "hunting_of", "identified_friction", "identify_axis", "log", "loop_of", "machine_file", "maximum", "measure_on_preset", "minimum", "number", "open_study", "plan_of", "preset", "presets", "read_table", "record_controller", "render_on", "replay_record", "runs_of", "sampling_of", "sign", "simulate_on", "sin", "sqrt", "table_of", "validate_model", "where"]

__version__: Final[str]
"""
Version of the package.
"""

@final
class Code:
    """
    C code of a controller.
    """
    def compile(self, /, path: str | PathLike[str]) -> None:
        """
        Compile the library and replace the file at `path` in one step.
        """
    def fmu(self, /, path: str | PathLike[str], version: SupportsIndex) -> None:
        """
        Write an FMU of FMI version 2 or 3.
        """
    def generate(self, /, folder: str | PathLike[str], diagram: bool) -> None:
        """
        Write the project into a folder.
        """
    @property
    def sources(self, /) -> list[tuple[str, str]]:
        """
        Names and texts of the source files of the library.
        """

@final
class Friction:
    """
    Friction model: static, Dahl, LuGre, elasto-plastic or Maxwell slip, with its dependences on other quantities.

    `values` uses the names of a friction in a parameter file (`stickslip params describe plant.screw_friction`);
    missing values have their defaults. Raises InvalidValue or UnknownName.

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
        Compute the friction torque over a velocity trajectory: presliding, breakaway and sliding.

        - `velocity`: one value per step, held during the step [rad/s]. Values at the middle of the steps give second
          order.
        - `dt`: length of a step [s].
        - `angle` [rad], `load` [N m]: arrays of the same length, for friction that depends on them. Default: 0.
        - `arrest`: array of the torques that would stop the load within the step [N m]. Static friction has no
          bristles; at velocity 0 it takes up this torque. Default: 0.
        - `deflection`: initial deflection of bristles or elements [rad].

        Returns two arrays: the mean torque of each step [N m], positive against positive motion, and the deflection at
        its end [rad]. Raises InvalidValue for an invalid `dt` or arrays of different lengths.

        >>> import numpy as np, stickslip
        >>> screw = stickslip.preset("prototype").friction("plant.wheel.friction")
        >>> time = np.arange(0, 1, 1e-4)
        >>> torque, deflection = screw.course(0.01 * np.cos(2 * np.pi * time), 1e-4)
        >>> torque.shape == time.shape
        True
        """
    def steady(self, /, velocity: ArrayLike, *, angle: SupportsFloat | SupportsIndex = 0.0, load: SupportsFloat | SupportsIndex = 0.0) -> Any:
        """
        Return the friction torque [N m] at constant velocities, positive against positive motion.

        - `velocity`: number or array of any shape [rad/s]; the result has the same shape.
        - `angle`: screw angle [rad], for friction that depends on position.
        - `load`: load torque [N m], for friction that depends on load.

        >>> import numpy as np, stickslip
        >>> wheel = stickslip.preset("prototype").friction("plant.wheel.friction")
        >>> wheel.steady(np.linspace(-5, 5, 100)).shape
        (100,)
        """

@final
class Group:
    """
    Group of parameters, such as `p.model.own`. Read values by attribute or by path, as of a Preset.

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
        Return the value, list or group at a dotted path below. Raises UnknownName.
        """
    def __iter__(self, /) -> Any: ...
    def __len__(self, /) -> int: ...
    def __reduce__(self, /) -> "tuple[object, ...]": ...
    def __repr__(self, /) -> str: ...
    def describe(self, /, path: str) -> Parameter:
        """
        Return unit, range, default and meaning of the parameter at a path relative to this group. Raises UnknownName.
        """
    def keys(self, /) -> list[str]:
        """
        Return the paths of all values, relative to this group.
        """
    def to_dict(self, /) -> "dict[str, float | int | bool | str]":
        """
        Return all values by their paths, relative to this group.
        """

@final
class IdentifiedFriction:
    """
    Friction identified on a physical machine: source, parameters, and range of validity.
    """
    def __repr__(self, /) -> str: ...
    @property
    def friction(self, /) -> Friction:
        """
        Friction model.
        """
    @property
    def inertia(self, /) -> float | None:
        """
        Inertia used in the identification [kg m²]; None if unknown.
        """
    @property
    def licence(self, /) -> str:
        """
        Licence terms.
        """
    @property
    def name(self, /) -> str:
        """
        Name in the library, or file.
        """
    def on(self, /, bench: Preset, role: str = "desired") -> Preset:
        """
        Return a preset with this friction.

        - `role`: "desired", the friction to render; or "own", the friction of the virtual machine and of its model,
          with the friction wheel released.

        Raises UnknownName for another role.

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> q = stickslip.identified_friction("dc-servo").on(p)
        >>> q.bench.desired == p.bench.desired
        False
        """
    @property
    def remarks(self, /) -> list[str]:
        """
        Limits of the model, data missing in the source, and the recommended next step.
        """
    def scaled(self, /, factor: SupportsFloat | SupportsIndex) -> IdentifiedFriction:
        """
        Scale to a machine of another size: multiply all torques and the inertia by `factor`. The motion is the same.
        Raises InvalidValue for a factor that is not positive and finite.
        """
    @property
    def source(self, /) -> str:
        """
        Source of the data and method of identification.
        """
    @property
    def speeds(self, /) -> tuple[float, float] | None:
        """
        Lowest and highest speed of the measurement [rad/s]; None if unknown.
        """
    @property
    def standard_deviations(self, /) -> dict[str, float]:
        """
        Standard deviations of the parameters by path, in their units, as far as the source states them.
        """
    @property
    def title(self, /) -> str:
        """
        Short description.
        """
    def torque(self, /, velocity: ArrayLike) -> tuple[NDArray[float64], NDArray[float64]]:
        """
        Return friction torque and standard deviation [N m] at constant velocities [rad/s].

        The deviation combines the parameter deviations that the source states, assumed independent.

        >>> import stickslip
        >>> torque, deviation = stickslip.identified_friction("emps").torque([1.0, 10.0])
        >>> torque.shape, bool((deviation > 0).all())
        ((2,), True)
        """

@final
class MachineFile:
    """
    Machine file, checked.
    """
    @property
    def text(self, /) -> str:
        """
        Text of the file.
        """

@final
class Measured:
    """
    Measurement of a controller at a sample.
    """
    def __repr__(self, /) -> str: ...
    @property
    def angle(self, /) -> float:
        """
        Screw angle from the encoder, unwrapped [rad].
        """
    @property
    def time(self, /) -> float:
        """
        Time since the start of the run [s].
        """
    @property
    def velocity(self, /) -> float:
        """
        Motor velocity from the tacho [rad/s].
        """

@final
class Number:
    """
    Number of a controller: a float while it runs, a node of the graph while it is recorded.

    It supports `+ - * /`, `abs`, `round`, comparisons and the functions of stickslip. While the controller runs,
    `float` returns the value.
    """
    __array_ufunc__: Final[bool | None]
    """
    None: NumPy leaves arithmetic with its numbers to this class, and its functions reject it.
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
    Result of a function.
    """
    def columns(self, /) -> list[tuple[str, str, NDArray[float64]]]:
        """
        Return name, unit and values of each column of the data.
        """
    def html(self, /, command: str) -> str:
        """
        Return the report as one HTML page; `command` is the call that produced the result.
        """
    def lines(self, /) -> list[str]:
        """
        Return the lines for the terminal.
        """
    def remarks(self, /) -> list[str]:
        """
        Return the remarks, each with a remedy.
        """
    def summary(self, /) -> str:
        """
        Return the text of `summary.json`.
        """
    def write(self, /, folder: str | PathLike[str], command: str) -> str:
        """
        Write report, data and `summary.json` into a folder. Returns the text of the summary.
        """

@final
class Parameter:
    """
    Description of a parameter: unit, range, default and meaning.

    `str()` returns the text of `stickslip params describe`.
    """
    def __repr__(self, /) -> str: ...
    def __str__(self, /) -> str: ...
    @property
    def default(self, /) -> float | None:
        """
        Default value, in the unit; None for a choice.
        """
    @property
    def help(self, /) -> str:
        """
        Meaning of the parameter.
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
        The choice that the parameter requires, such as `friction.model = "lugre"`; None if it always exists.
        """
    @property
    def path(self, /) -> str:
        """
        Dotted path.
        """
    @property
    def symbol(self, /) -> str:
        """
        Symbol in equations; empty if there is none.
        """
    @property
    def unit(self, /) -> str:
        """
        SI unit; "1" for a pure number, empty for a choice.
        """
    @property
    def variants(self, /) -> dict[str, str]:
        """
        Variants of a choice, each with its meaning; empty for a number.
        """

@final
class Preset:
    """
    Parameters of a bench: virtual machine (`plant`), model used by the software (`model`), settings (`bench`).

    Read values by attribute or by path, all in SI units. A preset is immutable: `set` returns a new one.

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
        Return the value, list or group at a dotted path. Raises UnknownName.
        """
    def __hash__(self, /) -> int: ...
    def __iter__(self, /) -> Any: ...
    def __len__(self, /) -> int: ...
    def __reduce__(self, /) -> "tuple[object, ...]": ...
    def __repr__(self, /) -> str: ...
    def __str__(self, /) -> str: ...
    def describe(self, /, path: str) -> Parameter:
        """
        Return unit, range, default and meaning of the parameter at a path. Raises UnknownName.

        >>> import stickslip
        >>> print(stickslip.preset("prototype").describe("bench.tick_rate"))
        bench.tick_rate
            f_tick [Hz], 500 … 20000, default 4000
            Rate of sensors, observer, rendering law and load-motor current control.
        """
    def descriptions(self, /, path: str = "") -> list[Parameter]:
        """
        List the descriptions of all parameters at or below a path. Default: all parameters.

        A parameter of several variants of a choice is listed once for each variant. Raises UnknownName.

        >>> import stickslip
        >>> [it.symbol for it in stickslip.preset("prototype").descriptions("model.own")][:2]
        ['M_S', 'M_K']
        """
    def diff(self, /, other: Preset) -> "list[tuple[str, float | int | bool | str | None, float | int | bool | str | None]]":
        """
        List the differences to another preset: path, value here, value in `other`; None for a missing value.

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> p.diff(p.set({"bench.tick_rate": 8000}))
        [('bench.tick_rate', 4000.0, 8000.0)]
        """
    def friction(self, /, path: str) -> Friction:
        """
        Return the friction at a path: of the virtual machine (`plant.screw_friction`), or a curve (`model.own`).
        Raises UnknownName where the path is not a friction.

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> p.friction("model.own").steady(1e-6) > 0.9 * p.model.own.breakaway_torque
        True
        """
    def keys(self, /) -> list[str]:
        """
        Return the paths of all values, in the order of a parameter file.
        """
    def set(self, /, values: Any) -> Preset:
        """
        Return a copy with other values.

        `values` maps paths to values. A mapping as value sets parameters below its path; a group of a preset replaces
        the whole group. All values are checked together. Raises UnknownName for an unknown path, TypeError for a wrong
        type, InvalidValue for a value outside its range or inconsistent values.

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
        Return all values by their paths.

        >>> import stickslip
        >>> stickslip.preset("prototype").to_dict()["bench.tick_rate"]
        4000.0
        """
    def toml(self, /, *, complete: bool = False) -> str:
        """
        Return the text of the parameter file with all changes, comments preserved.

        - `complete`: write every parameter, with unit, range and meaning as comments.

        >>> import stickslip
        >>> p = stickslip.preset("prototype")
        >>> stickslip.preset(text=p.toml(complete=True)) == p
        True
        """

@final
class Recording:
    """
    Recorded graph of a controller.
    """
    @property
    def operations(self, /) -> int:
        """
        Number of operations.
        """
    def write(self, /, sample_time: SupportsFloat | SupportsIndex) -> Code:
        """
        Generate C code, with self-test and example for samples of `sample_time` [s].
        """

@final
class Setpoint:
    """
    Set-point of a controller at a sample.
    """
    def __repr__(self, /) -> str: ...
    @property
    def acceleration(self, /) -> float:
        """
        Second derivative of the screw angle [rad/s²].
        """
    @property
    def position(self, /) -> float:
        """
        Screw angle [rad].
        """
    @property
    def velocity(self, /) -> float:
        """
        First derivative of the screw angle [rad/s].
        """

@final
class StribeckFit:
    """
    Stribeck curve fitted to points.
    """
    def at(self, /, velocity: ArrayLike) -> tuple[NDArray[float64], NDArray[float64]]:
        """
        Return the curve at velocities and half the width of its 95 % band.
        """
    @property
    def chi_square(self, /) -> float:
        """
        Weighted sum of squared residuals.
        """
    @property
    def covariance(self, /) -> NDArray[float64]:
        """
        Covariance of the parameters, in the order of `parameters`.
        """
    @property
    def degrees_of_freedom(self, /) -> int:
        """
        Number of points minus number of parameters.
        """
    def fragment(self, /) -> str:
        """
        Return the own friction as part of a parameter file. Raises InvalidValue where the fit has no such parameters.
        """
    @property
    def intervals(self, /) -> dict[str, tuple[float, float]]:
        """
        Ends of the 95 % intervals of the parameters.
        """
    @property
    def known(self, /) -> dict[str, bool]:
        """
        Whether the points determine each parameter.
        """
    @property
    def lack_of_fit(self, /) -> float:
        """
        Deviation of the measured friction from a Stribeck curve, as a standard deviation.
        """
    def outcome(self, /) -> Outcome:
        """
        Return numbers, remarks and report.
        """
    @property
    def parameters(self, /) -> dict[str, float]:
        """
        Values of the parameters by name.
        """
    @property
    def residuals(self, /) -> NDArray[float64]:
        """
        Measured minus fitted torque, positive where the measured magnitude is larger, in the order of the points.
        """
    @property
    def rms(self, /) -> float:
        """
        Root mean square of the residuals.
        """
    @property
    def standard_errors(self, /) -> dict[str, float]:
        """
        Standard errors of the parameters; infinite for a parameter that the points do not determine.
        """

@final
class StudyParts:
    """
    Study in a folder.
    """
    def finish(self, /) -> tuple[Outcome, list[tuple[str, str, NDArray[float64]]], dict[int, str], list[str], list[NDArray[float64]] | None, int]:
        """
        Write the file of the study and return the results.
        """
    def missing(self, /) -> list[tuple[int, int]]:
        """
        Return the parts that were missing at opening, and the number of cases of each.
        """
    def put(self, /, index: SupportsIndex, bytes: bytes) -> None:
        """
        Store the bytes of a part that another machine ran.
        """
    def run(self, /, threads: SupportsIndex | None, progress: Any | None) -> None:
        """
        Run the missing parts in this process. Default of `threads`: one per processor.
        """
    def work(self, /) -> str:
        """
        Return the description of the study as text, for StudyWork.
        """

@final
class StudyWork:
    """
    Description of a study, for running its parts on another machine.
    """
    def __new__(cls, /, text: str) -> StudyWork:
        """
        Parse the text of `StudyParts.work`. Raises Error for another version.
        """
    def part(self, /, index: SupportsIndex) -> bytes:
        """
        Run a part on one thread and return its bytes.
        """

@final
class Table:
    """
    Recording: columns of equal length, as in the file.
    """
    def columns(self, /) -> list[tuple[str, str, NDArray[float64]]]:
        """
        Return name, unit and values of each column; the unit is "" where the file states none.
        """
    def signals(self, /, machine: MachineFile) -> tuple[list[tuple[str, str, NDArray[float64]]], list[str]]:
        """
        Return the signals of a machine in SI units, and the notes on them.
        """

@final
class Truth:
    """
    Condition of a controller: `True` or `False` while it runs, without a value while it is recorded.

    Join conditions with `& | ~`; select by them with `stickslip.where`.
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
    Restore a friction from its text, for pickle.
    """

def _restored(text: str, file: str) -> Preset:
    """
    Restore a preset from its text, for pickle; `file` is its name in messages.
    """

def benchmark_on(preset: Preset, machine: str, controllers: SupportsGetItem[int, str] | None, frictions: SupportsGetItem[int, str] | None, manoeuvres: SupportsGetItem[int, str] | None, quick: bool, seeds: SupportsIndex | None, places: SupportsIndex | None, threads: SupportsIndex | None, folder: str | PathLike[str], progress: Any | None) -> Outcome:
    """
    Run controllers on frictions and manoeuvres. Finished cells are stored in the folder and reused from there.
    """

def calibrate_bench(preset: Preset, plan: Any | None, seed: SupportsIndex, progress: Any | None) -> tuple[Preset, Outcome]:
    """
    Calibrate the virtual bench of a preset. Returns the calibrated preset as text and the result.
    """

def clip(x: SupportsFloat, low: SupportsFloat, high: SupportsFloat) -> Number:
    """
    Limit a number to `low` … `high`; NaN remains NaN.

    >>> import stickslip
    >>> stickslip.clip(5.0, -1.0, 1.0)
    1.0
    """

def cos(x: SupportsFloat) -> Number:
    """
    Return the cosine of an angle [rad], within 2 units in the last place up to 1e6 rad.

    >>> import stickslip
    >>> stickslip.cos(0.0)
    1.0
    """

def curves_of(path: str | PathLike[str], velocity: str | None, torque: str | None, standard_error: str | None, group: str | None) -> list[tuple[str, list[tuple[str, str, NDArray[float64]]]]]:
    """
    Read friction curves from a file. Returns name and columns of each curve.
    """

def demo_on(preset: Preset, seed: SupportsIndex, progress: Any | None) -> Outcome:
    """
    Run the whole experiment: measure, fit, design, render, measure again.
    """

def design_for(preset: Preset, points: SupportsGetItem[int, SupportsLenAndGetItem[SupportsFloat | SupportsIndex]], acceleration: SupportsFloat | SupportsIndex | None) -> tuple[Preset, Outcome, bool]:
    """
    Design the desired friction through points. Returns the preset with it, the outcome, and whether it is renderable.
    """

def exp(x: SupportsFloat) -> Number:
    """
    Return the exponential, within 2 units in the last place; 0 instead of a subnormal number.

    >>> import stickslip
    >>> stickslip.exp(0.0)
    1.0
    """

def fidelity_of(presets: SupportsGetItem[int, str], laws: SupportsGetItem[int, str], rates: SupportsGetItem[int, SupportsFloat | SupportsIndex], wheel: bool | None, mismatches: SupportsGetItem[int, str], observers: SupportsGetItem[int, str], scenarios: SupportsGetItem[int, str], quick: bool, seeds: SupportsIndex | None, threads: SupportsIndex | None, progress: Any | None) -> Outcome:
    """
    Compare rendered with true friction.
    """

def fit_points(velocity: ArrayLike, torque: ArrayLike, standard_error: ArrayLike | None, side: str, linear: bool, preload: SupportsFloat | SupportsIndex | None, source: str) -> StribeckFit:
    """
    Fit a Stribeck curve to velocities, torques or forces, and optional standard errors.
    """

def floor(x: SupportsFloat) -> Number:
    """
    Return the largest whole number that is not above `x`.

    >>> import stickslip
    >>> stickslip.floor(-0.5)
    -1.0
    """

def folder_of_run(number: SupportsIndex) -> Path:
    """
    Folder of a run by its number.
    """

def friction_library() -> "dict[str, str]":
    """
    List the frictions of the library: names and titles.

    >>> import stickslip
    >>> "emps" in stickslip.friction_library()
    True
    """

def hunting_of(preset: Preset, desired: bool, duration: SupportsFloat | SupportsIndex | None, progress: Any | None) -> tuple[tuple[float, float] | None, Outcome]:
    """
    Predict whether the controller of a preset hunts within a duration [s]. Returns amplitude [rad] and interval [s], or
    None, and the outcome.
    """

def identified_friction(source: str) -> IdentifiedFriction:
    """
    Return a friction of the library by name, or of a file in the format of `data/friction`. Raises UnknownName.

    >>> import stickslip
    >>> servo = stickslip.identified_friction("dc-servo")
    >>> servo.friction.steady(1.0) > 0.0
    True
    """

def identify_axis(recording: Table, machine: MachineFile, progress: Any | None) -> tuple[Outcome, str, list[tuple[str, str, NDArray[float64]]], tuple[NDArray[float64], NDArray[float64]]]:
    """
    Identify an axis from a recording.
    """

def log(x: SupportsFloat) -> Number:
    """
    Return the natural logarithm, within 2 units in the last place; defined for normal positive numbers only.

    >>> import stickslip
    >>> stickslip.log(1.0)
    0.0
    """

def loop_of(preset: Preset, speed: SupportsFloat | SupportsIndex, tune: bool, progress: Any | None) -> tuple[Preset, Outcome]:
    """
    Analyse the position loop of a preset at a sliding speed [rad/s], with its own or with tuned gains. Returns the
    preset with that controller, and the outcome.
    """

def machine_file(path: str | PathLike[str], text: str | None) -> MachineFile:
    """
    Read a machine file, or its text where `text` is given; `path` then is its name in messages.
    """

def maximum(a: SupportsFloat, b: SupportsFloat) -> Number:
    """
    Return the larger number; the second one if either is NaN.

    >>> import stickslip
    >>> stickslip.maximum(2.0, 1.0)
    2.0
    """

def measure_on_preset(preset: Preset, kind: str, plan: Any | None, thorough: bool, preload: SupportsFloat | SupportsIndex | None, seed: SupportsIndex, progress: Any | None) -> Outcome:
    """
    Run a measurement on the virtual bench of a preset.
    """

def minimum(a: SupportsFloat, b: SupportsFloat) -> Number:
    """
    Return the smaller number; the second one if either is NaN.

    >>> import stickslip
    >>> stickslip.minimum(2.0, 1.0)
    1.0
    """

def number(value: SupportsFloat) -> Number:
    """
    Convert to a number of a controller.
    """

def open_study(file: str | PathLike[str] | None, text: str, preset: Preset | None, folder: str | PathLike[str], progress: Any | None) -> StudyParts:
    """
    Open a study from a file or from text; `preset` replaces the preset that the text names.
    """

def plan_of(kind: str) -> list[Parameter]:
    """
    List the parameters of a measurement plan.
    """

def preset(source: str | None = None, *, text: str | None = None) -> Preset:
    """
    Load a preset by name, from a parameter file or from text.

    - `source`: a name from `presets()`, or the path of a file.
    - `text`: the text of a parameter file (TOML), instead of `source`.

    Raises UnknownName for an unknown name, FileError where the file cannot be read, InvalidValue for errors in it.

    >>> import stickslip
    >>> stickslip.preset("clm-bench").bench.tick_rate
    4000.0
    >>> stickslip.preset(text="[model.own]\\nkinetic_torque = 0.2").model.own.kinetic_torque
    0.2
    """

def presets() -> dict[str, str]:
    """
    List the built-in presets: names and descriptions.

    >>> import stickslip
    >>> "prototype" in stickslip.presets()
    True
    """

def read_table(path: str | PathLike[str]) -> Table:
    """
    Read a recording from a file.
    """

def record_controller(name: str, help: str, parameters: SupportsGetItem[int, tuple[str, str, str, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]], state: SupportsGetItem[int, tuple[str, str, str, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex, SupportsFloat | SupportsIndex]], step: Any) -> Recording:
    """
    Record a controller. Calls `step(parameters, state, sample, dt)` once with lists of numbers; it returns the new
    state and the torque.
    """

def render_on(preset: Preset, corrections: SupportsIndex, seed: SupportsIndex, progress: Any | None) -> Outcome:
    """
    Render the desired friction of a preset on its virtual bench, and measure the result.
    """

def replay_record(path: str | PathLike[str], progress: Any | None) -> tuple[int, int, bool, int, tuple[int, str, str, float, float] | None, str]:
    """
    Replay a record.
    """

def runs_of(query: str, project: str | PathLike[str] | None, limit: SupportsIndex) -> tuple[list[tuple[str, Path | None]], list[str]]:
    """
    Find runs. Returns each as JSON with its folder, None where its files are missing, and hints on ignored terms of the
    query.
    """

def sampling_of(preset: Preset) -> tuple[float, float]:
    """
    Return the sample time of the controllers of a preset [s] and the torque limit of its drive [N m].
    """

def sign(x: SupportsFloat) -> Number:
    """
    Return the sign: -1, 0 or 1; 0 for NaN.

    >>> import stickslip
    >>> stickslip.sign(-3.0)
    -1.0
    """

def simulate_on(preset: Preset, reference: Any, duration: SupportsFloat | SupportsIndex | None, controller: Any | None, render: bool, rest: SupportsFloat | SupportsIndex, place: SupportsFloat | SupportsIndex, seed: SupportsIndex, progress: Any | None) -> tuple[list[tuple[str, str, NDArray[float64]]], str | None]:
    """
    Simulate the closed loop of a preset. Returns the signals, and the reason for an early end.
    """

def sin(x: SupportsFloat) -> Number:
    """
    Return the sine of an angle [rad], within 2 units in the last place up to 1e6 rad.

    >>> import stickslip
    >>> stickslip.sin(0.0)
    0.0
    """

def sqrt(x: SupportsFloat) -> Number:
    """
    Return the square root, within 1 unit in the last place; NaN below 0, 0 for a subnormal number.

    >>> import stickslip
    >>> stickslip.sqrt(9.0)
    3.0
    """

def table_of(name: str, columns: SupportsGetItem[int, tuple[str, str | None, ArrayLike]]) -> Table:
    """
    Make a recording of columns: name, unit and values of each; `name` is that of the recording in messages.
    """

def validate_model(recording: Table, model: str | PathLike[str], machine: MachineFile, progress: Any | None) -> Outcome:
    """
    Validate a model, from the file `model.toml` of an identification, on a recording.
    """

def where(condition: Any, yes: SupportsFloat, no: SupportsFloat) -> Number:
    """
    Return `yes` where the condition holds, `no` elsewhere. Both are always computed.

    >>> import stickslip
    >>> stickslip.where(2.0 > 1.0, 5.0, 0.0)
    5.0
    """
