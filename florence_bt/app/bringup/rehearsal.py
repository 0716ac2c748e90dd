"""Notices that a machine is too slow for a rehearsal (``florence up --robot FILE --emulate``).

A rehearsal runs on the wall clock, and the drivers with it. When the simulated world falls behind, scans come
late and drives end with ``no_scan``, though nothing is wrong with the robot.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

TOO_SLOW_ADVICE = "florence up --sim waits for a slow machine"
PACE_WINDOW_S = 5.0
"""The pace is taken over so many wall seconds: shorter delays are made up for."""
SLOWEST = 0.8
"""Simulated seconds a wall second below which scans come too late."""


class RehearsalPace:
    """Compares the simulated time with that of the machine."""

    def __init__(self) -> None:
        self._since: tuple[float, float] | None = None
        self._told = False

    def look(self, truth: Mapping[str, Any]) -> str:
        """Say, once, that the simulated world is too slow.

        Args:
            truth: The last message of the simulator: ``time`` and ``monotonic``, simulated and wall
                seconds; it may be empty.

        Returns:
            The sentence, mostly empty.
        """
        if self._told or not truth:
            return ""
        time, wall = float(truth["time"]), float(truth["monotonic"])
        if self._since is None:
            self._since = (time, wall)
        since_time, since_wall = self._since
        passed = wall - since_wall
        if passed < PACE_WINDOW_S:
            return ""
        self._since = (time, wall)
        pace = (time - since_time) / passed
        if pace >= SLOWEST:
            return ""
        self._told = True
        return (
            f"this machine is too slow for a rehearsal: the simulated world makes {pace:.1f} s a second, so "
            f"scans come too late and drives fail with no_scan; {TOO_SLOW_ADVICE}"
        )
