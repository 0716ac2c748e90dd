"""How far the wheels have turned, from the odometry: the joints of the robot's description."""

from __future__ import annotations

from florence_bt.drivers.turtlebot.codec.state import SensorState

NAMES = ("left_wheel_joint", "right_wheel_joint", "front_castor_joint", "back_castor_joint")
"""As the old node told them (REFERENCE 2.1); the castors are fixed."""


class WheelJoints:
    """Adds up the travel of each wheel.

    Attributes:
        positions: Radians, in the order of the names.
    """

    def __init__(self, wheel_radius_m: float, wheel_separation_m: float) -> None:
        self._radius_m = wheel_radius_m
        self._half_m = wheel_separation_m / 2.0
        self.positions = [0.0, 0.0, 0.0, 0.0]

    def add(self, state: SensorState) -> None:
        """Take the travel since the last state."""
        self.positions[0] += (state.distance - state.angle * self._half_m) / self._radius_m
        self.positions[1] += (state.distance + state.angle * self._half_m) / self._radius_m

    def velocities(self, linear: float, angular: float) -> list[float]:
        """Turning rates of the wheels in rad/s.

        Args:
            linear: m/s of the base.
            angular: rad/s of the base.
        """
        left = (linear - angular * self._half_m) / self._radius_m
        right = (linear + angular * self._half_m) / self._radius_m
        return [left, right, 0.0, 0.0]
