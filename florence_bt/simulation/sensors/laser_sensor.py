"""The simulated laser scanner: what a URG-04LX would measure from where the robot truly is.

No time passes during a measurement; the robot itself is never seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, Positive, check_order
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors._laser_kernels import cast_fan
from florence_bt.simulation.sensors._surface_kernels import follow_beams

STEPS_PER_TURN = 1024
FRONT_STEP = 384
LAST_STEP = 768
"""Source of all three: REFERENCE 4.1 (URG-04LX)."""

_TOO_FAR = 0
_TOO_WEAK = np.array([1, 2], np.int32)
_FAILED = np.array([6, 7, 9], np.int32)
"""Codes in the place of a distance. Source: REFERENCE 4.8."""


@dataclass(frozen=True, slots=True)
class LaserParameters(CheckedParameters):
    """The quality of the scanner.

    Attributes:
        noise_mm: Standard deviation of a range below 1 m.
        noise_ratio: Standard deviation of a range above 1 m, as a part of the range.
        sure_range_m: Up to here every echo is strong enough.
        max_range_m: From here on none is; in between the chance falls evenly.
        drop_out: Chance that a beam gives an error code for no reason.
    """

    noise_mm: NotNegative = 10.0
    noise_ratio: NotNegative = 0.01
    sure_range_m: Positive = 4.0
    max_range_m: float = 5.6
    drop_out: Annotated[float, Limits(0.0, 1.0)] = 0.002

    def _check(self) -> None:
        check_order(self, ("sure_range_m", "max_range_m"), equal=True)


class LaserSensor:
    """A URG-04LX on the robot.

    Args:
        world: What is measured.
        mount: base_footprint from the laser frame; a roll of pi hangs the sensor upside down.
        seed: Of the noise.
        parameters: How good the scanner is.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        mount: Transform3,
        seed: int = 0,
        parameters: LaserParameters | None = None,
    ) -> None:
        self._world = world
        self._mount = mount
        self._parameters = parameters if parameters is not None else LaserParameters()
        self._rng = np.random.default_rng(seed)
        self._seen: tuple[Pose2, int, int] | None = None
        self._ranges: NDArray[np.float64] = np.empty(0)

    def measure(self, first_step: int = 44, last_step: int = 725) -> NDArray[np.int32]:
        """Measure all steps at once.

        Args:
            first_step: First step; step 384 looks along the sensor's x axis, steps turn counter-clockwise
                about its z axis, 1024 to the full turn.
            last_step: Last step.

        Returns:
            Shape (last_step - first_step + 1,), millimetres; below 20 an error code of REFERENCE 4.8.

        Raises:
            ValueError: The steps are not in 0 to 768, or in the wrong order.
        """
        if not 0 <= first_step <= last_step <= LAST_STEP:
            raise ValueError(
                f"steps must follow 0 <= first <= last <= {LAST_STEP}, not {first_step}, {last_step}"
            )
        ranges = self.true_ranges(first_step, last_step)
        p, rng, count = self._parameters, self._rng, len(ranges)
        near = np.minimum(ranges, p.max_range_m)
        sigma = np.where(ranges < 1.0, p.noise_mm / 1000.0, p.noise_ratio * near)
        noise, chance = rng.standard_normal(count), rng.random((2, count))
        measured = np.maximum(np.rint(1000.0 * (near + sigma * noise)), 20.0).astype(np.int32)
        seen = np.isfinite(ranges)
        millimetres = np.where(seen, measured, np.int32(_TOO_FAR))
        weak = seen & (p.sure_range_m + chance[0] * (p.max_range_m - p.sure_range_m) < ranges)
        for spoilt, codes in ((weak, _TOO_WEAK), (chance[1] < p.drop_out, _FAILED)):
            places = np.flatnonzero(spoilt)
            millimetres[places] = codes[rng.integers(len(codes), size=len(places))]
        return millimetres

    def true_ranges(self, first_step: int = 44, last_step: int = 725) -> NDArray[np.float64]:
        """Return the exact ranges in metres, infinite beyond the maximum; arguments as in :meth:`measure`."""
        seen = (self._world.robot_pose, first_step, last_step)
        if self._world.resting and seen == self._seen:
            return self._ranges
        increment = 2 * math.pi / STEPS_PER_TURN
        ranges = np.empty(last_step - first_step + 1)
        rows = np.empty(len(ranges), np.int16)
        map_from_laser = Transform3.from_pose2(self._world.robot_pose) @ self._mount
        for measure in (cast_fan, follow_beams):
            measure(
                self._world.scene.shapes,
                map_from_laser.translation,
                map_from_laser.rotation,
                (first_step - FRONT_STEP) * increment,
                increment,
                self._parameters.max_range_m,
                ranges,
                rows,
            )
        self._seen, self._ranges = seen, ranges
        return ranges
