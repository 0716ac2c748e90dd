"""The Kinect driver without a camera: frames and the time go in, pictures in metres and colours come out."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.core.errors import ConfigError
from florence_bt.core.sensing import ColourImage, DepthImage
from florence_bt.drivers.frequency import FrequencyMeter
from florence_bt.drivers.kinect.camera import camera_model
from florence_bt.drivers.kinect.frames import DepthFrame, VideoFrame

SLACK = 0.25
"""A frame may come early by this part of the wanted period and still count as due."""


@dataclass(frozen=True, slots=True)
class KinectParameters:
    """What can be set on the Kinect.

    Attributes:
        source: The Unix socket that the frames come from.
        depth_rate: Depth pictures a second at most; 0 passes all.
        depth_time_offset: Added to the stamps of depth pictures, -1..1 s. The TurtleBot of the document's
            time had -0.055 s; here nothing is added unless asked for (REFERENCE 5.4).
        depth_frame_id: Optical frame of the depth camera.
        colour_frame_id: Optical frame of the colour camera.
        reconnect_delay_s: Seconds before the source is opened again; doubled each time, up to ten times.
        silence_timeout_s: Without a depth picture for so long the device counts as silent.
    """

    source: str = "/run/florence/kinect.sock"
    depth_rate: float = 0.0
    depth_time_offset: float = 0.0
    depth_frame_id: str = "camera_depth_optical_frame"
    colour_frame_id: str = "camera_rgb_optical_frame"
    reconnect_delay_s: float = 0.5
    silence_timeout_s: float = 2.0

    def __post_init__(self) -> None:
        for name, value, lowest, highest in (
            ("depth_rate", self.depth_rate, 0.0, 1000.0),
            ("depth_time_offset", self.depth_time_offset, -1.0, 1.0),
            ("reconnect_delay_s", self.reconnect_delay_s, 0.05, 60.0),
            ("silence_timeout_s", self.silence_timeout_s, 0.05, 60.0),
        ):
            if not lowest <= value <= highest:
                raise ConfigError(f"{name} {value!r} is out of range", valid=[f"{lowest}..{highest}"])


class KinectDriver:
    """Makes pictures of frames, no faster than wanted.

    Args:
        parameters: What was set.

    Attributes:
        depth_pictures: Depth pictures made so far.
    """

    def __init__(self, parameters: KinectParameters) -> None:
        self._parameters = parameters
        self._frequency = FrequencyMeter()
        self._next_depth = float("-inf")
        self._last_depth: float | None = None
        self.depth_pictures = 0

    def depth(self, frame: DepthFrame, now: float) -> DepthImage | None:
        """The depth picture of a frame that arrived at ``now``; None when it came too soon after the last."""
        if not self._is_due(now):
            return None
        self._frequency.tick(now)
        self._last_depth = now
        self.depth_pictures += 1
        return DepthImage(
            now + self._parameters.depth_time_offset,
            self._parameters.depth_frame_id,
            camera_model(frame.width, frame.height),
            frame.metres(),
        )

    def colour(self, frame: VideoFrame, now: float) -> ColourImage:
        """The colour picture of a frame that arrived at ``now``."""
        camera = camera_model(frame.width, frame.height)
        return ColourImage(now, self._parameters.colour_frame_id, camera, frame.pixels())

    def rate(self, now: float) -> float:
        """Depth pictures a second that did arrive lately."""
        return self._frequency.rate(now)

    def silent(self, now: float) -> bool:
        """Whether depth pictures have not come for a while, or never came."""
        return self._last_depth is None or now - self._last_depth > self._parameters.silence_timeout_s

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
