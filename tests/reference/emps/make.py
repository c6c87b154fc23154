"""Inverse-dynamics least squares of the EMPS record by NumPy and SciPy.

    python3 tests/reference/emps/make.py

writes numbers.csv beside itself: a name and its values per line. Made with SciPy 1.17.1, NumPy 2.4.6.
"""

import gzip
import pathlib

import numpy as np
from scipy import signal

here = pathlib.Path(__file__).parent
with gzip.open(here.parents[2] / "data" / "emps" / "emps.csv.gz") as file:
    record = np.genfromtxt(file, delimiter=",", names=True)

gain, period, skip, factor = 35.15065188248547, 1e-3, 50, 10
position = signal.sosfiltfilt(signal.butter(4, 100, fs=1000, output="sos"), record["qm"])
velocity = np.gradient(position, period)
acceleration = np.gradient(velocity, period)
forward, backward = (velocity > 0).astype(float), (velocity < 0).astype(float)
one = np.ones_like(velocity)

lines = {}
for name, columns in {
    "symmetric": [acceleration, velocity, np.sign(velocity), one],
    "asymmetric": [acceleration, forward * velocity, forward, backward * velocity, -backward],
}.items():
    force = signal.decimate(gain * record["vir"][skip:], factor)
    rows = np.column_stack([signal.decimate(column[skip:], factor) for column in columns])
    coefficients, _, _, singular = np.linalg.lstsq(rows, force)
    residual = force - rows @ coefficients
    n, k = rows.shape
    inverse = np.linalg.inv(rows.T @ rows)
    lag = int(np.ceil(1.3 * np.sqrt(n)))
    moments = rows * residual[:, None]
    meat = moments.T @ moments
    for l in range(1, lag + 1):
        product = moments[l:].T @ moments[:-l]
        meat += (1 - l / (lag + 1)) * (product + product.T)
    lines[name] = coefficients
    lines[name + " standard errors"] = np.sqrt(np.diag(inverse @ meat @ inverse) * n / (n - k))
    lines[name + " white standard errors"] = np.sqrt(np.diag(inverse) * (residual @ residual) / (n - k))
    lines[name + " condition, relative error"] = [singular[0] / singular[-1], np.linalg.norm(residual) / np.linalg.norm(force)]

with (here / "numbers.csv").open("w") as file:
    for name, values in lines.items():
        file.write(";".join([name, *(repr(float(v)) for v in values)]) + "\n")
