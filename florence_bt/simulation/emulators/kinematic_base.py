"""A base that does at once what its wheels are told, on an endless floor."""

from __future__ import annotations

from florence_bt.core.geometry import Pose2, Twist2, integrate_twist


class KinematicBase:
    """Wheels without mass; a ``BasePlant`` for an emulator that runs alone.

    Attributes:
        pose: Where it stands, from its start.
    """

    def __init__(self, wheel_separation_m: float) -> None:
        """Stand at the start.

        Args:
            wheel_separation_m: Metres between the wheels.
        """
        self._separation_m = wheel_separation_m
        self._wheels = (0.0, 0.0)
        self._travel = (0.0, 0.0)
        self._time: float | None = None
        self.pose = Pose2()

    def advance_to(self, now: float) -> None:
        """Roll on until now, in seconds."""
        elapsed = 0.0 if self._time is None else max(0.0, now - self._time)
        self._time = now
        left, right = self._wheels
        self._travel = (self._travel[0] + left * elapsed, self._travel[1] + right * elapsed)
        self.pose = integrate_twist(self.pose, Twist2((left + right) / 2.0, self.yaw_rate()), elapsed)

    def set_wheels(self, left_mps: float, right_mps: float) -> None:
        """Turn the wheels at these speeds in m/s."""
        self._wheels = (left_mps, right_mps)

    def travel(self) -> tuple[float, float]:
        """Metres that the left and the right wheel have rolled."""
        return self._travel

    def yaw_rate(self) -> float:
        """Turning rate in rad/s, counter-clockwise positive."""
        return (self._wheels[1] - self._wheels[0]) / self._separation_m

    def bumpers(self) -> tuple[bool, bool]:
        """There is nothing to bump into."""
        return (False, False)
