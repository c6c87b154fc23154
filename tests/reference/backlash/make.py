"""Reference trajectory of a drive with backlash, piece by piece by SciPy's matrix exponential.

    pip install numpy==2.4.6 scipy==1.17.1
    python make.py                 # writes drive.csv beside itself; a few seconds

The model is written here a second time on purpose: it shares no line with the product. Two masses with a coupling that
has a gap, a shorted load motor, and a torque on the load that changes its sign every 50 ms; no friction. While the flanks
stay as they are everything is linear, and exact; where they meet or part is located by bisection:

  open   |delta| within the gap, or flanks that would pull: no torque
  up     delta beyond +beta and c (delta - beta) + d delta' > 0
  down   delta beyond -beta and c (delta + beta) + d delta' < 0

It is printed how often they meet or part, and how far a search twice as coarse ends from it, as a fraction of the range.
"""

from pathlib import Path

import numpy as np
from scipy.linalg import expm

MOTOR, LOAD, STIFFNESS, DAMPING = 4.1e-4, 6.0e-4, 60.0, 9.6e-3
CONSTANT, RESISTANCE, INDUCTANCE = 0.0934, 0.61, 0.42e-3
GAP, TORQUE, HALF_PERIOD, DURATION, SAMPLE = 2e-3, 0.1, 0.05, 0.5, 5e-3


def matrix(contact, torque):
    """Rates of twist, motor velocity, load angle, load velocity, current, and the constant 1."""
    a = np.zeros((6, 6))
    a[0, 1], a[0, 3], a[2, 3] = 1.0, -1.0, 1.0
    if contact:
        coupling = np.array([STIFFNESS, DAMPING, 0.0, -DAMPING, 0.0, -STIFFNESS * contact * GAP])
        a[1] -= coupling / MOTOR
        a[3] += coupling / LOAD
    a[3, 4] -= CONSTANT / LOAD
    a[3, 5] += torque / LOAD
    a[4, 3], a[4, 4] = CONSTANT / INDUCTANCE, -RESISTANCE / INDUCTANCE
    return a


def contact_of(x):
    twist, slip = x[0], x[1] - x[3]
    for side in (1, -1):
        beyond = side * twist - GAP
        if beyond > 0.0 and STIFFNESS * beyond + DAMPING * side * slip > 0.0:
            return side
    return 0


def run(step):
    x, rows, changes = np.array([0.0] * 5 + [1.0]), [[0.0, 0.0, 0.0]], 0
    flows = {(c, s): expm(matrix(c, s * TORQUE) * step) for c in (-1, 0, 1) for s in (-1, 1)}
    for k in range(round(DURATION / SAMPLE)):
        sign = 1 if int((k + 0.5) * SAMPLE / HALF_PERIOD) % 2 == 0 else -1
        for _ in range(round(SAMPLE / step)):
            left = step
            while left > 0.0:
                contact = contact_of(x)
                flow = flows[contact, sign] if left == step else expm(matrix(contact, sign * TORQUE) * left)
                ahead = flow @ x
                if contact_of(ahead) == contact:
                    x = ahead
                    break
                low, high = 0.0, left
                while high - low > 1e-16:
                    middle = 0.5 * (low + high)
                    there = expm(matrix(contact, sign * TORQUE) * middle) @ x
                    low, high = (middle, high) if contact_of(there) == contact else (low, middle)
                x = expm(matrix(contact, sign * TORQUE) * high) @ x
                left -= high
                changes += 1
        rows.append([(k + 1) * SAMPLE, x[2], x[2] + x[0]])
    return np.array(rows), changes


fine, changes = run(1e-6)
coarse, _ = run(2e-6)
apart = np.abs(fine - coarse).max(0) / np.ptp(fine, 0)
print("flanks meet or part", changes, "times; coarser search:", apart[1:])
lines = ["time [s],load angle [rad],motor angle [rad]"] + [",".join(repr(float(v)) for v in row) for row in fine]
(Path(__file__).parent / "drive.csv").write_text("\n".join(lines) + "\n")
