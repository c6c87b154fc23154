"""SciPy's curve_fit (lm, Jacobian given) on the points of a file: nanoseconds of the fastest fit, parameters, RMS residual.

curve_fit.py FILE START...: FILE holds the count of points, speeds and torques, all as doubles."""

import sys
import time

import numpy as np
from scipy.optimize import curve_fit

numbers = np.fromfile(sys.argv[1])
count = int(numbers[0])
speeds, torques = numbers[1 : 1 + count], numbers[1 + count :]
start = [float(word) for word in sys.argv[2:6]]


def curve(v, breakaway, kinetic, velocity, viscous):
    return kinetic + (breakaway - kinetic) * np.exp(-v / velocity) + viscous * v


def jacobian(v, breakaway, kinetic, velocity, viscous):
    e = np.exp(-v / velocity)
    return np.column_stack([e, 1.0 - e, (breakaway - kinetic) * e * v / velocity**2, v])


fastest = np.inf
for _ in range(50):
    begin = time.perf_counter_ns()
    found, _ = curve_fit(curve, speeds, torques, p0=start, jac=jacobian, method="lm")
    fastest = min(fastest, time.perf_counter_ns() - begin)
rms = np.sqrt(np.mean((torques - curve(speeds, *found)) ** 2))
print(fastest, *(repr(float(number)) for number in [*found, rms]))
