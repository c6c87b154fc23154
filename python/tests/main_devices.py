"""EtherCAT main devices that operate the drives of `stickslip plant --ethercat`.

    python3 main_devices.py soem|kickcat PROGRAM [fixed]        # in a network namespace, as root there

Each makes a pair of interfaces, starts the program on one and runs a main device on the other: pysoem 1.1.13 (SOEM) or
kickcat 2.5. Any deviation raises an exception. With `fixed` the drives have process data that cannot be mapped. Prints the
signals of both drives in the loop of set-points, then the states of all devices in their order.
"""

import contextlib
import struct
import subprocess
import sys
import time
from datetime import timedelta

# Drive motor: 0.467 N m rated, friction of the preset 0.31 N m at breakaway.
RATED = 467
STICKS, TURNS = 428, 857
COUNTS = 65536
TORQUE = 10
# 0.1 % of the rated torque.
LIMIT = 3000
CYCLE = 0.004


@contextlib.contextmanager
def drives(program, *options):
    """The program on one of two interfaces; the name of the other."""
    for command in ("link add main type veth peer name sub", "link set main up", "link set sub up"):
        subprocess.run(["ip", *command.split()], check=True)
    with subprocess.Popen([program, "plant", "--ethercat", "sub", *options], stdout=subprocess.PIPE, text=True) as served:
        try:
            line = served.stdout.readline()
            assert line == "ethercat:sub\n", line
            yield "main"
        finally:
            served.terminate()
            print(served.stdout.read())


class Mapping:
    """The default process data of a drive."""

    lengths = (6, 16)

    def outputs(self, control, torque):
        return struct.pack("<Hhbx", control, torque, TORQUE)

    def inputs(self, data):
        """Statusword, position, velocity, torque, error code."""
        return struct.unpack("<HiihHbx", bytes(data))[:5]


class FixedMapping:
    """With gaps, a torque limit and set-points of other modes."""

    lengths = (16, 20)

    def outputs(self, control, torque):
        return struct.pack("<HbxiihH", control, TORQUE, 0, 0, torque, LIMIT)

    def inputs(self, data):
        error, status, _, position, velocity, torque, _ = struct.unpack("<HHbxiihi", bytes(data))
        return status, position, velocity, torque, error


class Clock:
    """Equal cycles, or late ones on a loaded computer."""

    def __init__(self):
        self.next = time.perf_counter()

    def wait(self):
        self.next = max(self.next + CYCLE, time.perf_counter())
        time.sleep(max(0.0, self.next - time.perf_counter()))


def turn(exchange):
    """Enable both drives, stick, turn, and hold the shaft by the load drive. `exchange(n, control, torques)` returns inputs."""

    def cycle(count, control, torques):
        drives = exchange(count, control, torques)
        words = [f"0x{d[0]:04X} {d[1]:8d} {d[2]:8d} {d[3]:5d}" for d in drives]
        print(f"{count:4d} cycles, 0x{control:02X}, {torques[0]:4d} {torques[1]:4d}:  {'    '.join(words)}")
        return drives

    print("cycles, controlword, torques [0.1 %]:  statusword, position, velocity, torque of each drive")
    for control, state in ((0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
        for status, *_ in cycle(10, control, (0, 0)):
            assert status & 0x6F == state, hex(status)
    rest = cycle(10, 0x0F, (0, 0))
    stuck = cycle(100, 0x0F, (STICKS, 0))
    # Coupling and bristles yield by milliradians.
    assert abs(stuck[1][1] - rest[1][1]) < 40 and stuck[0][3] == STICKS, (rest, stuck)
    turning = cycle(100, 0x0F, (TURNS, 0))
    assert turning[0][2] > 5 * COUNTS / 6.283 and turning[1][1] > stuck[1][1] + COUNTS / 4, turning
    held = cycle(300, 0x0F, (TURNS, -TURNS))
    assert abs(held[1][2]) < COUNTS / 1000 and held[1][3] == -TURNS, held


def soem(interface, mapping):
    import pysoem

    master = pysoem.Master()
    master.open(interface)
    assert master.config_init() == 3
    # The EEPROM of the second drive is not read: SOEM assumes that of the first, with the same product code.
    names = [device.name for device in master.slaves]
    assert names == ["stickslip drive motor", "stickslip drive motor", "stickslip emulated input"], names
    motor, load, accelerometer = master.slaves
    number = lambda device, index, sub=0: int.from_bytes(device.sdo_read(index, sub), "little")  # noqa: E731
    assert load.sdo_read(0x1008, 0) == b"stickslip load motor"
    assert number(motor, 0x6076) == RATED and number(load, 0x608F, 1) == COUNTS
    # In segments, both ways.
    assert motor.sdo_read(0x2000, 0).endswith(b"is a simulation.")
    note = bytes(range(250))
    motor.sdo_write(0x2001, 0, note)
    assert motor.sdo_read(0x2001, 0) == note
    objects = {entry.index: entry for entry in motor.od}
    assert objects[0x6040].name == b"Controlword" and len(objects) > 50
    assert [entry.name for entry in objects[0x1018].entries][1] == b"Vendor ID"
    try:
        for value in (b"\0", b"\0\x16", b"\1"):
            motor.sdo_write(0x1C12, 1 if len(value) == 2 else 0, value)
        assert isinstance(mapping, Mapping), "a fixed assignment was written"
    except pysoem.SdoError:
        assert isinstance(mapping, FixedMapping), "an assignment was refused"
    try:
        motor.sdo_write(0x6076, 0, b"\1\0\0\0")
        raise AssertionError("a constant was written")
    except pysoem.SdoError as error:
        assert error.abort_code == 0x06010002

    for device in (motor, load):
        # A loaded computer is late: 1 s of watchdog, and missed set-points are not supervised.
        device._fpwr(0x0420, b"\x10\x27")
        device.sdo_write(0x10F1, 2, b"\xff\xff")
    master.config_map()
    assert master.state_check(pysoem.SAFEOP_STATE, 500_000) == pysoem.SAFEOP_STATE
    wrong_lengths(pysoem, master, motor, mapping)
    assert master.config_dc()
    for device in (motor, load):
        device.dc_sync(True, int(CYCLE * 1e9))
    clock = Clock()

    def exchange():
        clock.wait()
        master.send_processdata()
        return master.receive_processdata(300_000)

    for device in (motor, load):
        device.output = bytes(mapping.lengths[0])
    master.state = pysoem.OP_STATE
    master.write_state()
    end = time.monotonic() + 10
    while any(device.state != pysoem.OP_STATE for device in master.slaves) and time.monotonic() < end:
        exchange()
        master.read_state()
    assert master.read_state() == pysoem.OP_STATE, [hex(device.al_status) for device in master.slaves]

    def cycle(count, control, torques):
        for _ in range(count):
            for device, torque in zip((motor, load), torques):
                device.output = mapping.outputs(control, torque)
            counter = exchange()
            assert counter == master.expected_wkc == 7, counter
        return [mapping.inputs(motor.input), mapping.inputs(load.input)]

    turn(cycle)
    assert abs(struct.unpack("<h", accelerometer.input)[0]) < 32767
    # A lost frame and a wrong working counter on request.
    motor.sdo_write(0x2020, 2, b"\1\0")
    load.sdo_write(0x2020, 3, b"\1\0")
    assert [exchange() for _ in range(3)] == [-1, 4, 7]
    # A fault on request, and its reset by the rising edge.
    motor.sdo_write(0x2020, 1, b"\x10\x42")
    (status, _, _, torque, error), _ = cycle(5, 0x0F, (TURNS, 0))
    assert (status & 0x6F, torque, error) == (0x08, 0, 0x4210), (hex(status), torque, hex(error))
    assert cycle(5, 0x80, (0, 0))[0][0] & 0x6F == 0x40
    # SYNC0 lost on one drive, the watchdog on the other.
    motor.sdo_write(0x2020, 4, b"\1")
    time.sleep(1.3)
    master.read_state()
    states = [(device.state, device.al_status) for device in (motor, load)]
    assert states == [(0x14, 0x2C), (0x14, 0x1B)], states
    master.close()


def wrong_lengths(pysoem, master, motor, mapping):
    """Sync managers that differ from the mapping are refused; afterwards all are right again."""
    for register, right, code in zip((0x0812, 0x081A), mapping.lengths, (0x1D, 0x1E)):
        motor.state = pysoem.PREOP_STATE
        motor.write_state()
        assert motor.state_check(pysoem.PREOP_STATE, 500_000) == pysoem.PREOP_STATE
        motor._fpwr(register, (right + 1).to_bytes(2, "little"))
        motor.state = pysoem.SAFEOP_STATE
        motor.write_state()
        master.read_state()
        assert (motor.state, motor.al_status) == (0x12, code), (hex(motor.state), hex(motor.al_status))
        motor._fpwr(register, right.to_bytes(2, "little"))
        motor.state = pysoem.PREOP_STATE | 0x10
        motor.write_state()
        motor.state = pysoem.SAFEOP_STATE
        motor.write_state()
        assert motor.state_check(pysoem.SAFEOP_STATE, 500_000) == pysoem.SAFEOP_STATE


def kickcat(interface, mapping):
    import kickcat

    second = timedelta(seconds=1)
    link = kickcat.create_link(interface, "")
    link.set_timeout(timedelta(milliseconds=100))
    bus = kickcat.Bus(link)
    # Longer than the pauses of a loaded computer.
    bus.init(timedelta(milliseconds=400))
    devices = bus.slaves()
    assert len(devices) == 3
    motor, load, _ = devices
    read = lambda index, sub, size: bus.read_sdo(motor, index, sub, kickcat.Access.PARTIAL, size, second)  # noqa: E731
    assert read(0x6076, 0, 4) == RATED.to_bytes(4, "little")
    # A normal transfer. Version 2.5 reads a length within segments, which the protocol does not have.
    assert read(0x1008, 0, 64) == b"stickslip drive motor"
    assert bus.read_sdo(motor, 0x1C00, 0, kickcat.Access.COMPLETE, 64, second)[-4:] == b"\1\2\3\4"
    assert bus.read_object_description(motor, 0x6040)[0] == "Controlword"
    bus.create_mapping()
    assert [(it.output_size, it.input_size) for it in devices] == [mapping.lengths, mapping.lengths, (0, 2)]
    bus.request_state(kickcat.State.SAFE_OP)
    bus.wait_for_state(kickcat.State.SAFE_OP, second)
    clock = Clock()

    def cycle(count, control, torques):
        for _ in range(count):
            for device, torque in zip((motor, load), torques):
                device.set_output_bytes(mapping.outputs(control, torque))
            clock.wait()
            bus.process_data()
        return [mapping.inputs(motor.input_data), mapping.inputs(load.input_data)]

    bus.request_state(kickcat.State.OPERATIONAL)
    bus.wait_for_state(kickcat.State.OPERATIONAL, 5 * second, lambda: cycle(1, 0, (0, 0)))
    turn(cycle)
    # A fault on request, and its reset by the rising edge.
    message = motor.mailbox.write_sdo(0x2020, 1, False, b"\x10\x42", second)
    while message.status() != kickcat.mailbox.request.MessageStatus.SUCCESS:
        bus.process_mailboxes()
        cycle(1, 0x0F, (TURNS, 0))
    (status, _, _, torque, error), _ = cycle(5, 0x0F, (TURNS, 0))
    assert (status & 0x6F, torque, error) == (0x08, 0, 0x4210), (hex(status), torque, hex(error))
    assert cycle(5, 0x80, (0, 0))[0][0] & 0x6F == 0x40
    time.sleep(0.8)
    try:
        bus.get_state(motor)
        raise AssertionError("the watchdog has not expired")
    except kickcat.ErrorAL:
        # Its number is not part of the message.
        pass


if __name__ == "__main__":
    fixed = sys.argv[3:] == ["fixed"]
    with drives(sys.argv[2], "--analog", "1", *(["--fixed-mapping"] if fixed else [])) as interface:
        run = {"soem": soem, "kickcat": kickcat}[sys.argv[1]]
        run(interface, FixedMapping() if fixed else Mapping())
