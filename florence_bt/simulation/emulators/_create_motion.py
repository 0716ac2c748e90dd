"""From drive commands to wheel speeds, and the built-in behaviours of a base (REFERENCE 1.3)."""

from __future__ import annotations

STRAIGHT = (-0x8000, 0x7FFF, 0)
"""Radii. That 0 is one of them is chosen here: PyRobot and others stop with velocity 0 and radius 0."""

SPIN_CLOCKWISE, SPIN_COUNTER_CLOCKWISE = -1, 1
ROBOT_RADIUS_MM = 165.0
MAX_SPEED_MMPS, MAX_RADIUS_MM, MAX_PWM = 500, 2000, 255
COVER, COVER_AND_DOCK, SPOT, FIGURE_EIGHT = 0, 1, 2, 4
"""Demo numbers; the others of the manual stand still here."""

COVER_MMPS, TURN_MMPS, ARC_MMPS = 300, 150, (120, 240)
BACK_S, TURN_S, LOOP_S, SPOT_S = 0.5, 1.5, 14.0, 45.0


def clamp(value: int, limit: int) -> int:
    """A number within +-limit."""
    return max(-limit, min(limit, value))


def wheels_on_arc(velocity: int, radius: int, separation_mm: float) -> tuple[int, int]:
    """Left and right speed in mm/s for the Drive command.

    Args:
        velocity: mm/s.
        radius: mm or one of the special values.
        separation_mm: Between the wheels.
    """
    if radius in STRAIGHT:
        return velocity, velocity
    if radius == SPIN_CLOCKWISE:
        return velocity, -velocity
    if radius == SPIN_COUNTER_CLOCKWISE:
        return -velocity, velocity
    share = separation_mm / (2.0 * clamp(radius, MAX_RADIUS_MM))
    return round(velocity * (1.0 - share)), round(velocity * (1.0 + share))


def cliff_matters(left: int, right: int, separation_mm: float) -> bool:
    """Whether Safe mode stops at a cliff: driving forward, or backward around a point within the robot."""
    if left + right >= 0:
        return left + right > 0
    radius = separation_mm / 2.0 * abs(left + right) / max(1, abs(right - left))
    return radius < ROBOT_RADIUS_MM


class Demo:
    """A behaviour that the base plays by itself: roughly what the manual says it does."""

    def __init__(self, number: int, now: float) -> None:
        self._number = number
        self._begin = now
        self._bumped: float | None = None

    def wheels(self, now: float, *, bumped: bool, docked: bool) -> tuple[int, int] | None:
        """Left and right speed in mm/s now; None when the behaviour is over.

        Args:
            now: Seconds.
            bumped: A bumper is pressed.
            docked: The base stands on its home base.
        """
        elapsed = now - self._begin
        if self._number == FIGURE_EIGHT:
            slow, fast = ARC_MMPS
            return (slow, fast) if int(elapsed / LOOP_S) % 2 == 0 else (fast, slow)
        if self._number == SPOT:
            if elapsed > SPOT_S:
                return None
            return round(ARC_MMPS[1] * elapsed / SPOT_S), ARC_MMPS[1]
        if self._number == COVER_AND_DOCK and docked:
            return None
        if self._number in (COVER, COVER_AND_DOCK):
            return self._cover(now, bumped)
        return 0, 0

    def _cover(self, now: float, bumped: bool) -> tuple[int, int]:
        """Straight on; back and turn away from what is hit."""
        if bumped:
            self._bumped = now
        since = None if self._bumped is None else now - self._bumped
        if since is None or since > BACK_S + TURN_S:
            return COVER_MMPS, COVER_MMPS
        return (-TURN_MMPS, -TURN_MMPS) if since < BACK_S else (-TURN_MMPS, TURN_MMPS)
