"""Train a network for friction compensation on recordings of `stickslip measure tracking`.

    python train.py RUN [RUN ...] --preset base.toml --out my-bench.toml

RUN is a folder of `stickslip measure tracking`. The recording contains the inputs of the network (columns feature_*) and
its target (friction_torque), computed by the program that will run the network; this script contains no equation.
Every seventh motion is held out from the training. With --preset the output is that preset with the network as its
compensation; default: the compensation alone. The same seed gives the same network.
"""

import argparse
import json
import re
import sys
import warnings
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPRegressor

NEURONS = 16
# Period of held-out motions, and the first one.
HELD_OUT, FIRST_HELD_OUT = 7, 2
# Indices of the features acceleration and long memory.
ACCELERATION, LONG_MEMORY = 1, 5
# Below this magnitude of the long memory a set-point is near a reversal.
NEAR_A_REVERSAL = 0.98


def read(run, within):
    """Return features, friction torque and number of the motion, one row per valid sample, and the settings of the
    features. A sample is invalid at rest, or with a deviation above `within` [rad], where the controller lags."""
    table = parquet.read_table(run / "tracking.parquet")
    results = json.loads((run / "summary.json").read_text())["results"]
    names = [name for name in table.column_names if name.startswith("feature_")]
    features = np.column_stack([table[name].to_numpy() for name in names])
    prefix = "measure.features."
    settings = {name.removeprefix(prefix): r["value"] for name, r in results.items() if name.startswith(prefix)}
    # The holding torque at rest belongs to the controller.
    valid = (features[:, 0] != 0) | (features[:, ACCELERATION] != 0)
    valid &= np.abs(table["setpoint"].to_numpy() - table["angle"].to_numpy()) <= within
    torque, motion = table["friction_torque"].to_numpy(), table["motion"].to_numpy()
    return features[valid], torque[valid], motion[valid], settings


def choose(features, rows, random):
    """Return the indices of `rows` random samples. Up to half of them are near a reversal, which is short."""
    near = np.abs(features[:, LONG_MEMORY]) < NEAR_A_REVERSAL
    reversals = random.permutation(np.flatnonzero(near))[: rows // 2]
    return np.concatenate([reversals, random.permutation(np.flatnonzero(~near))[: rows - len(reversals)]])


def train(features, torque, seed, iterations):
    """Return the network with the offset and scale of its inputs and the unit of its output.

    Friction does not depend on the acceleration. A network with this input learns the oscillations of the loop after fast
    reversals, more with every pass. Its weights are therefore 0; only the region of validity uses the acceleration.
    """
    offset, scale, unit = features.mean(axis=0), features.std(axis=0), torque.std()
    inputs = (features - offset) / scale
    inputs[:, ACCELERATION] = 0
    network = MLPRegressor(hidden_layer_sizes=(NEURONS, NEURONS), activation="tanh", solver="lbfgs", alpha=1e-6, max_iter=iterations,
                           max_fun=10 * iterations, tol=1e-9, random_state=seed)
    with warnings.catch_warnings():
        # The number of iterations limits the training, not convergence.
        warnings.simplefilter("ignore", ConvergenceWarning)
        network.fit(inputs, torque / unit)
    network.coefs_[0][ACCELERATION] = 0
    return network, offset, scale, unit


def text(values):
    """Return a number or nested list as TOML; each number reads back bit-identically."""
    values = np.asarray(values)
    if values.ndim == 0:
        return repr(float(values))
    if values.ndim == 1:
        return "[" + ", ".join(repr(float(value)) for value in values) + "]"
    return "[\n" + "".join(f"  {text(row)},\n" for row in values) + "]"


def toml(network, offset, scale, unit, region, settings, margin):
    """Return the compensation as part of a parameter file."""
    (first, second, output), (first_bias, second_bias, output_bias) = network.coefs_, network.intercepts_
    numbers = {
        "offset": offset, "scale": scale, "smallest": region[0], "largest": region[1], "margin": margin,
        "first": first, "first_bias": first_bias, "second": second, "second_bias": second_bias,
        "output": unit * output[:, 0], "output_bias": unit * output_bias[0],
    }
    lines = ["[bench.compensation]", 'kind = "network"', "", "[bench.compensation.network.features]"]
    lines += [f"{name} = {text(value)}" for name, value in settings.items()]
    lines += ["", "[bench.compensation.network]"] + [f"{name} = {text(value)}" for name, value in numbers.items()]
    return "\n".join(lines) + "\n"


def without_compensation(preset):
    """Return the text of a parameter file without the tables of its compensation."""
    return re.sub(r"(?ms)^\[bench\.compensation\b[^\n]*\n.*?(?=^\[|\Z)", "", preset).rstrip() + "\n\n"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of `stickslip measure tracking`")
    arguments.add_argument("--preset", type=Path, help="parameter file that gets the network as its compensation")
    arguments.add_argument("--out", type=Path, default=Path("network.toml"), help="file to write (default: network.toml)")
    arguments.add_argument("--check", type=Path, help="also write some features with the torque predicted by scikit-learn")
    arguments.add_argument("--within", type=float, default=2e-3, help="largest deviation of a valid sample in rad (default: 0.002)")
    arguments.add_argument("--seed", type=int, default=1, help="seed of initial weights and sample selection (default: 1)")
    arguments.add_argument("--rows", type=int, default=20_000, help="approximate number of training samples (default: 20000)")
    arguments.add_argument("--iterations", type=int, default=500, help="largest number of training steps (default: 500)")
    arguments.add_argument("--margin", type=float, default=0.1, help="width of the fade-out outside the region in standard deviations (default: 0.1)")
    options = arguments.parse_args()

    features, torque, motion, settings = map(list, zip(*(read(run, options.within) for run in options.runs)))
    if any(other != settings[0] for other in settings):
        sys.exit(f"The runs have different settings of the features: {settings}. Record them with the same preset.")
    features, torque, motion = map(np.concatenate, (features, torque, motion))
    held_out = motion % HELD_OUT == FIRST_HELD_OUT
    random = np.random.default_rng(options.seed)
    inputs, target = features[~held_out], torque[~held_out]
    chosen = choose(inputs, options.rows, random)
    network, offset, scale, unit = train(inputs[chosen], target[chosen], options.seed, options.iterations)

    def predict(values):
        return unit * network.predict((values - offset) / scale)

    for name, part in (("trained on", ~held_out), ("held out", held_out)):
        error = predict(features[part]) - torque[part]
        share = 1 - error.var() / torque[part].var()
        print(f"{name}: {part.sum()} samples, error {1e3 * np.sqrt((error**2).mean()):.2f} mN m RMS, "
              f"{100 * share:.2f} % of the variance explained")
    region = inputs.min(axis=0), inputs.max(axis=0)
    contents = toml(network, offset, scale, unit, region, settings[0], options.margin)
    if options.preset:
        contents = without_compensation(options.preset.read_text()) + contents
    options.out.write_text(contents)
    print(f"{network.n_iter_} steps; network written to {options.out}")
    if options.check:
        rows_to_check = inputs[random.permutation(len(inputs))[:16]]
        rows = [",".join(repr(float(value)) for value in [*row, torque]) for row, torque in zip(rows_to_check, predict(rows_to_check))]
        head = ",".join([f"feature_{k}" for k in range(rows_to_check.shape[1])] + ["torque"])
        options.check.write_text("\n".join([head, *rows]) + "\n")


if __name__ == "__main__":
    main()
