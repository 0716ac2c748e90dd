"""The Kinect driver without a camera: frames and the time go in, images in metres and colours come out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.errors import ConfigError
from florence_bt.core.limits import CheckedParameters, Limits
from florence_bt.core.sensing import CameraModel, ColourImage, DepthImage
from florence_bt.drivers.diagnosis import FrequencyMeter
from florence_bt.drivers.kinect._kernels import fill_points
from florence_bt.drivers.kinect.camera import BASELINE_M, View, camera_model
from florence_bt.drivers.kinect.codec import METRES_TABLES, DepthFormula
from florence_bt.drivers.kinect.frames import DepthFrame, Frame, VideoFrame

SLACK = 0.25
"""A frame may come early by this part of the wanted period and still count as due."""

TOGETHER_S = 0.1
"""A depth and a colour image that arrived so close to each other make coloured points."""


@dataclass(frozen=True, slots=True)
class KinectParameters(CheckedParameters):
    """The parameters of the Kinect.

    Attributes:
        source: Where frames come from: ``usb`` (the first Kinect), ``usb:1`` (the second) or ``usb:SERIAL``;
            ``recording:FOLDER`` or ``recording:FILE.mcap``; or the path of a Unix socket (simulated
            hardware).
        library: The file of libfreenect, or of fakenect; the usual ones when empty.
        width: Columns of the images that are published, 640, 320 or 160: of larger ones every second or
            fourth pixel is taken.
        formula: How raw depth becomes metres, A or B (REFERENCE 5.3).
        depth_registration: Have libfreenect move the depth images to the colour camera's view, in
            millimetres of its own calibration. Fakenect cannot. Coloured points do not need it.
        depth_rate: Depth images a second at most; 0 passes all.
        depth_time_offset: Added to the stamps of depth images, -1..1 s. The TurtleBot of the document's
            time had -0.055 s; here nothing is added unless asked for (REFERENCE 5.4).
        depth_frame_id: Optical frame of the depth camera.
        colour_frame_id: Optical frame of the colour camera.
        baseline: How far the colour camera is to the right of the depth camera, 0..0.1 m.
        reconnect_delay_s: Seconds before the source is opened again; doubled each time, up to ten times.
        silence_timeout_s: Without a depth image for this long the device counts as silent.
        reopen_timeout_s: Without a depth image for this long the device is opened again.
    """

    source: str = "usb"
    library: str = ""
    width: Literal[640, 320, 160] = 320
    formula: DepthFormula = DepthFormula.A
    depth_registration: bool = False
    depth_rate: Annotated[float, Limits(0.0, 1000.0)] = 0.0
    depth_time_offset: Annotated[float, Limits(-1.0, 1.0)] = 0.0
    depth_frame_id: str = "camera_depth_optical_frame"
    colour_frame_id: str = "camera_rgb_optical_frame"
    baseline: Annotated[float, Limits(0.0, 0.1)] = BASELINE_M
    reconnect_delay_s: Annotated[float, Limits(0.05, 60.0)] = 0.5
    silence_timeout_s: Annotated[float, Limits(0.05, 60.0)] = 2.0
    reopen_timeout_s: Annotated[float, Limits(0.1, 600.0)] = 10.0

    def _check(self) -> None:
        if not self.source:
            raise ConfigError("source is empty", valid=["usb", "recording:FOLDER", "the path of a socket"])


@dataclass(frozen=True, slots=True)
class _LatestImage:
    image: DepthImage
    arrived: float
    view: View


class KinectDriver:
    """Makes images of frames, no faster than wanted, and coloured points of images.

    Args:
        parameters: What was set.

    Attributes:
        depth_images: Depth images made so far.
    """

    def __init__(self, parameters: KinectParameters) -> None:
        self._parameters = parameters
        self._metres = METRES_TABLES[parameters.formula]
        self._frequency = FrequencyMeter()
        self._next_depth = float("-inf")
        self._last_depth: float | None = None
        self._unused: _LatestImage | None = None
        self._distances: NDArray[np.float32] | None = None
        self.depth_images = 0

    def note_depth(self, now: float) -> bool:
        """Note a depth frame that arrived; False if it came too soon after the last one that counts."""
        if not self._is_due(now):
            return False
        self._frequency.tick(now)
        self._last_depth = now
        self.depth_images += 1
        return True

    def depth_image(self, frame: DepthFrame, arrived: float) -> DepthImage:
        """Return the image of a frame that was noted when it arrived."""
        metres = frame.metres(self._step(frame), self._metres)
        self._distances = metres
        rows, columns = metres.shape
        registered = frame.view is View.COLOUR
        image = DepthImage(
            arrived + self._parameters.depth_time_offset,
            self._parameters.colour_frame_id if registered else self._parameters.depth_frame_id,
            camera_model(columns, rows, frame.view),
            metres,
        )
        self._unused = _LatestImage(image, arrived, frame.view)
        return image

    def depth(self, frame: DepthFrame, now: float) -> DepthImage | None:
        """Return the image of a frame that arrived at ``now``; None if too soon after the last one."""
        return self.depth_image(frame, now) if self.note_depth(now) else None

    def colour(self, frame: VideoFrame, now: float) -> ColourImage:
        """Return the colour image of a frame that arrived at ``now``."""
        pixels = frame.pixels(self._step(frame))
        rows, columns, _ = pixels.shape
        camera = camera_model(columns, rows)
        return ColourImage(now, self._parameters.colour_frame_id, camera, pixels)

    def coloured_points(self, colours: ColourImage) -> tuple[DepthImage, NDArray[np.float32]] | None:
        """Return the points of the latest depth image, each in the colour of the pixel it would be seen in.

        Args:
            colours: The latest colour image, as :meth:`colour` gave it.

        Returns:
            The depth image, and its points, shape (height, width, 4): x, y, z in metres in the image's
            frame, NaN where nothing was measured, and the bits of 0x00RRGGBB as a float. None when there is
            no depth image of about the same time that has not been used yet.
        """
        latest, self._unused = self._unused, None
        if latest is None or abs(colours.stamp - latest.arrived) > TOGETHER_S:
            return None
        image = latest.image
        points = np.empty((*image.depth.shape, 4), np.float32)
        fill_points(
            image.depth,
            _lens(image.camera),
            colours.pixels,
            _lens(colours.camera),
            self._parameters.baseline if latest.view is View.DEPTH else 0.0,
            points,
            points.view(np.uint32),
        )
        return image, points

    def rate(self, now: float) -> float:
        """Return the depth images per second that arrived lately."""
        return self._frequency.rate(now)

    @property
    def blind(self) -> bool:
        """Tell whether the last depth image has no distance in it."""
        return self._distances is not None and not bool(np.isfinite(self._distances).any())

    def silent(self, now: float) -> bool:
        """Tell whether depth images have not come for a while, or never came."""
        return self._last_depth is None or now - self._last_depth > self._parameters.silence_timeout_s

    def silence(self, opened: float, now: float) -> float:
        """Return the seconds since the last depth image, or since the device was opened if that is later."""
        return now - opened if self._last_depth is None else now - max(opened, self._last_depth)

    def _step(self, frame: Frame) -> int:
        return max(1, frame.width // self._parameters.width)

    def _is_due(self, now: float) -> bool:
        if self._parameters.depth_rate <= 0.0:
            return True
        period = 1.0 / self._parameters.depth_rate
        late = now - self._next_depth
        if late < -SLACK * period:
            return False
        # Keeping to the grid makes 20 Hz out of 30 Hz; taking every frame 50 ms after the last would make 15.
        self._next_depth = self._next_depth + period if late < period else now + period
        return True


def _lens(camera: CameraModel) -> tuple[float, float, float]:
    return camera.fx, camera.cx, camera.cy
