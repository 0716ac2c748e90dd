"""Serial ports: there, allowed, free."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from florence_bt.app.doctor.finding import HealthFinding, good, note, problem
from florence_bt.core.paths import find_data

GROUP = "ports"
BY_ID = Path("/dev/serial/by-id")


def udev_advice() -> str:
    """Say how to install the rules that come with Florence."""
    rules = find_data("config", "udev/99-florence.rules")
    return (
        f"sudo cp {rules} /etc/udev/rules.d/ && sudo udevadm control --reload && sudo udevadm trigger; "
        "sudo usermod -aG dialout $USER, then log in again"
    )


def check_ports(
    ports: Mapping[str, str],
    by_id: Path = BY_ID,
    processes: Path = Path("/proc"),
    allowed: Callable[[Path], bool] = lambda path: os.access(path, os.R_OK | os.W_OK),
) -> Iterator[HealthFinding]:
    """Look at the serial ports of a configuration.

    Args:
        ports: Node -> device file.
        by_id: The folder where udev names serial devices by their make.
        processes: The ``/proc`` file system.
        allowed: Whether this user may read and write a file.
    """
    for node, port in ports.items():
        yield _port(node, Path(port), by_id, processes, allowed)


def _port(
    node: str, port: Path, by_id: Path, processes: Path, allowed: Callable[[Path], bool]
) -> HealthFinding:
    item = f"{port} ({node})"
    try:
        mode = port.stat().st_mode
    except FileNotFoundError:
        there = ", ".join(str(path) for path in sorted(by_id.glob("*"))) or "none"
        return problem(
            GROUP,
            item,
            "does not exist",
            f"plug the device in and switch it on, or set `{node}: {{port: ...}}` in the robot's "
            f"configuration; serial devices here: {there}",
        )
    except OSError as error:
        return problem(GROUP, item, f"cannot be examined: {error.strerror}", udev_advice())
    if not stat.S_ISCHR(mode):
        return problem(
            GROUP,
            item,
            "is not a serial device",
            f"set `{node}: {{port: /dev/ttyUSB0}}` in the configuration",
        )
    if not allowed(port):
        return problem(GROUP, item, "this user has no permission to read and write it", udev_advice())
    users = list(users_of(port, processes))
    if users:
        return note(
            GROUP,
            item,
            f"is in use by {', '.join(users)}",
            "that is right while the system is up; otherwise end that process",
        )
    return good(GROUP, item, f"present, accessible and free{_target(port)}")


def _target(port: Path) -> str:
    real = os.path.realpath(port)
    return f" (points to {real})" if real != str(port) else ""


def users_of(port: Path, processes: Path = Path("/proc")) -> Iterator[str]:
    """Yield the processes that have a device open, e.g. ``python3 (4711)``; other users' as far as visible.

    Args:
        port: The device file.
        processes: The ``/proc`` file system.
    """
    real = os.path.realpath(port)
    for process in sorted(processes.glob("[0-9]*"), key=lambda path: int(path.name)):
        try:
            if any(os.path.realpath(link) == real for link in (process / "fd").iterdir()):
                name = (process / "comm").read_text(encoding="utf-8", errors="replace").strip()
                yield f"{name} ({process.name})"
        except OSError:
            continue  # it has ended, or belongs to another user: nothing can be said about it


def is_free(port: str) -> bool:
    """Tell whether a port is there, may be opened by this user, and is in nobody's use."""
    path = Path(port)
    return path.exists() and os.access(path, os.R_OK | os.W_OK) and not list(users_of(path))
