"""Reference fits of the Stribeck curve by SciPy (curve_fit; least_squares with Huber's loss).

    python3 tests/reference/stribeck/make.py

writes points.csv and fits.csv beside itself. Made with SciPy 1.17.1, NumPy 2.4.6.
"""

import csv
import pathlib

import numpy as np
from scipy.optimize import curve_fit, least_squares

here = pathlib.Path(__file__).parent
joints = here.parents[2] / "data" / "direct_drive_joint" / "friction_curve.csv"


def curve(v, ms, mk, vs, b):
    return mk + (ms - mk) * np.exp(-v / vs) + b * v


sets = {}
# A bench-like curve with a drop, errors that grow with speed, two outliers.
rng = np.random.default_rng(7)
v = np.geomspace(0.1, 50, 16)
se = 4e-4 * (1 + 0.05 * v)
torque = curve(v, 0.06, 0.04, 2.0, 2e-4) + se * rng.standard_normal(v.size)
sets["bench"] = (v, torque, se)
outliers = torque.copy()
outliers[4] += 12 * se[4]
outliers[11] -= 15 * se[11]
sets["outliers"] = (v, outliers, se)
# Rises from rest, as the positioning system does.
sets["rising"] = (v / 400, curve(v / 400, 15.2, 23.6, 0.026, 137.0) + 0.3 * rng.standard_normal(v.size), np.full(v.size, 0.3))
rows = list(csv.DictReader(joints.open()))
for name, joint, sign in (("joint1+", "1", 1), ("joint1-", "1", -1), ("joint2+", "2", 1), ("joint2-", "2", -1)):
    chosen = [r for r in rows if r["joint"] == joint and float(r["omega"]) * sign > 0]
    velocity = np.array([float(r["omega"]) for r in chosen])
    tau = np.array([float(r["tau_median"]) for r in chosen])
    sets[name] = (velocity, tau, np.ones(velocity.size))

with (here / "points.csv").open("w", newline="") as file:
    out = csv.writer(file, lineterminator="\n")
    out.writerow(["set", "velocity", "torque", "standard_error"])
    for name, columns in sets.items():
        for row in zip(*columns):
            out.writerow([name, *(repr(float(x)) for x in row)])

with (here / "fits.csv").open("w", newline="") as file:
    out = csv.writer(file, lineterminator="\n")
    out.writerow(["set", "loss", "absolute"] + ["ms", "mk", "vs", "b"] + [f"c{i}{j}" for i in range(4) for j in range(4)])
    for name, (velocity, tau, se) in sets.items():
        speed, level = np.abs(velocity), tau * np.sign(velocity)
        best = None
        for vs in np.geomspace(speed.min(), speed.max(), 25):  # several starts: the best local minimum counts
            start = [level[np.argmin(speed)], np.median(level), vs, 1e-3]
            try:
                p, c = curve_fit(curve, speed, level, start, se, absolute_sigma=False, xtol=1e-15, ftol=1e-15, gtol=1e-15, maxfev=100000)
            except RuntimeError:
                continue
            cost = (((level - curve(speed, *p)) / se) ** 2).sum()
            if p[2] > 0 and (best is None or cost < best[0]):
                best = (cost, p)
        for absolute in (0, 1):
            # A central difference in the last step: curve_fit's own forward difference limits the covariance to 1e-6.
            r = least_squares(lambda p: (curve(speed, *p) - level) / se, best[1], jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale=np.abs(best[1]))
            c = np.linalg.inv(r.jac.T @ r.jac) * (1 if absolute else 2 * r.cost / (speed.size - 4))
            _, plain = curve_fit(curve, speed, level, r.x, se, absolute_sigma=bool(absolute))
            assert np.allclose(c, plain, rtol=1e-4), name
            out.writerow([name, "square", absolute, *(repr(float(x)) for x in [*r.x, *c.ravel()])])
        if name == "outliers":
            r = least_squares(lambda p: (curve(speed, *p) - level) / se, best[1], jac="3-point", loss="huber", f_scale=1.345, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale=np.abs(best[1]))
            out.writerow([name, "huber", 1, *(repr(float(x)) for x in r.x)] + [""] * 16)
