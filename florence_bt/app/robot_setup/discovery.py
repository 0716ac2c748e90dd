"""Discovery of base and laser among the serial devices: by their USB ids, then by asking them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.doctor.finding import HealthFinding, HealthLevel
from florence_bt.app.doctor.firmware import check_firmware
from florence_bt.app.doctor.ports import is_free
from florence_bt.app.doctor.usb import CREATE_CABLE, HOKUYO, UsbDevice

TTYS = ("ttyUSB*", "ttyACM*")
"""Names of USB serial devices."""

Ask = Callable[[dict[str, dict[str, str]]], Iterator[HealthFinding]]


@dataclass(frozen=True, slots=True)
class SerialDevice:
    """A USB serial device.

    Attributes:
        path: Its device file.
        usb_id: ``vendor:product``; empty when it is on no USB.
        serial: Its serial number; empty when it tells none.
        answer: What it answered when it was asked; empty when it did not, or was not asked.
    """

    path: str
    usb_id: str = ""
    serial: str = ""
    answer: str = ""


def serial_devices(sysfs: Path = Path("/sys/class/tty"), devices: Path = Path("/dev")) -> list[SerialDevice]:
    """Return the USB serial devices of this machine, as the kernel lists them: none is opened.

    Args:
        sysfs: Where the kernel lists terminals.
        devices: Where their device files are.
    """
    found = []
    for entry in sorted(entry for pattern in TTYS for entry in sysfs.glob(pattern)):
        usb = next(
            (above for above in (entry / "device").resolve().parents if (above / "idVendor").exists()), None
        )
        usb_id = f"{_text(usb, 'idVendor')}:{_text(usb, 'idProduct')}" if usb else ""
        found.append(SerialDevice(str(devices / entry.name), usb_id, _text(usb, "serial") if usb else ""))
    return found


def _text(folder: Path, name: str) -> str:
    try:
        return (folder / name).read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""


def find_base(devices: Sequence[SerialDevice], robot_type: str, ask: Ask) -> SerialDevice | None:
    """Return the device that is the base: the cable of a Create that answers, else the first such cable.

    Args:
        devices: Those of the machine.
        robot_type: The kind of base, which decides how it is asked.
        ask: Asks the device of a configuration who it is.
    """
    section = {"robot_type": robot_type}
    return _find(devices, CREATE_CABLE, "turtlebot_node", section, ask)


def find_laser(devices: Sequence[SerialDevice], ask: Ask) -> SerialDevice | None:
    """Return the device that is the laser; see :func:`find_base`."""
    return _find(devices, HOKUYO, "hokuyo_node", {}, ask)


def _find(
    devices: Sequence[SerialDevice], kind: UsbDevice, node: str, section: dict[str, str], ask: Ask
) -> SerialDevice | None:
    candidates = [device for device in devices if device.usb_id in kind.ids]
    for device in candidates:
        asked = asked_at(node, {**section, "port": device.path}, ask)
        if asked:
            return SerialDevice(device.path, device.usb_id, device.serial, asked)
    return candidates[0] if candidates else None


def asked_at(node: str, section: dict[str, str], ask: Ask) -> str:
    """Ask the device of a node who it is; empty when it does not answer.

    Args:
        node: ``turtlebot_node`` or ``hokuyo_node``.
        section: Its part of a configuration, with the port.
        ask: See :func:`find_base`.
    """
    findings = list(ask({node: section}))
    return next((found.found for found in findings if found.level is HealthLevel.OK), "")


def ask_plugged(config: dict[str, dict[str, str]]) -> Iterator[HealthFinding]:
    """Ask devices on ports that nobody uses."""
    return check_firmware(config, is_free)


def ask_emulated(config: dict[str, dict[str, str]]) -> Iterator[HealthFinding]:
    """Ask emulated devices, whose ports this process uses itself."""
    return check_firmware(config, lambda port: Path(port).exists())


@contextmanager
def emulated_devices(folder: Path) -> Iterator[list[SerialDevice]]:
    """Plug the emulators of base and laser in while the block runs.

    Args:
        folder: Where the links to their ports appear.

    Yields:
        The two, with the ids of the real ones and without serial numbers.
    """
    import threading
    import time

    from florence_bt.app.bringup.simulated import hardware_mounts
    from florence_bt.simulation.hardware.ports import HardwareSettings
    from florence_bt.simulation.hardware.server import HardwareServer
    from florence_bt.simulation.home.flat import load_flat
    from florence_bt.simulation.home.world import SimulatedWorld

    settings = HardwareSettings(folder)
    flat = load_flat()
    server = HardwareServer(
        SimulatedWorld(flat, people=[], start=flat.start, seed=0), hardware_mounts(), settings
    )
    server.open()
    over = threading.Event()

    def serve() -> None:
        begun = time.monotonic()
        while not over.wait(0.002):
            while server.time < time.monotonic() - begun:
                server.step()

    thread = threading.Thread(target=serve, name="emulators", daemon=True)
    thread.start()
    try:
        yield [
            SerialDevice(os.fspath(settings.base_port), CREATE_CABLE.ids[0]),
            SerialDevice(os.fspath(settings.laser_port), HOKUYO.ids[0]),
        ]
    finally:
        over.set()
        thread.join()
        server.close()
