"""Reference numbers for linear systems, from SciPy and python-control.

    pip install numpy scipy control
    python make.py > linear.json

Random stable systems of order 1 to 10 (seed below), continuous and sampled. Poles, zeros and margins are kept only where the
reference itself has the digits that the test asks for: zeros by the pencil of the system and once more of its transpose,
margins by python-control and then by SciPy's root finding on the response.
"""

import json
import sys

import control
import numpy as np
import scipy
from scipy import linalg, optimize

random = np.random.default_rng(20241123)
PAIRS = lambda values: [[float(v.real), float(v.imag)] for v in values]


def rates(order, sampled):
    """Distinct poles, complex ones in pairs."""
    chosen = []
    while len(chosen) < order:
        if order - len(chosen) >= 2 and random.random() < 0.6:
            pole = complex(-random.uniform(0.1, 2.0), random.uniform(0.3, 5.0))
            chosen += [pole, pole.conjugate()]
        else:
            chosen.append(complex(-random.uniform(0.2, 5.0)))
    return np.exp(0.2 * np.array(chosen)) if sampled else np.array(chosen)


def system(order, ports, sampled, direct):
    poles = rates(order, sampled)
    blocks, k = [], 0
    while k < order:
        pole = poles[k]
        if pole.imag:
            blocks.append(np.array([[pole.real, pole.imag], [-pole.imag, pole.real]]))
            k += 2
        else:
            blocks.append(np.array([[pole.real]]))
            k += 1
    basis = linalg.qr(random.standard_normal((order, order)))[0] @ np.diag(random.uniform(0.5, 2.0, order))
    a = np.linalg.solve(basis, linalg.block_diag(*blocks)) @ basis
    b = random.standard_normal((order, ports))
    c = random.standard_normal((ports, order))
    d = random.standard_normal((ports, ports)) if direct else np.zeros((ports, ports))
    return a, b, c, d


def zeros(a, b, c, d):
    n, m = b.shape
    pencil = np.block([[a, b], [c, d]])
    mass = linalg.block_diag(np.eye(n), np.zeros((m, m)))
    values = linalg.eigvals(pencil, mass)
    values = values[np.isfinite(values)]
    return np.sort_complex(values[np.abs(values) < 1e5])


def response(a, b, c, d, points):
    return np.array([c @ np.linalg.solve(p * np.eye(len(a)) - a, b) + d for p in points])


def point(frequency, dt):
    return np.exp(1j * frequency * dt) if dt else 1j * frequency


def margins(a, b, c, d, dt):
    """Of a loop with one input; None where SciPy and python-control do not agree."""
    loop = lambda f: response(a, b, c, d, [point(f, dt)])[0, 0, 0]
    top = np.pi / dt * (1 - 1e-12) if dt else 1e4
    grid = np.geomspace(1e-4, top, 6000)
    values = np.array([loop(f) for f in grid])

    def roots(measure):
        seen = measure(values)
        found = []
        for k in np.nonzero(seen[:-1] * seen[1:] < 0)[0]:
            one = lambda f: float(measure(np.array([loop(f)]))[0])
            found.append(optimize.brentq(one, grid[k], grid[k + 1], xtol=1e-15 * grid[k], rtol=1e-15, maxiter=500))
        return found

    axis = [-1 / loop(f).real for f in roots(np.imag)]
    if dt:
        axis.append(-1 / loop(np.pi / dt).real)
    phases = [(np.angle(-loop(f)), f) for f in roots(lambda l: np.log(np.abs(l)))]

    def peak(measure):
        seen = measure(values)
        ends = [c @ np.linalg.solve((np.eye(len(a)) if dt else np.zeros_like(a)) - a, b) + d]
        ends.append(response(a, b, c, d, [-1.0])[0] if dt else d)
        best = max(seen.max(), *(measure(np.array(end))[0, 0] for end in ends))
        for k in range(len(grid)):
            low, high = max(k - 1, 0), min(k + 1, len(grid) - 1)
            if seen[k] >= 0.9 * best and seen[k] >= seen[low] and seen[k] >= seen[high]:
                one = lambda f: -float(measure(np.array([loop(f)]))[0])
                found = optimize.minimize_scalar(one, bounds=(grid[low], grid[high]), method="bounded",
                                                 options={"xatol": 1e-10 * grid[k]})
                best = max(best, -found.fun)
        return best

    above = [g for g in axis if g > 1]
    below = [g for g in axis if 0 < g < 1]
    result = {
        "gain": min(above) if above else None,
        "gain_reduction": max(below) if below else None,
        "phase": min((p for p, _ in phases), key=abs) if phases else None,
        "delay": min(p % (2 * np.pi) / f for p, f in phases) if phases else None,
        "sensitivity": peak(lambda l: np.abs(1 / (1 + l))),
        "complementary": peak(lambda l: np.abs(l / (1 + l))),
    }
    gains, phase_margins, *_ = control.stability_margins(control.ss(a, b, c, d, dt or 0), returnall=True)
    theirs = [g for g in gains if g > 1]
    if theirs and (not above or abs(min(theirs) / min(above) - 1) > 1e-5):
        return None
    theirs = np.radians(sorted(phase_margins, key=abs)[:1])
    if len(theirs) and (not phases or abs(abs(theirs[0]) - abs(result["phase"])) > 1e-5):
        return None
    return result


cases = []
while len(cases) < 48:
    order = 1 + len(cases) % 10
    sampled = len(cases) % 2 == 1 if len(cases) < 20 else random.random() < 0.5
    ports = 1 if len(cases) % 3 else (2 if order > 2 else 1)
    dt = 0.2 if sampled else None
    a, b, c, d = system(order, ports, sampled, random.random() < 0.5)
    ours, again = zeros(a, b, c, d), zeros(a.T, c.T, b.T, d.T)
    sound = len(ours) == len(again) and (not len(ours) or np.abs(ours - again).max() < 1e-11 * np.abs(ours).max())
    # A zero that a hair of the numbers moves far has no digits.
    hair = zeros(a * (1 + 1e-13 * random.standard_normal(a.shape)), b, c, d)
    if not sound or len(hair) != len(ours) or (len(ours) and np.abs(hair / ours - 1).max() > 1e-10):
        continue
    frequencies = np.geomspace(0.01, 10.0, 6)
    case = {
        "a": a.tolist(), "b": b.tolist(), "c": c.tolist(), "d": d.tolist(), "dt": dt,
        "poles": PAIRS(linalg.eigvals(a)), "zeros": PAIRS(ours), "frequencies": frequencies.tolist(),
        "response": [PAIRS(g.ravel()) for g in response(a, b, c, d, [point(f, dt) for f in frequencies])],
    }
    theirs = control.ss(a, b, c, d, dt or 0)
    assert np.allclose(control.poles(theirs).sum(), linalg.eigvals(a).sum())
    if ports == 1:
        c, d = 2.0 * c / np.abs(case["response"][2][0][0] + 0.5), 0.3 * d
        case["loop_c"], case["loop_d"] = c.tolist(), d.tolist()
        found = margins(a, b, c, d, dt)
        if found is None:
            continue
        case["margins"] = found
    if sampled:
        q, r = np.eye(order), np.eye(ports) * random.uniform(0.1, 10)
        cross = 0.05 * random.standard_normal((order, ports))
        x = linalg.solve_discrete_are(a, b, q, r, s=cross)
        case["cross"] = cross.tolist()
        case["weight"] = float(r[0, 0])
        case["regulator"] = np.linalg.solve(r + b.T @ x @ b, b.T @ x @ a + cross.T).tolist()
        p = linalg.solve_discrete_are(a.T, np.array(case["c"]).T, q, r)
        seen = np.array(case["c"])
        case["filter"] = np.linalg.solve(seen @ p @ seen.T + r, seen @ p).T.tolist()
        assert np.allclose(control.dlqr(a, b, q, r, cross)[0], case["regulator"], rtol=1e-8)
    else:
        held = theirs.sample(0.05, "zoh")
        case["held_a"], case["held_b"] = held.A.tolist(), held.B.tolist()
        q, r, seen = np.eye(order), 0.7 * np.eye(ports), np.array(case["c"])
        case["continuous_regulator"] = np.linalg.solve(r, b.T @ linalg.solve_continuous_are(a, b, q, r)).tolist()
        p = linalg.solve_continuous_are(a.T, seen.T, q, r)
        case["continuous_filter"] = np.linalg.solve(r, seen @ p).T.tolist()
        assert np.allclose(control.lqr(a, b, q, r)[0], case["continuous_regulator"], rtol=1e-8)
    cases.append(case)
    print(len(cases), order, file=sys.stderr)

made_by = f"numpy {np.__version__}, scipy {scipy.__version__}, control {control.__version__}"
print('{\n"made_by": %s,\n"cases": [' % json.dumps(made_by))
print(",\n".join(json.dumps(case) for case in cases))
print("]\n}")
