"""Options of the whole test run; pytest looks for them in this folder only."""

from __future__ import annotations

import copy
import functools
import gc
import os
import signal
import sys
from typing import Any

import pytest
import typer.main
import typer.testing
from hypothesis import HealthCheck, settings

from tests.sweeps import ALL_EXAMPLES, FEWEST

# The same examples each time, however slow the machine is; ``--hypothesis-profile=all`` has more of them
# (``make test-all``), and ``wild`` looks for new ones.
settings.register_profile("wild", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("all", settings.get_profile("wild"), derandomize=True, max_examples=ALL_EXAMPLES)
settings.register_profile("tame", settings.get_profile("all"), max_examples=FEWEST)
settings.load_profile("tame")


_built = functools.cache(typer.main.get_command)


def _command_of(app: typer.Typer) -> Any:
    """Return the command of an application, built once, for a call that may add verbs to it."""
    command: Any = copy.copy(_built(app))
    if hasattr(command, "commands"):
        command.commands = dict(command.commands)
    return command


def pytest_configure() -> None:
    """What the processes that tests start inherit: a SIGINT that interrupts, and byte code that is kept."""
    # In the background of a script SIGINT is ignored.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Hundreds of processes would compile the same modules again; and the next run the tests.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    # Building the commands of all verbs takes a tenth of a second, which each call of a CliRunner would take.
    typer.testing._get_command = _command_of  # type: ignore[attr-defined]
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
