"""Reference numbers for the design functions, from SciPy and python-control.

    pip install numpy scipy control
    python make.py > design.json

Random systems of order 1 to 5 (seed below), continuous, of the time scale of a drive. Poles are placed by python-control
(`place`: SciPy's Yang-Tits method) and only systems are kept on which Ackermann's formula agrees with it to 1e-10, so
that the reference itself has the digits that the test asks for.
"""

import json

import control
import numpy as np
import scipy
from scipy import linalg, signal

random = np.random.default_rng(20240607)


def discretised(order, inputs):
    a = 200.0 * random.standard_normal((order, order))
    b = random.standard_normal((order, inputs))
    dt = float(10.0 ** random.uniform(-4, -2.3))
    ad, bd, *_ = signal.cont2discrete((a, b, np.eye(order), np.zeros((order, inputs))), dt, method="zoh")
    return {"a": a.tolist(), "b": b.tolist(), "dt": dt, "phi": ad.tolist(), "gamma": bd.tolist()}


def poles(order):
    """Distinct poles within the unit circle, complex ones in pairs."""
    chosen = []
    while len(chosen) < order:
        if order - len(chosen) >= 2 and random.random() < 0.5:
            pole = random.uniform(0.3, 0.95) * np.exp(1j * random.uniform(0.1, 1.5))
            chosen += [pole, pole.conjugate()]
        else:
            chosen.append(complex(random.uniform(0.2, 0.95)))
    return np.array(chosen)


def placed(order):
    while True:
        a = random.standard_normal((order, order)) / np.sqrt(order)
        b = random.standard_normal((order, 1))
        wanted = poles(order)
        gain = np.asarray(control.place(a, b, wanted)).ravel()
        check = np.asarray(control.acker(a, b, wanted)).ravel()
        if np.linalg.norm(gain - check) < 1e-10 * np.linalg.norm(gain):
            pairs = [[p.real, p.imag] for p in wanted]
            return {"a": a.tolist(), "b": b.ravel().tolist(), "poles": pairs, "gain": gain.tolist()}


def observed(order):
    """Predictor gains of (A, C), and those of the current form: A·L = the predictor gain."""
    while True:
        a = random.standard_normal((order, order)) / np.sqrt(order)
        c = random.standard_normal((1, order))
        wanted = poles(order)
        predictor = np.asarray(control.place(a.T, c.T, wanted)).ravel()
        check = np.asarray(control.acker(a.T, c.T, wanted)).ravel()
        if np.linalg.norm(predictor - check) < 1e-10 * np.linalg.norm(predictor) and np.linalg.cond(a) < 50:
            current = np.linalg.solve(a, predictor)
            pairs = [[p.real, p.imag] for p in wanted]
            return {
                "a": a.tolist(),
                "c": c.ravel().tolist(),
                "poles": pairs,
                "predictor": predictor.tolist(),
                "current": current.tolist(),
            }


def covariance(order):
    a = random.standard_normal((order, order))
    radius = float(random.choice([0.5, 0.9, 0.99, 0.999]))
    a *= radius / max(abs(np.linalg.eigvals(a)))
    root = random.standard_normal((order, order))
    q = root @ root.T
    p = linalg.solve_discrete_lyapunov(a, q, method="direct")
    return {"a": a.tolist(), "q": q.tolist(), "p": p.tolist(), "radius": radius}


def velocity_noise(poles, lead, dt, counts, acceleration_rms):
    """The observer's gains from `place` on the dual system and its velocity noise from SciPy's Lyapunov solver."""
    ratio = 2 * np.pi / lead
    a = np.array([[1, dt, -ratio * dt**2 / 2], [0, 1, -ratio * dt], [0, 0, 1]])
    b = np.array([ratio * dt**2 / 2, ratio * dt, 0.0])
    c = np.array([[1.0, 0, 0]])
    # Scaled states and distinct poles, or the reference has too few digits.
    scale = np.diag([1.0, 1 / dt, 1 / (ratio * dt**2)])
    scaled = np.linalg.solve(scale, a @ scale)
    wanted = np.exp(-np.array(poles) * dt)
    predictor = scale @ np.asarray(control.place(scaled.T, (c @ scale).T, wanted)).ravel()
    gain = np.linalg.solve(a, predictor)
    kept = np.eye(3) - np.outer(gain, c)
    f, g = kept @ a, kept @ b
    q = acceleration_rms**2 * np.outer(g, g) + (2 * np.pi / counts) ** 2 / 12 * np.outer(gain, gain)
    unit = np.linalg.inv(scale)
    p = scale @ linalg.solve_discrete_lyapunov(unit @ f @ scale, unit @ q @ unit.T, method="direct") @ scale.T
    return {
        "poles": poles,
        "lead": lead,
        "dt": dt,
        "counts": counts,
        "acceleration_rms": acceleration_rms,
        "gain": gain.tolist(),
        "velocity_rms": float(np.sqrt(p[1, 1])),
    }


numbers = {
    "zero_order_hold": [discretised(order, 1 + order % 2) for order in (1, 2, 3, 4, 5) for _ in range(4)],
    "placement": [placed(order) for order in (1, 2, 3, 4, 5) for _ in range(4)],
    "observer": [observed(order) for order in (1, 2, 3, 4, 5) for _ in range(4)],
    "lyapunov": [covariance(order) for order in (1, 2, 3, 4, 5) for _ in range(4)],
    "velocity_observer": [
        velocity_noise([240.0, 250.0, 260.0], 5e-3, 250e-6, 10000, 0.09),
        velocity_noise([50.0, 120.0, 300.0], 5e-3, 1e-3, 10000, 0.09),
        velocity_noise([400.0, 700.0, 2000.0], 2.5e-3, 1e-4, 50000, 0.02),
    ],
}
# One case a line.
lines = [f'"made_by": "numpy {np.__version__}, scipy {scipy.__version__}, control {control.__version__}"']
for name, cases in numbers.items():
    lines.append(f'"{name}": [\n' + ",\n".join(json.dumps(case) for case in cases) + "\n]")
print("{\n" + ",\n".join(lines) + "\n}")
