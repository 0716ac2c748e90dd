"""The Kinect of the rig: the driver and the component of the robot before a simulated one without a source.

Colours are rendered when somebody reads them.
"""

from __future__ import annotations

from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.ports import Ports
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, VideoFrame
from florence_bt.drivers.kinect.seeing import CameraSeeing
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor

KINECT_PERIOD_S = 0.2
"""Slower than the Kinect's 30 Hz: to look for people in a picture is by far the dearest thing in the rig."""
PICTURE_SIZE = 320, 240
"""Columns and rows of the depth picture, as on the robot."""
COLOUR_STEP = 2
"""The colours of every second column and row are rendered: the detector looks at so many only."""


class SimulatedKinect:
    """Renders the frames that are read.

    Attributes:
        problem: None, in words.
        lost: Never.
    """

    problem, lost = "", 0

    def __init__(self, sensor: KinectSensor, clock: ManualClock) -> None:
        self._sensor, self._clock = sensor, clock

    def works(self) -> None:
        """Know that already."""

    def depth(self) -> DepthFrame:
        """Render the distances as they are now."""
        raw = self._sensor.measure_depth()
        rows, columns = raw.shape
        return DepthFrame(columns, rows, self._clock.now(), raw, DepthEncoding.RAW)

    def colours(self) -> VideoFrame:
        """Render the colours of what the last distances show."""
        pixels = self._sensor.colours(COLOUR_STEP)
        rows, columns, _ = pixels.shape
        return VideoFrame(columns, rows, self._clock.now(), pixels)


def connect_kinect(
    ports: Ports,
    sensor: KinectSensor,
    world: SimulatedWorld,
    parameters: KinectParameters,
    clock: ManualClock,
) -> None:
    """Connect the Kinect.

    Args:
        ports: Its connections.
        sensor: What it would measure.
        world: Where.
        parameters: The driver's.
        clock: Drives it.
    """
    kinect = SimulatedKinect(sensor, clock)
    seeing = CameraSeeing(ports, KinectDriver(parameters), kinect, "the rig")

    def look() -> None:
        world.step_to(clock.now())
        frame = kinect.depth()  # who reads it later sees the world as it is now
        seeing.take_colour(kinect.colours, clock.now())
        seeing.take_depth(lambda: frame, clock.now())

    call_every(clock, KINECT_PERIOD_S, look)
