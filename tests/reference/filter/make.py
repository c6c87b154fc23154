"""Reference results of zero-phase filters by SciPy.

    python3 tests/reference/filter/make.py

writes numbers.csv beside itself: a name and its values per line. Made with SciPy 1.17.1, NumPy 2.4.6.
"""

import pathlib

import numpy as np
from scipy import signal

rng = np.random.default_rng(1)
n = 150
x = 0.3 + np.sin(2 * np.pi * 7e-3 * np.arange(n)) + 0.1 * rng.standard_normal(n)
lines = {
    "signal": x,
    "butterworth4": signal.sosfiltfilt(signal.butter(4, 100, fs=1000, output="sos"), x),
    "butterworth3": signal.sosfiltfilt(signal.butter(3, 20, fs=1000, output="sos"), x),
    "chebyshev8": signal.sosfiltfilt(signal.cheby1(8, 0.05, 40, fs=1000, output="sos"), x),
    "chebyshev5": signal.sosfiltfilt(signal.cheby1(5, 1.0, 150, fs=1000, output="sos"), x),
    "decimate10": signal.decimate(x, 10),
    "decimate3": signal.decimate(x, 3),
    "gradient": np.gradient(x, 1e-3),
}
with (pathlib.Path(__file__).parent / "numbers.csv").open("w") as file:
    for name, values in lines.items():
        file.write(",".join([name, *(repr(float(v)) for v in values)]) + "\n")
