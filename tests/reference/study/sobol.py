"""Points of Sobol's sequence by SciPy, as integers of 32 bits: index, then 64 dimensions.

    pip install scipy==1.17.1
    python sobol.py > sobol.csv
"""

from scipy.stats import qmc

points = qmc.Sobol(64, scramble=False, bits=32).random(4096)
for index in [0, 1, 2, 3, 4, 5, 6, 7, 8, 100, 1000, 1023, 2047, 4095]:
    print(",".join([str(index)] + [str(int(x * 2**32)) for x in points[index]]))
