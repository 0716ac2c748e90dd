"""The simulated Kinect: raw disparities and colours as seen from where the robot truly is.

No time passes during a measurement; the robot itself is never seen.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits, NotNegative, check_order
from florence_bt.core.sensing import CameraModel
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors._camera_kernels import cast_image
from florence_bt.simulation.sensors._image_kernels import shade, to_raw
from florence_bt.simulation.sensors._surface_kernels import follow_pixels
from florence_bt.simulation.sensors.people_view import PeopleView, people_view
from florence_bt.simulation.sensors.scene import Lens


@dataclass(frozen=True, slots=True)
class KinectNoiseParameters(CheckedParameters):
    """The quality of the Kinect.

    Attributes:
        min_depth_m: What is nearer gives no value.
        max_depth_m: What is further gives no value.
        raw_noise: Standard deviation of the raw value; in metres it grows with the square of the depth.
        colour_noise: Largest error of a colour level.
    """

    min_depth_m: Annotated[float, Limits(0.3, 10.0)] = 0.5
    max_depth_m: Annotated[float, Limits(0.3, 10.0)] = 4.8
    raw_noise: NotNegative = 0.6
    colour_noise: Annotated[int, Limits(0, 100)] = 4

    def _check(self) -> None:
        check_order(self, ("min_depth_m", "max_depth_m"))


_LIGHT = np.array([0.3, -0.4, 0.866]) / np.linalg.norm([0.3, -0.4, 0.866])


class KinectSensor:
    """A Kinect on the robot; the depth and the colour image look through the same lens.

    Args:
        world: What is measured.
        mount: base_footprint from the depth optical frame.
        width: Columns; 320 as in our drivers, 160 for the fast rig, at most 640.
        height: Rows, three quarters of the columns.
        seed: Of the noise.
        parameters: How good the Kinect is.

    Raises:
        ConfigError: The size is not one that a Kinect could be scaled to.
    """

    def __init__(
        self,
        world: SimulatedWorld,
        mount: Transform3,
        width: int = 320,
        height: int = 240,
        seed: int = 0,
        parameters: KinectNoiseParameters | None = None,
    ) -> None:
        if not 0 < width <= 640 or 4 * height != 3 * width:
            raise ConfigError(
                f"no Kinect image has {width} x {height}", valid=("640 x 480", "320 x 240", "160 x 120")
            )
        focal = 525.0 * width / 640
        self.camera = CameraModel(width, height, focal, focal, width / 2 - 0.5, height / 2 - 0.5)
        """Source: REFERENCE 5.4."""
        self._lens = Lens(focal, self.camera.cx, self.camera.cy)
        self._world = world
        self._mount = mount
        self._parameters = parameters if parameters is not None else KinectNoiseParameters()
        self._rng = np.random.default_rng(seed)
        self._colour_rng = np.random.default_rng((seed, 1))
        self._depth = np.empty((height, width), np.float32)
        self._rows = np.empty((height, width), np.int16)
        self._seen: Pose2 | None = None
        self._noise = self._rng.standard_normal(_POOL * width * height, np.float32)
        self._noise *= np.float32(self._parameters.raw_noise)
        self._chance = self._rng.random(_POOL * width * height, np.float32)

    def measure(self) -> tuple[NDArray[np.uint16], NDArray[np.uint8]]:
        """Take both images at the same moment.

        Returns:
            The raw disparities, shape (height, width), 11 bits, 2047 for no value; and the colours, shape
            (height, width, 3), red green blue.
        """
        return self.measure_depth(), self.colours()

    def measure_depth(self) -> NDArray[np.uint16]:
        """Take the depth image alone, which costs about half; see :meth:`measure`."""
        self._look()
        p, shape = self._parameters, self._depth.shape
        noise, chance = self._draw(self._noise), self._draw(self._chance)
        raw = np.empty(shape, np.uint16)
        to_raw(self._depth, self._rows, noise, chance, p.min_depth_m, p.max_depth_m, raw)
        return raw

    def _draw(self, pool: NDArray[np.float32]) -> NDArray[np.float32]:
        """Draw a number for each pixel from a random place of a pool: much cheaper than new ones."""
        first = int(self._rng.integers(len(pool) - self._depth.size + 1))
        return pool[first : first + self._depth.size].reshape(self._depth.shape)

    def true_depth(self) -> NDArray[np.float32]:
        """Return the exact depth along the axis, metres, shape (height, width), infinite where nothing is."""
        self._look()
        return self._depth.copy()

    def _look(self) -> None:
        pose = self._world.robot_pose
        if self._world.resting and pose == self._seen:
            return
        self._seen = pose
        place = Transform3.from_pose2(pose) @ self._mount
        for measure in (cast_image, follow_pixels):
            measure(
                self._world.scene.shapes,
                place.translation,
                np.ascontiguousarray(place.rotation),
                self._lens,
                _SIGHT_M,
                self._depth,
                self._rows,
            )

    @property
    def view(self) -> PeopleView:
        """The people in the last depth image."""
        robot, p = self._seen, self._parameters
        assert robot is not None, "an image was taken"
        place, picture = Transform3.from_pose2(robot) @ self._mount, (self._depth, self._rows)
        measured = p.min_depth_m, p.max_depth_m
        return people_view(self._world.scene, robot, place, self._lens, picture, measured)

    def colours(self, step: int = 1) -> NDArray[np.uint8]:
        """Return the colours of the last depth image; see :meth:`measure`.

        Args:
            step: So many columns and rows further is the next pixel that is wanted, a power of two.
        """
        place = Transform3.from_pose2(self._seen or self._world.robot_pose) @ self._mount
        limit = self._parameters.colour_noise
        noise = self._colour_rng.integers(-limit, limit + 1, self._depth.shape, np.int8)
        depth, rows, noise = (
            np.ascontiguousarray(a[::step, ::step]) for a in (self._depth, self._rows, noise)
        )
        pixels = np.empty((*depth.shape, 3), np.uint8)
        shade(
            self._world.scene.shapes,
            place.translation,
            np.ascontiguousarray(place.rotation),
            Lens(*(value / step for value in self._lens)),
            _LIGHT,
            depth,
            rows,
            noise,
            pixels,
        )
        return pixels


_POOL = 4
"""Images' worth of random numbers that are drawn beforehand."""
_SIGHT_M = 12.0
"""Reach of the colour image: across the flat."""
