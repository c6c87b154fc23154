"""Recordings as other tools write them, for the readers' tests.

    python3 tests/reference/recording/make.py      # SciPy 1.17, pyarrow 26
"""

import json
import pathlib

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io

here = pathlib.Path(__file__).parent
time = np.arange(50) * 1e-3
position = 0.1 * np.sin(40 * time)
counts = np.round(position * 1e4).astype(np.int16)
signals = {
    "t": time,  # one row
    "x": position[:, None],  # one column
    "n": counts,
    "both": np.column_stack([position, 2 * position]),
    "gain": 35.15,  # no vector
    "name": "axis",  # no number
    "z": position + 1j * position,  # not real
}
scipy.io.savemat(here / "plain.mat", signals)
scipy.io.savemat(here / "compressed.mat", signals, do_compression=True)

table = pa.table(
    {
        "t": pa.array((time * 1e6).astype(np.int64), pa.timestamp("us")),
        "x": position * 1e3,
        "n": counts.astype(np.int32),
        "lost": pa.array([None if i == 30 else 1.0 for i in range(50)], pa.float64()),
        "word": ["a"] * 50,
    }
)
units = {"units": json.dumps({"x": "mm"})}
pq.write_table(table.replace_schema_metadata(units), here / "snappy.parquet", compression="snappy", row_group_size=20)
pq.write_table(table, here / "zstd.parquet", compression="zstd")
