"""Progress and result of ``florence map build``, for people."""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from florence_bt.app.maps.build import Built
from florence_bt.core.errors import ConfigError
from florence_bt.core.transforms import Transform3
from florence_bt.skills.navigation.mapping.slam import Slam

_LINE_EVERY_S = 5.0
"""Time between two lines when the output is no terminal."""


class MapProgress:
    """A bar in a terminal, a line now and then elsewhere; on stderr."""

    def __init__(self, name: str) -> None:
        self._console = Console(stderr=True)
        columns = (
            TextColumn(name),
            BarColumn(),
            TextColumn("{task.percentage:.0f} %"),
            TimeRemainingColumn(),
        )
        self._progress = Progress(*columns, TextColumn("{task.fields[found]}"), console=self._console)
        self._task = self._progress.add_task("", total=1.0, found="")
        self._told = time.monotonic()

    def __enter__(self) -> Self:
        """Show it."""
        if self._console.is_terminal:
            self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave what it shows."""
        if self._console.is_terminal:
            self._progress.stop()

    def tell(self, read: float, slam: Slam) -> None:
        """Show how far it is."""
        found = f"{len(slam.scans)} scans kept, {slam.loops} loops"
        if self._console.is_terminal:
            self._progress.update(self._task, completed=read, found=found)
        elif time.monotonic() - self._told >= _LINE_EVERY_S:
            self._told = time.monotonic()
            print(f"{100 * read:.0f} %: {found}", file=sys.stderr)


def tell_built(built: Built, files: tuple[Path, Path, Path, Path]) -> None:
    """Write what came out, and on stderr what was wrong with the recording."""
    description, _, picture, drive = files
    slam, (rows, columns) = built.slam, built.grid.cells.shape
    faster = built.driven_s / max(built.took_s, 1e-3)
    print(
        f"{built.scans} scans of {built.driven_s:.0f} s and {built.driven_m:.0f} m, "
        f"read in {built.took_s:.1f} s of one core: {faster:.0f} times faster than the robot drove"
    )
    loops = (
        f"{slam.loops} loops closed" if slam.loops else "no place was recognised again: the drive had no loop"
    )
    torn = f"; {slam.torn} times a scan fitted nothing of those before" if slam.torn else ""
    print(f"{loops}{torn}")
    size = f"{columns * built.grid.resolution:.1f} x {rows * built.grid.resolution:.1f} m"
    print(f"{description}: {size} in cells of {built.grid.resolution:g} m")
    print(f"{picture}: a picture of it and of the way; {drive}: the drive, for --continue")
    if built.problem is not None:
        reason = "interrupted" if isinstance(built.problem, KeyboardInterrupt) else str(built.problem)
        print(f"florence: {reason}; the map holds what was read before", file=sys.stderr)


def mount_from_text(text: str) -> Transform3:
    """Read where a laser is: x, y, z in metres; roll, pitch, yaw in degrees.

    Raises:
        ConfigError: These are not six finite numbers.
    """
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if len(numbers) != 6 or not all(map(math.isfinite, numbers)):
        valid = ["--mount '0.06 0 0.09 180 0 0' (x, y, z in metres; roll, pitch, yaw in degrees)"]
        raise ConfigError(f"the mount is {text!r}", valid=valid)
    return Transform3.from_xyz_rpy(numbers[:3], [math.radians(each) for each in numbers[3:]])
