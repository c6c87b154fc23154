"""Emulated EtherCAT drives, operated by two independent main devices."""

import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("main_devices.py")
PROBE = ["ip", "link", "add", "main", "type", "veth", "peer", "name", "sub"]


def namespace():
    """Options of `unshare` for a network namespace with virtual interfaces; `None` where none is permitted."""
    for options in ("-n", "-rn"):
        try:
            if subprocess.run(["unshare", options, *PROBE], capture_output=True).returncode == 0:
                return options
        except FileNotFoundError:
            pass
    return None


def test_an_unknown_interface_is_reported_with_its_remedy(program):
    run = subprocess.run([program, "plant", "--ethercat", "nowhere"], capture_output=True, text=True, timeout=60)
    assert run.returncode == 1 and "nowhere" in run.stderr and "`ip link`" in run.stderr, run.stderr


@pytest.mark.parametrize("mapping", [[], ["fixed"]])
@pytest.mark.parametrize("name, package", [("soem", "pysoem"), ("kickcat", "kickcat")])
def test_main_device_operates_the_drives_of_the_virtual_machine(name, package, mapping, program):
    pytest.importorskip(package)
    options = namespace()
    if options is None:
        pytest.skip("this computer permits no network namespace with virtual interfaces, or iproute2 is missing")
    run = subprocess.run(
        ["unshare", options, sys.executable, SCRIPT, name, program, *mapping],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert run.returncode == 0, run.stdout + run.stderr
