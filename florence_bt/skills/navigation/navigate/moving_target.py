"""Where somebody is who walks, and how fast they walk: from single sights to a velocity."""

from __future__ import annotations

import numpy as np

CAMERA_GAP_S = 0.3
"""When the camera has not seen the person for so long, the laser goes on."""


class MovingTarget:
    """A person whose place and velocity are estimated, in the odometry frame.

    Args:
        velocity_time: The velocity is averaged over about this long, in seconds.

    Attributes:
        seen: The time they were seen last, seconds; None before.
        recognised: The time the camera saw them last; the laser sees legs, and cannot tell whose.
    """

    def __init__(self, velocity_time: float) -> None:
        self._time = velocity_time
        self._place = np.zeros(2)
        self._velocity = np.zeros(2)
        self.seen: float | None = None
        self.recognised: float | None = None
        self._recognised_at = self._place, self._velocity

    def recognise(self, stamp: float, x: float, y: float) -> None:
        """Note that the camera saw the person, and nobody else."""
        self.saw(stamp, x, y)
        self.recognised = self.seen
        self._recognised_at = self._place, self._velocity

    def is_recognised(self, now: float) -> bool:
        """Tell whether the camera has seen the person just now."""
        return self.recognised is not None and now - self.recognised < CAMERA_GAP_S

    def drop_laser(self) -> None:
        """Drop what the laser has followed since the camera saw them: it is somebody or something else."""
        self.seen = self.recognised
        self._place, self._velocity = self._recognised_at

    def saw(self, stamp: float, x: float, y: float) -> None:
        """Note that the person was seen; ignore what is not newer, or not finite."""
        place = np.array([x, y])
        if not np.isfinite([stamp, x, y]).all() or (self.seen is not None and stamp <= self.seen):
            return
        if self.seen is not None:
            passed = stamp - self.seen
            share = passed / (passed + self._time)
            self._velocity = (1.0 - share) * self._velocity + share * (place - self._place) / passed
        self._place, self.seen = place, stamp

    def suppose(self, now: float, x: float, y: float) -> None:
        """Suppose that they went straight to a place since they were last seen, and walk on like that."""
        assert self.seen is not None and now > self.seen
        place = np.array([x, y])
        self._place, self._velocity = place, (place - self._place) / (now - self.seen)

    def at(self, now: float, coast: float) -> tuple[float, float]:
        """Return where they should be now, if they walked on for at most some seconds."""
        assert self.seen is not None
        x, y = self._place + self._velocity * min(coast, max(0.0, now - self.seen))
        return float(x), float(y)

    @property
    def velocity(self) -> tuple[float, float]:
        """m/s."""
        return float(self._velocity[0]), float(self._velocity[1])
