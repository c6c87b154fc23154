"""An FMU that serves XCP (FMI-LS-XCP): a master measures and calibrates while FMPy simulates."""

import contextlib
import re
import shutil
import socket
import struct
import subprocess
import time
import zipfile

import numpy as np
import pytest

fmpy = pytest.importorskip("fmpy")
from fmpy.validation import validate_fmu  # noqa: E402
from importer import Importer  # noqa: E402

if shutil.which("cc") is None:
    pytest.skip("there is no C compiler", allow_module_level=True)

BLOCK = "position_controller"
VERSIONS = pytest.mark.parametrize("version", [2, 3])
TRANSPORTS = pytest.mark.parametrize("transport", ["tcp", "udp"])
PLACE = "extra/org.fmi-standard.fmi-ls-xcp"


@pytest.fixture(scope="module")
def fmus(program, tmp_path_factory):
    folder = tmp_path_factory.mktemp("fmu-xcp")
    subprocess.run([program, "generate", "fmu", BLOCK, "--xcp", "5599", "--out", folder, "--quiet"], check=True)
    subprocess.run([program, "generate", "fmu", BLOCK, "--out", folder / "mute", "--quiet"], check=True)
    return folder


@pytest.fixture(scope="module")
def importers(fmus):
    return {version: Importer(fmus / f"{BLOCK}-fmi{version}.fmu") for version in (2, 3)}


@pytest.fixture(scope="module")
def described(fmus):
    """Addresses of all measurements and of all parameters, by name."""
    with zipfile.ZipFile(fmus / f"{BLOCK}-fmi3.fmu") as archive:
        text = archive.read(f"{PLACE}/{BLOCK}.a2l").decode()
    measured = re.findall(r"/begin MEASUREMENT (\S+) .*? ECU_ADDRESS (\S+)", text)
    changed = re.findall(r'/begin CHARACTERISTIC (\S+) ".*?" VALUE (\S+)', text)
    return {name: int(address, 16) for name, address in measured}, {name: int(address, 16) for name, address in changed}


def free_port():
    with socket.socket() as it:
        it.bind(("127.0.0.1", 0))
        return it.getsockname()[1]


def configure(instance, settings):
    """Set transport, address and port of the XCP service."""
    fmu, references = instance.fmu, instance.of.references
    if instance.of.version == 3:
        fmu.enterConfigurationMode()
    for name, value in settings.items():
        kind = "Boolean" if isinstance(value, bool) else "String" if isinstance(value, str) else "Integer" if instance.of.version == 2 else "UInt16"
        getattr(fmu, f"set{kind}")([references[f"xcp.{name}"]], [value])
    if instance.of.version == 3:
        fmu.exitConfigurationMode()


def served(of, transport="tcp"):
    """Return a started instance and its port."""
    instance, port = of.bare(), free_port()
    configure(instance, {"tcp.enable": transport == "tcp", "udp.enable": transport == "udp", f"{transport}.port": port})
    instance.begin()
    return instance, port


class Refused(Exception):
    pass


class Master:
    """Minimal XCP master. Asserts that frame counters have no gap."""

    def __init__(self, port, transport="tcp"):
        self.stream = transport == "tcp"
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM if self.stream else socket.SOCK_DGRAM)
        self.socket.settimeout(5.0)
        self.socket.connect(("127.0.0.1", port))
        self.rest, self.counter, self.sent, self.rows, self.texts = b"", 0, 0, [], []
        self.connected = self("ff00")

    def close(self):
        self.socket.close()

    def send(self, packet):
        self.socket.sendall(struct.pack("<HH", len(packet), self.sent) + packet)
        self.sent = (self.sent + 1) & 0xFFFF

    def frame(self):
        while True:
            if len(self.rest) >= 4:
                length, counter = struct.unpack_from("<HH", self.rest)
                if len(self.rest) >= 4 + length:
                    packet, self.rest = self.rest[4 : 4 + length], self.rest[4 + length :]
                    assert counter == self.counter
                    self.counter = (self.counter + 1) & 0xFFFF
                    return packet
            more = self.socket.recv(1 << 16)
            if not more:
                raise ConnectionError
            self.rest += more

    def __call__(self, packet):
        self.send(bytes.fromhex(packet) if isinstance(packet, str) else packet)
        while True:
            answer = self.frame()
            if answer[0] == 0xFF:
                return answer[1:]
            if answer[0] == 0xFE:
                raise Refused(answer[1])
            if answer[0] == 0xFC:
                self.texts.append(answer[2:].split(b"\0")[0].decode())
            else:
                self.rows.append(answer)

    def read(self, address, count=1):
        return struct.unpack(f"<{count}d", self(struct.pack("<BBBBI", 0xF4, 8 * count, 0, 0, address)))

    def write(self, address, *values):
        self(struct.pack("<BBBBI", 0xF6, 0, 0, 0, address))
        self(struct.pack(f"<BB{len(values)}d", 0xF0, 8 * len(values), *values))

    def measure(self, packets, prescaler=1):
        """Start one DAQ list with one packet per row of addresses."""
        self("d6")
        self("d5000100")
        self(struct.pack("<BBHB", 0xD4, 0, 0, len(packets)))
        for number, addresses in enumerate(packets):
            self(struct.pack("<BBHBB", 0xD3, 0, 0, number, len(addresses)))
        for number, addresses in enumerate(packets):
            self(struct.pack("<BBHBB", 0xE2, 0, 0, number, 0))
            for address in addresses:
                self(struct.pack("<BBBBI", 0xE1, 0xFF, 8, 0, address))
        self(struct.pack("<BBHHBB", 0xE0, 0x10, 0, 0, prescaler, 0))
        self("de020000")
        self("dd01")

    def take(self, count):
        while len(self.rows) < count:
            self.rows.append(self.frame())
        rows, self.rows = self.rows[:count], self.rows[count:]
        return rows

    def refused(self, code, act, *arguments):
        with pytest.raises(Refused) as caught:
            act(*arguments)
        assert caught.value.args[0] == code


@VERSIONS
def test_an_fmu_with_a_service_is_valid_and_declares_it(fmus, version):
    file = fmus / f"{BLOCK}-fmi{version}.fmu"
    assert validate_fmu(str(file)) == []
    with zipfile.ZipFile(file) as archive:
        platform = "linux64" if version == 2 else "x86_64-linux"
        texts = {archive.read(f"{PLACE}/{folder}{BLOCK}.a2l") for folder in ("", f"{platform}/")}
        manifest = archive.read(f"{PLACE}/fmi-ls-manifest.xml").decode()
    assert len(texts) == 1 and b"/include" not in texts.pop()
    assert f'definition="{BLOCK}.a2l"' in manifest and manifest.count("<Variable ") == 6


@VERSIONS
@TRANSPORTS
def test_each_step_is_measured_with_the_bits_of_the_importer(importers, described, version, transport):
    of, (measured, _) = importers[version], described
    instance, port = served(of, transport)
    master = Master(port, transport)
    names = [name for name in measured if name.startswith("output.")]
    assert names and len(names) <= 100
    master.measure([[measured["time"]], [measured[name] for name in names]])
    dt, expected, inputs = float(of.description.defaultExperiment.stepSize), [], of.names("input")
    start = instance.get(inputs)
    random = np.random.default_rng(1)
    for k in range(300):
        instance.set(dict(zip(inputs, start + random.normal(scale=0.1, size=len(inputs)))))
        instance.step(k * dt, dt)
        expected.append(instance.get([name.replace("][", ",") for name in names]))
    rows = master.take(600)
    for k, (first, second) in enumerate(zip(rows[::2], rows[1::2])):
        assert (first[0], second[0], first[1], second[1]) == (0, 1, 0, 0)
        stamp, seconds = struct.unpack("<Id", first[2:])
        assert seconds == (k + 1) * dt and stamp == int((k + 1) * dt * 1e6 * (1 + 1e-12))
        np.testing.assert_array_equal(struct.unpack(f"<{len(names)}d", second[2:]), expected[k])
    assert len({row[2:] for row in rows[1::2]}) > 250
    # A slower list; its last row arrives although the simulation ends.
    master.measure([[measured["time"]]], prescaler=7)
    for k in range(300, 321):
        instance.step(k * dt, dt)
    instance.fmu.terminate()
    assert [struct.unpack("<Id", row[2:])[1] for row in master.take(3)] == [(k + 1) * dt for k in (300, 307, 314)]
    instance.free()
    master.close()


@VERSIONS
def test_a_parameter_changed_by_a_master_is_active_from_the_next_step(importers, described, version):
    of, (measured, changed) = importers[version], described
    instance, port = served(of)
    master = Master(port)
    names = {name: name.replace("][", ",") for name in changed}
    for name, address in changed.items():
        assert master.read(address)[0] == instance.get([names[name]])[0], name
    limit = next(name for name in changed if name.endswith("torque_limit"))
    before = instance.get([names[limit]])[0]
    master.write(changed[limit], 0.5 * before)
    assert instance.get([names[limit]])[0] == 0.5 * before == master.read(changed[limit])[0]
    # Refused: a value outside its range or non-finite, writing a computed value, an unknown address.
    for value in (-1.0, np.nan, np.inf):
        master.refused(0x22, master.write, changed[limit], value)
    assert any("torque_limit" in text for text in master.texts) and any("finite" in text for text in master.texts)
    master.refused(0x23, master.write, measured["time"], 1.0)
    for address in (0, changed[limit] + 1, 0xDEADBEEF, 0xFFFFFFF8):
        master.refused(0x24, master.read, address)
    assert instance.get([names[limit]])[0] == 0.5 * before
    assert master("fa01")[3:] == struct.pack("<I", len(BLOCK)) and master(bytes([0xF5, len(BLOCK)])) == BLOCK.encode()
    instance.free()
    master.close()


@VERSIONS
def test_a_master_does_not_change_the_results(fmus, importers, described, version):
    of, mute = importers[version], Importer(fmus / "mute" / f"{BLOCK}-fmi{version}.fmu")
    measured, _ = described
    courses = []
    for importer in (of, mute):
        instance, port = served(importer) if importer is of else (importer.instance(), None)
        master = Master(port) if port else None
        if master:
            master.measure([list(measured.values())[:100]])
        dt, course, inputs = float(importer.description.defaultExperiment.stepSize), [], importer.names("input")
        start, random = instance.get(inputs), np.random.default_rng(2)
        for k in range(200):
            instance.set(dict(zip(inputs, start + random.normal(scale=0.1, size=len(inputs)))))
            instance.step(k * dt, dt)
            course.append(instance.get(importer.names("output")))
            if master:
                master.read(measured["time"])
        courses.append(course)
        instance.free()
        if master:
            master.close()
    np.testing.assert_array_equal(*courses)


@VERSIONS
def test_the_service_address_is_configurable_and_errors_are_reported(importers, version):
    of, port = importers[version], free_port()
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        for settings, words in (
            ({"tcp.port": taken}, f"XCP cannot be served at 127.0.0.1, port {taken}"),
            ({"tcp.listen_address": "nowhere", "tcp.port": port}, "XCP cannot be served at nowhere"),
            ({"udp.enable": True}, "has one master"),
        ):
            instance = of.bare()

            def begin(instance=instance, settings=settings):
                configure(instance, settings)
                instance.begin()

            instance.refused(words, begin)
            instance.free()
    instance = of.bare()
    if version == 3:
        instance.refused("in configuration mode", instance.fmu.setUInt16, [of.references["xcp.tcp.port"]], [port])
        instance.fmu.enterConfigurationMode()
        instance.refused("is not valid", instance.fmu.setUInt16, [of.references["xcp.tcp.port"]], [0])
        instance.refused("no variable of type Boolean", instance.fmu.setBoolean, [of.references["xcp.tcp.port"]], [True])
        instance.fmu.exitConfigurationMode()
    else:
        instance.refused("is not valid", instance.fmu.setInteger, [of.references["xcp.tcp.port"]], [70000])
    instance.free()
    # A disabled service opens no port, with any number of instances.
    several = [of.bare() for _ in range(3)]
    for instance in several:
        configure(instance, {"tcp.enable": False, "tcp.port": port})
        instance.begin()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port))
    for instance in several:
        instance.free()


@VERSIONS
@TRANSPORTS
def test_invalid_commands_do_no_harm(importers, described, version, transport):
    of, (measured, changed) = importers[version], described
    instance, port = served(of, transport)
    dt, random = float(of.description.defaultExperiment.stepSize), np.random.default_rng(3)
    values = instance.get(of.names("parameters"))
    for k in range(150):
        instance.step(k * dt, dt)
        with contextlib.suppress(Refused, OSError):
            master = Master(port, transport)
            master.socket.settimeout(0.02)
            try:
                for _ in range(int(random.integers(1, 6))):
                    command = bytes([random.integers(0xC0, 256)]) + random.bytes(int(random.integers(0, 24)))
                    # Some frames have a wrong length.
                    length = len(command) if random.random() < 0.8 else int(random.integers(0, 65536))
                    master.socket.sendall(struct.pack("<HH", length, 0) + command)
                    master.socket.recv(1 << 16)
            finally:
                master.close()
    deadline = time.monotonic() + 5.0
    while True:
        try:
            master = Master(port, transport)
            break
        except OSError:
            assert time.monotonic() < deadline
            time.sleep(0.01)
    assert master.read(measured["time"])[0] == 150 * dt
    # Lists that are freed while they are filled.
    master("d6"), master("d5000100"), master("d400000001"), master("d300000000c8"), master("e2000000" + "00c7")
    master("d30000000000")
    master.refused(0x29, master, struct.pack("<BBBBI", 0xE1, 0xFF, 8, 0, measured["time"]))
    master.refused(0x2A, master, "de010000")
    master.refused(0x21, master, "f0")
    master.refused(0x20, master, "c1")
    assert np.isfinite(instance.get(of.names("parameters"))).all() and len(values) == len(changed)
    instance.free()
    master.close()


def test_rows_after_lost_rows_are_marked(importers, described):
    of, (measured, _) = importers[2], described
    instance, port = served(of)
    master = Master(port)
    master.measure([[measured["time"]] * 100])
    dt = float(of.description.defaultExperiment.stepSize)
    # One long step while the master does not read: 100,000 rows of 812 bytes exceed ring and socket.
    instance.step(0.0, 100_000 * dt)
    received, marked, last = 0, 0, 0
    with contextlib.suppress(TimeoutError):
        master.socket.settimeout(1.0)
        while True:
            row = master.take(1)[0]
            cycle = round(struct.unpack_from("<d", row, 6)[0] / dt)
            assert (row[0] & 0x80 != 0) == (cycle != last + 1)
            received, marked, last = received + 1, marked + (row[0] >> 7), cycle
    assert 0 < received < 100_000
    # The next row that is sent has the mark.
    instance.step(100_000 * dt, dt)
    assert master.take(1)[0][0] & 0x80
    instance.free()
    master.close()
