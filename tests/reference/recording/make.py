"""Recordings as other tools write them, for the readers' tests.

    python3 tests/reference/recording/make.py      # SciPy 1.17, pyarrow 26, asammdf 8.8.28
"""

import datetime
import json
import pathlib

import asammdf
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

# As other tools log it: a raw count with its conversion, a flag with a text for each value, a channel that is valid
# only at times, a second raster. asammdf stores whole bytes in Intel's order.
def signal(name, samples, unit="", conversion=None, **more):
    return asammdf.Signal(samples, time[: len(samples)], name=name, unit=unit, conversion=conversion, **more)


linear = {"a": 1e-4, "b": 0.0}
texts = {"val_0": 0, "text_0": b"off", "val_1": 1, "text_1": b"on", "default": b"?"}
lost = np.arange(50) == 30
for name, compression in (("plain", 0), ("zipped", 1), ("transposed", 2)):
    with asammdf.MDF(version="4.10") as mdf:
        mdf.start_time = datetime.datetime(2026, 3, 1, 8, 30, tzinfo=datetime.UTC)
        # Lists of small blocks instead of one.
        mdf.configure(write_fragment_size=256)
        mdf.append(
            [
                signal("x", counts, "m", linear),
                signal("x32", position.astype(np.float32), "m"),
                signal("flag", (counts > 0).astype(np.uint8), "", texts),
                signal("lost", position, "m", invalidation_bits=lost),
            ]
        )
        mdf.append([signal("slow", position[:5], "m")])
        mdf.save(here / f"{name}.mf4", overwrite=True, compression=compression)
