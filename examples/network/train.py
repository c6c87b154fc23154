"""Trains a network for the compensation of friction on recordings of `stickslip measure tracking`.

    python train.py RUN [RUN ...] --preset base.toml --out my-bench.toml

RUN is a folder of `stickslip measure tracking`. What the network sees (the columns feature_*) and what it shall give
(friction_torque) the recording holds already, computed by the program that will run the network: no equation stands here.
Every seventh motion is held out and never trained on. With --preset the file that is written is that preset with the
network as its compensation, else the compensation alone. The same seed gives the same network.
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
# Every so many motions one is held out, from this one on.
HELD_OUT, FIRST_HELD_OUT = 7, 2
# Which feature is the acceleration, and which the long memory.
ACCELERATION, LONG_MEMORY = 1, 5
# Until its long memory has this size a set-point is near a reversal.
NEAR_A_REVERSAL = 0.98


def read(run, within):
    """Features, friction torque and number of the motion, a row a sample that counts, and what the features were computed
    with. Where the deviation is more than `within`, the torque is that of a controller which is behind."""
    table = parquet.read_table(run / "tracking.parquet")
    results = json.loads((run / "summary.json").read_text())["results"]
    names = [name for name in table.column_names if name.startswith("feature_")]
    features = np.column_stack([table[name].to_numpy() for name in names])
    prefix = "measure.features."
    made_with = {name.removeprefix(prefix): r["value"] for name, r in results.items() if name.startswith(prefix)}
    # What is held at rest is the controller's.
    counts = (features[:, 0] != 0) | (features[:, ACCELERATION] != 0)
    counts &= np.abs(table["setpoint"].to_numpy() - table["angle"].to_numpy()) <= within
    torque, motion = table["friction_torque"].to_numpy(), table["motion"].to_numpy()
    return features[counts], torque[counts], motion[counts], made_with


def choose(features, rows, random):
    """So many samples, half of them near a reversal where there are as many: the bend there is short."""
    near = np.abs(features[:, LONG_MEMORY]) < NEAR_A_REVERSAL
    bent = random.permutation(np.flatnonzero(near))[: rows // 2]
    return np.concatenate([bent, random.permutation(np.flatnonzero(~near))[: rows - len(bent)]])


def train(features, torque, seed, iterations):
    """The network, and what its inputs and its output are normalised by.

    Friction does not ask for the acceleration. A network that may look at it learns the swings of the loop after fast
    reversals, and from pass to pass more of them: its weights are 0, and the region alone knows of it.
    """
    offset, scale, unit = features.mean(axis=0), features.std(axis=0), torque.std()
    seen = (features - offset) / scale
    seen[:, ACCELERATION] = 0
    network = MLPRegressor(hidden_layer_sizes=(NEURONS, NEURONS), activation="tanh", solver="lbfgs", alpha=1e-6, max_iter=iterations,
                           max_fun=10 * iterations, tol=1e-9, random_state=seed)
    with warnings.catch_warnings():
        # It ends when it is good enough, not when nothing changes any more.
        warnings.simplefilter("ignore", ConvergenceWarning)
        network.fit(seen, torque / unit)
    network.coefs_[0][ACCELERATION] = 0
    return network, offset, scale, unit


def text(values):
    """A list of numbers, or of lists, as TOML; each number reads back to its bits."""
    values = np.asarray(values)
    if values.ndim == 0:
        return repr(float(values))
    if values.ndim == 1:
        return "[" + ", ".join(repr(float(value)) for value in values) + "]"
    return "[\n" + "".join(f"  {text(row)},\n" for row in values) + "]"


def toml(network, offset, scale, unit, region, made_with, margin):
    """The compensation as it stands in a parameter file."""
    (first, second, output), (first_bias, second_bias, output_bias) = network.coefs_, network.intercepts_
    numbers = {
        "offset": offset, "scale": scale, "smallest": region[0], "largest": region[1], "margin": margin,
        "first": first, "first_bias": first_bias, "second": second, "second_bias": second_bias,
        "output": unit * output[:, 0], "output_bias": unit * output_bias[0],
    }
    lines = ["[bench.compensation]", 'kind = "network"', "", "[bench.compensation.network.features]"]
    lines += [f"{name} = {text(value)}" for name, value in made_with.items()]
    lines += ["", "[bench.compensation.network]"] + [f"{name} = {text(value)}" for name, value in numbers.items()]
    return "\n".join(lines) + "\n"


def without_compensation(preset):
    """A parameter file's text without the tables of its compensation."""
    return re.sub(r"(?ms)^\[bench\.compensation\b[^\n]*\n.*?(?=^\[|\Z)", "", preset).rstrip() + "\n\n"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of stickslip measure tracking")
    arguments.add_argument("--preset", type=Path, help="parameter file whose compensation the network becomes")
    arguments.add_argument("--out", type=Path, default=Path("network.toml"), help="file to write")
    arguments.add_argument("--check", type=Path, help="write some features with the torque that scikit-learn predicts")
    arguments.add_argument("--within", type=float, default=2e-3, help="largest deviation of a sample that counts, in rad")
    arguments.add_argument("--seed", type=int, default=1, help="chooses first weights and samples")
    arguments.add_argument("--rows", type=int, default=20_000, help="samples to train on, about")
    arguments.add_argument("--iterations", type=int, default=500, help="steps of the training, at most")
    arguments.add_argument("--margin", type=float, default=0.1, help="where it fades out, in standard deviations")
    options = arguments.parse_args()

    features, torque, motion, made_with = map(list, zip(*(read(run, options.within) for run in options.runs)))
    if any(other != made_with[0] for other in made_with):
        sys.exit(f"The runs have different features: {made_with}. Record them with the same preset.")
    features, torque, motion = map(np.concatenate, (features, torque, motion))
    held_out = motion % HELD_OUT == FIRST_HELD_OUT
    random = np.random.default_rng(options.seed)
    known, wanted = features[~held_out], torque[~held_out]
    chosen = choose(known, options.rows, random)
    network, offset, scale, unit = train(known[chosen], wanted[chosen], options.seed, options.iterations)

    def predict(values):
        return unit * network.predict((values - offset) / scale)

    for name, part in (("trained on", ~held_out), ("held out", held_out)):
        error = predict(features[part]) - torque[part]
        share = 1 - error.var() / torque[part].var()
        print(f"{name}: {part.sum()} samples, error {1e3 * np.sqrt((error**2).mean()):.2f} mN m RMS, "
              f"{100 * share:.2f} % of the variance explained")
    region = known.min(axis=0), known.max(axis=0)
    written = toml(network, offset, scale, unit, region, made_with[0], options.margin)
    if options.preset:
        written = without_compensation(options.preset.read_text()) + written
    options.out.write_text(written)
    print(f"{network.n_iter_} steps; the network: {options.out}")
    if options.check:
        some = known[random.permutation(len(known))[:16]]
        rows = [",".join(repr(float(value)) for value in [*row, torque]) for row, torque in zip(some, predict(some))]
        head = ",".join([f"feature_{k}" for k in range(some.shape[1])] + ["torque"])
        options.check.write_text("\n".join([head, *rows]) + "\n")


if __name__ == "__main__":
    main()
