"""Options of the whole test run; pytest looks for them in this folder only."""

from __future__ import annotations

import pytest


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
