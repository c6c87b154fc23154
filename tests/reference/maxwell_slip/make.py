"""Reference trajectories of a Maxwell slip by SciPy.

    python3 tests/reference/maxwell_slip/make.py

writes numbers.csv beside itself: a name and its values per line. The level is the solution of its differential equation, each
element goes from event to event (meets its limit, comes off it), whose times are roots. Made with SciPy 1.17.1, NumPy 2.4.6.
"""

import pathlib

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

BREAKAWAY, KINETIC, STRIBECK, VISCOUS = 0.3, 0.18, 3.0, 2.0e-4
ATTRACTION = 30.0
SHARES = [0.1, 0.2, 0.3, 0.4]
STIFFNESSES = [200.0, 100.0, 50.0, 20.0]


def curve(velocity):
    return KINETIC + (BREAKAWAY - KINETIC) * np.exp(-np.abs(velocity) / STRIBECK)


def level_of(velocity, duration, breaks=()):
    """The level over time, from rest."""
    edges, start, pieces = [0.0, *breaks, duration], BREAKAWAY, []
    for begin, end in zip(edges, edges[1:]):
        middle = 0.5 * (begin + end)
        # A velocity that is constant between its breaks is asked within them.
        of = (lambda t, m=middle: velocity(m)) if breaks else velocity
        rate = lambda t, level, of=of: ATTRACTION * (1.0 - level / curve(of(t)))
        pieces.append(solve_ivp(rate, (begin, end), [start], rtol=1e-12, atol=1e-14, max_step=5e-3, dense_output=True))
        start = pieces[-1].y[0, -1]

    def level(t):
        piece = np.searchsorted(edges[1:-1], t, side="right")
        return pieces[piece].sol(t)[0]

    return level


def element(share, stiffness, way, velocity, level, times):
    """Torque of an element at ascending times, sampled finely enough that no event is missed."""
    grid = np.unique(np.concatenate([times, np.linspace(times[0], times[-1], 40_001)]))
    out, now, side = {times[0]: 0.0}, 0.0, 0
    anchor, at_anchor = way(times[0]), 0.0
    for begin, end in zip(grid, grid[1:]):
        while now < end:
            if side == 0:
                torque = lambda t: at_anchor + stiffness * (way(t) - anchor)
                over = lambda t: abs(torque(t)) - share * level(t)
                if over(end) <= 0.0:
                    now = end
                    continue
                now = brentq(over, begin, end, xtol=1e-15) if over(begin) < 0.0 else begin
                side = 1 if torque(end) > 0.0 else -1
            else:
                # It comes off where the spring would fall behind its limit.
                slope = lambda t: (level(t + 1e-7) - level(t - 1e-7)) / 2e-7
                pressed = lambda t: side * stiffness * velocity(t) - share * slope(t)
                if pressed(end) >= 0.0:
                    now = end
                    continue
                now = brentq(pressed, now, end, xtol=1e-15) if pressed(now) > 0.0 else now
                anchor, at_anchor, side = way(now), side * share * level(now), 0
                begin = now
        out[end] = at_anchor + stiffness * (way(end) - anchor) if side == 0 else side * share * level(end)
    return np.array([out[t] for t in times])


lines = {}

# Two sines within the presliding range: loops within loops.
parts = [(1.5e-3, 2 * np.pi), (1.2e-3, 2 * np.pi * 3.3)]
way = lambda t: sum(a * np.sin(w * t) for a, w in parts)
velocity = lambda t: sum(a * w * np.cos(w * t) for a, w in parts)
times = np.linspace(0.0, 2.0, 401)
level = level_of(velocity, 2.001)
wrapped = lambda t: level(max(t, 0.0))
lines["loop_torque"] = sum(element(*e, way, velocity, wrapped, times) for e in zip(SHARES, STIFFNESSES))

# Sliding at 0.05, 5 and 0.5 rad/s. From 0.25 s on all elements slip, so that the torque is the level and the viscous part.
steps = lambda t: 0.05 if t < 0.3 else 5.0 if t < 0.35 else 0.5
level = level_of(steps, 0.45, (0.3, 0.35))
times = 0.25 + 12.5e-6 + 1e-3 * np.arange(200)
lines["step_torque"] = np.array([level(t) + VISCOUS * steps(t) for t in times])

with (pathlib.Path(__file__).parent / "numbers.csv").open("w") as file:
    for name, values in lines.items():
        file.write(",".join([name, *(repr(float(v)) for v in values)]) + "\n")
