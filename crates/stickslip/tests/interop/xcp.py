"""What pyxcp makes of a bench that is served by XCP: reads, writes, pages, and a measurement without a gap.

    stickslip serve --set bench.tick_rate=10000 --xcp-udp --xcp-tcp &
    python3 crates/stickslip/tests/interop/xcp.py udp 127.0.0.1:5555 [SECONDS [SIGNALS]]      # pyxcp 0.29.20

Prints JSON. pyxcp does not notice a gap in the counter of the frames: it is counted here.
"""

import contextlib
import json
import logging
import re
import socket
import struct
import sys
import time
import zlib

from pyxcp.config import create_application_from_config, set_application
from pyxcp.daq_stim import DaqList, DaqOnlinePolicy
from pyxcp.master import Master
from pyxcp.types import XcpGetIdType, XcpResponseError

GAIN = "bench.controller.position_gain"

protocol, place = sys.argv[1].upper(), sys.argv[2]
seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 2.0
count = int(sys.argv[4]) if len(sys.argv) > 4 else 20
host, port = place.rsplit(":", 1)


class Counting(DaqOnlinePolicy):
    """Receives every row, and checks only that none is missing."""

    def initialize(self):
        self.rows, self.gaps, self.late = 0, 0, 0
        self.first, self.last, self.stamp = None, None, None

    def on_daq_list(self, daq_list, timestamp0, timestamp1, payload):
        cycle = payload[self.column]
        self.rows += 1
        if self.last is None:
            self.first = cycle
        else:
            self.gaps += cycle != self.last + 1
            self.late += timestamp1 - self.stamp != self.tick
        self.last, self.stamp = cycle, timestamp1

    def finalize(self):
        pass


class Frames:
    """Counts frames and the gaps of their counter."""

    def __init__(self):
        self.last, self.count, self.gaps = None, 0, 0
        self.rest = b""

    def feed(self, data):
        data = self.rest + bytes(data)
        while len(data) >= 4:
            length, counter = struct.unpack_from("<HH", data)
            if len(data) < 4 + length:
                break
            self.count += 1
            self.gaps += self.last is not None and counter != (self.last + 1) & 0xFFFF
            self.last = counter
            data = data[4 + length :]
        self.rest = data


def tapped(transport):
    """Receives all raw bytes; installed before the transport is connected."""
    frames = Frames()
    packets = transport._packets

    class Tap(type(packets)):
        def append(self, item):
            frames.feed(item[0])
            super().append(item)

    transport._packets = Tap(packets)
    return frames


def refusal(call):
    try:
        call()
    except XcpResponseError as error:
        return str(error.args[0]["error"] if isinstance(error.args[0], dict) else error.args[0])
    return None


app = create_application_from_config(
    {"Transport": {"Eth": {"host": host, "port": int(port), "protocol": protocol}}, "General": {"disable_error_handling": True}},
    logging.ERROR,
)
app.transport.layer = "ETH"
set_application(app)
policy = Counting([])
seen = {}
master = Master("eth", app, policy=policy)
if protocol == "UDP":
    # Datagrams that find no room in the receiver's buffer are lost. More than `net.core.rmem_max` takes a privilege.
    for option in (socket.SO_RCVBUF, getattr(socket, "SO_RCVBUFFORCE", 33)):
        with contextlib.suppress(OSError):
            master.transport.sock.setsockopt(socket.SOL_SOCKET, option, 16 << 20)
frames = tapped(master.transport)
with master as xcp:
    xcp.connect()
    xcp.getStatus()
    seen["name"] = xcp.identifier(XcpGetIdType.FILENAME)
    begin = time.perf_counter()
    a2l = xcp.identifier(XcpGetIdType.FILE_TO_UPLOAD)
    seen["a2l_bytes"], seen["a2l_seconds"] = len(a2l), time.perf_counter() - begin
    measurements = {name: int(at, 16) for name, at in re.findall(r"/begin MEASUREMENT (\S+) .*? ECU_ADDRESS (\S+)", a2l)}
    parameters = {name: int(at, 16) for name, at in re.findall(r'/begin CHARACTERISTIC (\S+) ".*?" VALUE (\S+)', a2l)}
    epk = re.search(r'ADDR_EPK (\S+) EPK "(.*?)"', a2l)
    seen["epk"] = bytes(xcp.shortUpload(len(epk[2]), int(epk[1], 16))).decode() == epk[2]
    seen["measurements"], seen["parameters"] = len(measurements), len(parameters)

    def read(name):
        return struct.unpack("<d", xcp.shortUpload(8, {**parameters, **measurements}[name]))[0]

    def write(name, value):
        xcp.setMta(parameters[name])
        xcp.download(struct.pack("<d", value))

    seen["values"] = len([read(name) for name in {**parameters, **measurements}])
    before = read(GAIN)
    write(GAIN, 11.5)
    seen["written"] = read(GAIN) == 11.5
    seen["refused"] = refusal(lambda: write(GAIN, -1.0))
    seen["wild"] = refusal(lambda: xcp.shortUpload(8, 0xDEADBEEF))
    # Pages: two values that must be set together, since neither fits the active ones.
    segments = xcp.getPagProcessorInfo().maxSegments
    address, length = (xcp.getSegmentInfo(0, 0, part, 0).basicInfo for part in (0, 1))
    xcp.setCalPage(0x01, 0, 1)
    reference = read(GAIN)
    ends = [read(f"bench.safety.{end}_end") for end in ("lower", "upper")]
    write("bench.safety.lower_end", 200.0)
    write("bench.safety.upper_end", 300.0)
    collected = [xcp.getCalPage(1, 0), xcp.getCalPage(2, 0)]
    xcp.setCalPage(0x01, 0, 0)
    seen["pages"] = {
        "segments": segments,
        "collected": collected,
        "working": read("bench.safety.lower_end") == 200.0 and reference == 11.5,
    }
    xcp.setCalPage(0x02, 0, 1)
    seen["pages"]["reference"] = read("bench.safety.lower_end") == ends[0] and read(GAIN) == before
    seen["pages"]["protected"] = refusal(lambda: write(GAIN, 11.0))
    xcp.setCalPage(0x02, 0, 0)
    xcp.copyCalPage(0, 1, 0, 0)
    seen["pages"]["copied"] = read(GAIN) == before
    xcp.setMta(address)
    memory = bytes(xcp.fetch(length))
    xcp.setMta(address)
    seen["checksum"] = xcp.buildChecksum(length).checksum == zlib.crc32(memory)

    # The measurement.
    names = ["cycle"] + [name for name in measurements if name != "cycle"][: count - 1]
    event = xcp.getDaqEventInfo(0)
    policy.daq_lists.append(
        DaqList("all", 0, False, True, [(name, measurements[name], 0, "F64") for name in names], 0, 1)
    )
    policy.is_predefined = [False]
    policy.setup()
    policy.tick = event.eventChannelTimeCycle * 10 ** int(event.eventChannelTimeUnit)
    policy.column = [header[0] for header in policy.daq_lists[0].headers].index("cycle")
    frames.count = frames.gaps = 0
    policy.start()
    begin, used = time.perf_counter(), time.process_time()
    time.sleep(seconds)
    took, used = time.perf_counter() - begin, time.process_time() - used
    policy.stop()
    time.sleep(0.5)
    seen["measurement"] = {
        "signals": len(names),
        "seconds": took,
        "rows": policy.rows,
        "rows_per_second": policy.rows / took,
        "cycle_gaps": policy.gaps,
        "cycles": None if policy.first is None else policy.last - policy.first + 1,
        "time_gaps": policy.late,
        "frames": frames.count,
        "frame_gaps": frames.gaps,
        "client_cpu": used / took,
    }
    xcp.disconnect()

print(json.dumps(seen, indent=2))
