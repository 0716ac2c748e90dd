"""The machine: room on the disk, memory, and whether the clock is set."""

from __future__ import annotations

import ctypes
import os
import shutil
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

from florence_bt.app.doctor.finding import HealthFinding, good, note, problem, warning

GROUP = "machine"
ROOM_WANTED, ROOM_NEEDED = 1 << 30, 100 << 20
"""Bytes of disk below which a warning or a problem is reported."""
BUILT_YEAR = 2024
"""A clock before this year was never set."""
NOT_SYNCHRONISED = 5
"""Answer of adjtimex(2) when no time service keeps the clock (TIME_ERROR)."""


def check_machine(
    folder: Path,
    free: Callable[[Path], int] = lambda path: shutil.disk_usage(path).free,
    now: Callable[[], datetime] = lambda: datetime.now(UTC),
    clock_state: Callable[[], int | None] | None = None,
) -> Iterator[HealthFinding]:
    """Check disk and clock.

    Args:
        folder: Where runs and logs will go.
        free: Bytes that are free where a folder is.
        now: The time of the wall clock.
        clock_state: What adjtimex(2) returns; None when it cannot be asked.
    """
    yield _disk(folder, free)
    yield _compiled_code()
    yield _clock(now(), (clock_state or _ask_kernel)())


def _disk(folder: Path, free: Callable[[Path], int]) -> HealthFinding:
    place = folder.absolute()
    while not place.exists():
        place = place.parent
    if not os.access(place, os.W_OK):
        return problem(
            GROUP, "disk", f"{place} cannot be written to", f"sudo chown $USER {place}, or use another --out"
        )
    room = free(place)
    found = f"{room / (1 << 30):.1f} GiB free at {place}"
    if room < ROOM_NEEDED:
        return problem(GROUP, "disk", found, "delete old runs: missions cannot be recorded")
    if room < ROOM_WANTED:
        return warning(GROUP, "disk", found, "delete old runs soon")
    return good(GROUP, "disk", found)


def _compiled_code() -> HealthFinding:
    """Check that numba can keep compiled loops beside the code, or where NUMBA_CACHE_DIR says."""
    place = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(__file__).resolve().parents[2])
    if os.access(place, os.W_OK):
        return good(GROUP, "compiled code", f"is kept in {place}")
    return note(
        GROUP,
        "compiled code",
        f"{place} cannot be written to: every start compiles again (15 s and more)",
        "set NUMBA_CACHE_DIR to a folder that can be written to",
    )


def _clock(now: datetime, state: int | None) -> HealthFinding:
    found = now.strftime("%Y-%m-%d %H:%M:%S UTC")
    if now.year < BUILT_YEAR:
        return problem(GROUP, "clock", f"{found} was never set", "sudo timedatectl set-ntp true")
    if state == NOT_SYNCHRONISED:
        return note(
            GROUP,
            "clock",
            f"{found}, kept by no time service",
            "sudo timedatectl set-ntp true, where several machines work together",
        )
    return good(GROUP, "clock", found + (", kept by a time service" if state is not None else ""))


def _ask_kernel() -> int | None:
    """Ask for the state of the kernel's clock by adjtimex(2) with nothing to adjust."""
    try:
        adjtimex = ctypes.CDLL(None, use_errno=True).adjtimex
    except (OSError, AttributeError):
        return None
    # struct timex of Linux has 208 bytes on 64-bit machines; `modes`, its first field, is 0: only read.
    state = int(adjtimex(ctypes.create_string_buffer(512)))
    return state if state >= 0 else None
