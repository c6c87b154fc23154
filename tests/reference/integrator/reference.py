"""Reference trajectories of the elastic drive with bristle friction, by SciPy's Radau.

    pip install numpy==2.4.6 scipy==1.17.1
    python reference.py            # writes *.csv and accuracy.json beside itself; about a minute

The model is written here a second time on purpose: it shares no line with the product. Its states are the twist of the
coupling, both velocities, the load angle and one deflection a bristle. Each trajectory is computed three times:

  tight  Radau, rtol 1e-12          the numbers that are committed
  loose  Radau, rtol 1e-10          what the tolerance does
  other  DOP853, rtol 1e-12         what the method does (explicit, order 8, so that it shares no stage with Radau)

accuracy.json holds the largest difference over all samples, as a fraction of the range of the signal. No event is located:
the rate of an elasto-plastic bristle is continuous (alpha jumps only where Omega passes through 0, and is multiplied by
|Omega|), and the error control sees the kinks; that the three agree is the evidence.
"""

import json
import sys
from concurrent.futures import ProcessPoolExecutor
from math import exp, pi, sin
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

HERE = Path(__file__).parent
DURATION = 2.0
SAMPLES = 201


class Bristle:
    """Elasto-plastic LuGre after Dupont et al. (2002); the zone is capped below the sliding level."""

    def __init__(self, name, breakaway, kinetic, stribeck, stiffness, damping, damping_velocity, gaussian):
        self.name, self.breakaway, self.kinetic, self.stribeck = name, breakaway, kinetic, stribeck
        self.stiffness, self.damping, self.damping_velocity = stiffness, damping, damping_velocity
        self.gaussian = gaussian

    def rate(self, z, w):
        level = self.kinetic + (self.breakaway - self.kinetic) * exp(-abs(w) / self.stribeck)
        slide = level / self.stiffness
        elastic = min(0.7 * self.breakaway / self.stiffness, 0.95 * slide)
        size = abs(z)
        if z * w <= 0.0 or size <= elastic:
            alpha = 0.0
        elif size >= slide:
            alpha = 1.0
        else:
            alpha = 0.5 + 0.5 * sin(pi * (size - 0.5 * (slide + elastic)) / (slide - elastic))
        return w - alpha * abs(w) * z / slide

    def torque(self, z, w, rate):
        ratio = (w / self.damping_velocity) ** 2
        damping = self.damping * (exp(-ratio) if self.gaussian else 1.0 / (1.0 + ratio))
        return self.stiffness * z + damping * rate


class Drive:
    """Two masses, spring and damper between them, viscous friction and bristles on either."""

    def __init__(
        self, motor, load, stiffness, damping, motor_viscous, load_viscous, load_bristles, motor_bristles, amplitude
    ):
        self.motor, self.load, self.stiffness, self.damping = motor, load, stiffness, damping
        self.motor_viscous, self.load_viscous = motor_viscous, load_viscous
        self.load_bristles, self.motor_bristles, self.amplitude = load_bristles, motor_bristles, amplitude

    def bristles(self):
        return self.load_bristles + self.motor_bristles

    def rates(self, t, x):
        twist, w_motor, _, w = x[:4]
        z = list(x[4:])
        coupling = self.stiffness * twist + self.damping * (w_motor - w)
        out = [w_motor - w, 0.0, w, 0.0]
        on_load, on_motor = self.load_viscous * w, self.motor_viscous * w_motor
        for k, bristle in enumerate(self.load_bristles):
            rate = bristle.rate(z[k], w)
            on_load += bristle.torque(z[k], w, rate)
            out.append(rate)
        for k, bristle in enumerate(self.motor_bristles, len(self.load_bristles)):
            rate = bristle.rate(z[k], w_motor)
            on_motor += bristle.torque(z[k], w_motor, rate)
            out.append(rate)
        out[1] = (self.amplitude * sin(2.0 * pi * t) - coupling - on_motor) / self.motor
        out[3] = (coupling - on_load) / self.load
        return out

    def rates_of(self, t, x):
        return self.rates(t, x.tolist())

    def jacobian(self, t, x):
        """Differences over steps small against each state; SciPy's own grow without end in the column of the angle."""
        steps = np.array([1e-8, 1e-5, 1e-5, 1e-5] + [1e-9] * (len(x) - 4))
        columns = [np.subtract(self.rates_of(t, x + e), self.rates_of(t, x - e)) / (2.0 * e.sum()) for e in np.diag(steps)]
        return np.array(columns).T

    def solve(self, method, rtol):
        times = np.linspace(0.0, DURATION, SAMPLES)
        size = 4 + len(self.bristles())
        # A deflection is of the order 1e-4 rad: what is absolute must lie far below.
        atol = [rtol * s for s in [1e-4, 1e-1, 1e-1, 1e-1] + [1e-5] * (size - 4)]
        options = {"jac": self.jacobian} if method == "Radau" else {}
        span = (0.0, DURATION)
        found = solve_ivp(self.rates_of, span, np.zeros(size), method, times, rtol=rtol, atol=atol, **options)
        if not found.success:
            raise SystemExit(found.message)
        x = found.y
        return np.vstack([x[0] + x[2], x[2], x[1], x[3], x[4:]]), found.nfev

    def names(self):
        angles = ["motor_angle", "load_angle", "motor_velocity", "load_velocity"]
        return angles + [f"{b.name}_deflection" for b in self.bristles()]


def prototype(stiffness):
    desired = Bristle("load", 0.45, 0.20, 1.0, stiffness, 1.0, 0.5, gaussian=False)
    return Drive(8e-4, 1.2e-3, 120.0, 0.02, 5e-4, 8e-3, [desired], [], amplitude=0.9)


def clm_bench():
    screw = Bristle("screw", 0.060, 0.040, 2.0, 60.0, 0.17, 1.2, gaussian=True)
    wheel = Bristle("wheel", 0.240, 0.140, 3.23, 240.0, 0.68, 1.2, gaussian=True)
    brush = Bristle("brush", 0.010, 0.010, 1.0, 10.0, 0.028, 1.2, gaussian=True)
    return Drive(4.1e-4, 6.0e-4, 60.0, 9.6e-3, 1.6e-5, 2e-4, [screw, wheel], [brush], amplitude=0.4)


CASES = {
    "prototype-300": prototype(300.0),
    "prototype-3000": prototype(3000.0),
    "prototype-10000": prototype(10000.0),
    "clm-bench": clm_bench(),
}
RUNS = {"tight": ("Radau", 1e-12), "loose": ("Radau", 1e-10), "other": ("DOP853", 1e-12)}


def run(job):
    case, kind = job
    return job, CASES[case].solve(*RUNS[kind])


def main(names):
    with ProcessPoolExecutor(2) as pool:
        found = dict(pool.map(run, [(case, kind) for case in names for kind in RUNS]))
    path = HERE / "accuracy.json"
    accuracy = json.loads(path.read_text()) if path.exists() else {}
    for case in names:
        tight, evaluations = found[case, "tight"]
        columns = CASES[case].names()
        span = np.ptp(tight, axis=1)
        accuracy[case] = {
            "radau_1e-12_evaluations": evaluations,
            "range": dict(zip(columns, span.tolist())),
            **{
                f"{label}_over_range": dict(zip(columns, (np.abs(found[case, kind][0] - tight).max(axis=1) / span).tolist()))
                for kind, label in (("loose", "radau_1e-10"), ("other", "dop853_1e-12"))
            },
        }
        times = np.linspace(0.0, DURATION, SAMPLES)
        lines = [",".join(["time"] + columns)]
        lines += [",".join([f"{t:.2f}"] + [f"{v:.14e}" for v in row]) for t, row in zip(times, tight.T)]
        (HERE / f"{case}.csv").write_text("\n".join(lines) + "\n")
        print(case, json.dumps(accuracy[case], indent=1), flush=True)
    path.write_text(json.dumps(accuracy, indent=2) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:] or list(CASES))
