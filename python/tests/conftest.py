import os
import signal

import matplotlib
import pytest

import stickslip

matplotlib.use("Agg")
# A shell starts background jobs with the signal ignored; the tests of Ctrl-C need it.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def bench():
    """A bench without mismatch."""
    return stickslip.preset("clm-bench")


@pytest.fixture(scope="session")
def curve(bench):
    """A short friction measurement on it."""
    return stickslip.measure(bench, plan={"speeds": 8})


@pytest.fixture(scope="session")
def program():
    """Path of the command-line program, if it has been built."""
    program = os.environ.get("STICKSLIP")
    if not program:
        pytest.skip("STICKSLIP is not set to the program to compare with")
    return program
