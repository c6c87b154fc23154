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

# Structures as Simulink (structure with time), ControlDesk (two rasters) and To File write them.
few = slice(0, 20)
t, x, u = time[few], position[few], np.cos(40 * time[few])
signal_fields = [("values", "O"), ("dimensions", "O"), ("label", "O")]
scope = np.array([(x[:, None], 1.0, "pos"), (np.column_stack([u, 2 * u]), 2.0, "")], dtype=signal_fields)
scipy.io.savemat(here / "simulink.mat", {"logs": {"time": t[:, None], "signals": scope, "blockName": "m/Scope"}})
fields = ["Name", "Data", "Unit"]
stamps = np.array([("t", t, "s"), ("t", t[::5], "s")], dtype=[(name, "O") for name in fields])
traces = [("pos", x, "mm", 1.0), ("cmd", u, "V", 1.0), ("temperature", 20 + t[::5], "-", 2.0)]
traces = np.array(traces, dtype=[(name, "O") for name in [*fields, "XIndex"]])
scipy.io.savemat(here / "controldesk.mat", {"exp_001": {"X": stamps, "Y": traces}}, do_compression=True)
scipy.io.savemat(here / "to_file.mat", {"ans": np.vstack([t, x, u])})
scipy.io.savemat(here / "longer.mat", {"t": np.append(t, 0.020), "x": x, "u": u, "other": x[:7]})

# Rasters of a calibration tool: a fast one, a slow one with more signals and a repeated name, and one beside the grid.
with asammdf.MDF(version="4.10") as mdf:
    fast = [signal("pos", position, "mm"), signal("cmd", np.cos(40 * time), "V")]
    mdf.append(fast, comment="1ms")
    slow = [("pos", position), ("temperature", 20 + time), ("state", np.floor(time * 100)), ("spare", position)]
    mdf.append([asammdf.Signal(values[::10], time[::10], name=name) for name, values in slow], comment="10ms")
    beside = asammdf.Signal(3 * time[:-1] + 3 * 2e-4, time[:-1] + 2e-4, name="ramp", unit="V")
    mdf.append([beside], comment="other")
    mdf.save(here / "rasters.mf4", overwrite=True, compression=2)

rows = np.arange(20)
since_1970 = 1_709_632_360_000_000_000 + 250_000 * rows
types = {
    "s": pa.array(1_709_632_360 + rows, pa.timestamp("s")),
    "ms": pa.array(1_709_632_360_000 + rows, pa.timestamp("ms")),
    "ns": pa.array(since_1970, pa.timestamp("ns", tz="UTC")),
    "raw": since_1970,
    "u8": (250 - rows).astype(np.uint8),
    "u16": (65_000 + rows).astype(np.uint16),
    "u32": (2**31 - 10 + rows).astype(np.uint32),
    "u64": 2**63 - 10 + rows.astype(np.uint64),
    "levels": pa.array(np.round(x, 3)).dictionary_encode(),
    "words": pa.array(["a", "b"] * 10).dictionary_encode(),
}
pq.write_table(pa.table(types), here / "types.parquet")
pq.write_table(pa.table({"ns": types["ns"], "x": x}), here / "int96.parquet", use_deprecated_int96_timestamps=True)
