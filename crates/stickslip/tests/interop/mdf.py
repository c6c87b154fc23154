"""Contents of a recording read by asammdf: JSON, and the values as raw numbers if a folder is given.

    python3 crates/stickslip/tests/interop/mdf.py run.mf4 [FOLDER]      # asammdf 8.8.28

Whatever asammdf logs or warns of is an error, and so are signals that another view of the file shows differently.
"""

import json
import logging
import pathlib
import sys
import warnings

import asammdf
import numpy as np
from asammdf.blocks.v4_constants import EVENT_CAUSE_ERROR, EVENT_CAUSE_USER

warnings.simplefilter("error")
logged = []
handler = logging.Handler()
handler.emit = lambda record: logged.append(record.getMessage())
logging.getLogger("asammdf").addHandler(handler)
logging.getLogger("asammdf").setLevel(logging.INFO)

path = pathlib.Path(sys.argv[1])
out = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else None
causes = {EVENT_CAUSE_ERROR: "Error", EVENT_CAUSE_USER: "User"}

with asammdf.MDF(path) as mdf:
    (group,) = mdf.groups
    names = [channel.name for channel in group.channels]
    frame = mdf.to_dataframe(time_from_zero=False)
    signals = []
    for index, name in enumerate(names):
        signal = mdf.get(name, group=0, index=index)
        data = signal.timestamps if index == 0 else signal.samples
        if index > 0:
            assert np.array_equal(data, frame[name], equal_nan=True), name
            assert np.array_equal(signal.timestamps, frame.index), name
        if out:
            (out / f"{index}").write_bytes(data.tobytes())
        signals.append({"name": name, "unit": signal.unit, "comment": signal.comment, "type": str(data.dtype)})
    times = mdf.get_master(0)
    assert (np.diff(times) > 0).all(), "time does not go up"
    info = mdf.info()
    contents = {
        "version": mdf.version,
        "finalized": mdf.identification.file_identification == b"MDF     " and not mdf.identification["unfinalized_standard_flags"],
        "start": mdf.header.abs_time,
        "start_time": mdf.start_time.isoformat(),
        "comment": mdf.header.description,
        "properties": mdf.header._common_properties,
        "history": [entry.comment for entry in mdf.file_history],
        "groups": info["groups"],
        "cycles": group.channel_group.cycles_nr,
        "rows": len(frame),
        "signals": signals,
        "events": [
            {"time": e.value, "index": e.sync_base, "name": e.name, "comment": e.comment, "cause": causes.get(e.cause, "?")}
            for e in mdf.events
        ],
        "attachments": [
            {"name": a.file_name, "mime": a.mime, "text": a.extract().decode()} for a in mdf.attachments
        ],
    }

print(json.dumps(contents, indent=2))
if logged:
    sys.exit("messages of asammdf:\n" + "\n".join(logged))
