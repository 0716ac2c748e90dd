"""USB devices by their ids, as the kernel lists them: no device is opened."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.doctor.finding import HealthFinding, good, note, problem
from florence_bt.app.doctor.ports import udev_advice

GROUP = "USB"


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A device of the robot.

    Attributes:
        name: What people call it.
        ids: ``vendor:product`` of every variant.
        missing: What to look at when it is not there.
        opened: Whether the drivers open the USB device itself, not a serial port on it.
    """

    name: str
    ids: tuple[str, ...]
    missing: str
    opened: bool = False


KINECT_POWER = (
    "check the USB plug; the Kinect also needs 12 V, on our robot from the Create's breaker: digital output 0"
)
CREATE_CABLE = UsbDevice(
    "cable of the Create", ("0403:6001", "067b:2303"), "plug the Create's serial cable in"
)
HOKUYO = UsbDevice(
    "Hokuyo laser", ("15d1:0000",), "plug the laser's USB cable in (one with Ethernet has none)"
)
DEVICES = (
    CREATE_CABLE,
    HOKUYO,
    UsbDevice("Kinect camera", ("045e:02ae", "045e:02bf"), KINECT_POWER, opened=True),
    UsbDevice("Kinect motor", ("045e:02b0", "045e:02ad"), KINECT_POWER, opened=True),
)
"""REFERENCE 5.1 for the Kinect; the rest as their makers' drivers list them."""


def check_usb(
    sysfs: Path = Path("/sys/bus/usb/devices"),
    nodes: Path = Path("/dev/bus/usb"),
    allowed: Callable[[Path], bool] = lambda path: os.access(path, os.R_OK | os.W_OK),
) -> Iterator[HealthFinding]:
    """Check whether the robot's USB devices are plugged in and may be opened.

    Args:
        sysfs: Where the kernel lists USB devices.
        nodes: Where their device files are.
        allowed: Whether this user may read and write a file.
    """
    plugged = _plugged(sysfs)
    if not plugged:
        yield note(
            GROUP, "bus", f"no USB device is listed in {sysfs}", "nothing, on a machine without the robot"
        )
        return
    for device in DEVICES:
        entries = [(id_, entry) for id_ in device.ids for entry in plugged.get(id_, ())]
        if not entries:
            yield note(GROUP, device.name, f"not plugged in ({' or '.join(device.ids)})", device.missing)
            continue
        id_, entry = entries[0]
        file = nodes / f"{_number(entry, 'busnum'):03d}" / f"{_number(entry, 'devnum'):03d}"
        if device.opened and not allowed(file):
            yield problem(GROUP, device.name, f"{id_}: this user may not open {file}", udev_advice())
        else:
            yield good(GROUP, device.name, id_)


def _plugged(sysfs: Path) -> dict[str, list[Path]]:
    devices: dict[str, list[Path]] = {}
    for entry in sorted(sysfs.glob("*")) if sysfs.is_dir() else ():
        try:
            id_ = f"{(entry / 'idVendor').read_text().strip()}:{(entry / 'idProduct').read_text().strip()}"
        except OSError:
            continue  # an interface or a port, not a device
        devices.setdefault(id_, []).append(entry)
    return devices


def _number(entry: Path, name: str) -> int:
    try:
        return int((entry / name).read_text())
    except (OSError, ValueError):
        return 0
