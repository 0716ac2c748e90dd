"""Options of the whole test run; pytest looks for them in this folder only."""

from __future__ import annotations

import gc
import os
import signal
import sys

import pytest
from hypothesis import HealthCheck, settings

# The same examples each time, however slow the machine is; ``--hypothesis-profile=wild`` looks for new ones.
settings.register_profile(
    "tame", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("wild", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("tame")


def pytest_configure() -> None:
    """What the processes that tests start inherit: a SIGINT that interrupts, and byte code that is kept."""
    # In the background of a script SIGINT is ignored.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Hundreds of processes would compile the same modules again; and the next run the tests.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    # Searching for garbage after each 700 new objects is a fifth of what reading a mission takes.
    gc.set_threshold(20_000)


def pytest_collection_finish() -> None:
    """Leave the tests, half a million objects, out of the search for garbage after each ROS test."""
    gc.collect()
    gc.freeze()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("hardware")
    group.addoption(
        "--device",
        action="append",
        default=[],
        metavar="KIND=PATH",
        help="test the device at PATH: create=/dev/ttyUSB0 (or create2=...), hokuyo=/dev/ttyACM0 "
        "(or hokuyo=HOST:PORT), kinect=usb; may be given several times",
    )
    group.addoption(
        "--may-drive",
        action="store_true",
        help="the real robot may move: put it on the floor with a metre of room on all sides",
    )
