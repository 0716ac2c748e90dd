"""The Kinect as a component: frames in; pictures, points and how it does out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from florence_bt.core import topic_names
from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnoses, Diagnosis, Severity
from florence_bt.core.ports import Delivery, Ports, Topic
from florence_bt.core.sensing import DepthImage
from florence_bt.core.topics import COLOUR, DEPTH, DIAGNOSES
from florence_bt.drivers.diagnosis import DIAGNOSTICS_PERIOD_S
from florence_bt.drivers.kinect.camera import depth_to_points
from florence_bt.drivers.kinect.codec import millimetres_from_metres
from florence_bt.drivers.kinect.driver import KinectDriver
from florence_bt.drivers.kinect.frames import DepthFrame, VideoFrame

BLIND = "no pixel of the depth images has a distance: is the lens covered, or does the sun shine into it?"
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Points:
    """Points of a depth picture.

    Attributes:
        stamp: Seconds.
        frame_id: Their frame.
        points: Shape (height, width, 3) in metres, or (height, width, 4) with the bits of 0x00RRGGBB.
    """

    stamp: float
    frame_id: str
    points: NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Millimetres:
    """A depth picture in whole millimetres, shape (height, width), 0 where nothing was measured."""

    stamp: float
    frame_id: str
    depth: NDArray[np.uint16]


RAW_DEPTH = Topic(topic_names.RAW_DEPTH_IMAGE, Millimetres, Delivery.SENSOR, "sensor_msgs/msg/Image")
DEPTH_POINTS, COLOURED_POINTS, REGISTERED_POINTS = (
    Topic(name, Points, Delivery.SENSOR, "sensor_msgs/msg/PointCloud2")
    for name in (topic_names.DEPTH_POINTS, "camera/rgb/points", "camera/depth_registered/points")
)


class LaterPicture(Generic[T]):
    """A picture that is made when somebody reads it first."""

    def __init__(self, stamp: float, make: Callable[[], T]) -> None:
        self.stamp = stamp
        self._make = make
        self._made: T | None = None

    def read(self) -> T:
        """Return the picture."""
        if self._made is None:
            self._made = self._make()
        return self._made


class FrameLine(Protocol):
    """Source of the frames: a USB library or a socket on a robot, the simulated Kinect in the rig."""

    @property
    def problem(self) -> str:
        """Say why none come; empty once they do."""

    @property
    def lost(self) -> int:
        """Return how often it was lost so far."""

    def works(self) -> None:
        """Note that a frame has come."""


class CameraSeeing:
    """Tells depth pictures and how the Kinect does; to those who look also colours, points and the like.

    Source: document, section 2.2; REFERENCE 5.4.
    """

    def __init__(self, ports: Ports, driver: KinectDriver, line: FrameLine, source: str) -> None:
        """Connect the Kinect.

        Args:
            ports: Its connections.
            driver: Makes pictures of frames.
            line: Where those come from.
            source: The same for people.
        """
        self._ports, self._driver, self._line, self._source = ports, driver, line, source
        output = ports.output
        self._depth, self._colour, self._raw = output(DEPTH), output(COLOUR), output(RAW_DEPTH)
        self._points = output(DEPTH_POINTS)
        self._coloured = [output(COLOURED_POINTS), output(REGISTERED_POINTS)]
        self._diagnoses = output(DIAGNOSES)
        self._diagnosing = call_every(ports.clock, DIAGNOSTICS_PERIOD_S, self._tell_diagnoses)

    def close(self) -> None:
        """Tell nothing more."""
        self._diagnosing.cancel()

    @property
    def colour_wanted(self) -> bool:
        """Tell whether somebody looks at colours."""
        return bool(self._colour.listeners) or any(topic.listeners for topic in self._coloured)

    def take_depth(self, frame: Callable[[], DepthFrame], arrived: float) -> None:
        """Take a depth frame.

        Args:
            frame: Gives it; called at once or while it is the present one, or never.
            arrived: When it came.
        """
        self._line.works()
        if not self._driver.note_depth(arrived):
            return
        picture = LaterPicture(arrived, lambda: self._driver.depth_image(frame(), arrived))
        self._depth.send(picture)
        if self._raw.listeners:
            self._raw.send(_millimetres(picture.read()))
        if self._points.listeners:
            image = picture.read()
            points = depth_to_points(image.depth, image.camera)
            self._points.send(Points(image.stamp, image.frame_id, points))

    def take_colour(self, frame: Callable[[], VideoFrame], arrived: float) -> None:
        """Take a colour frame; arguments as in :meth:`take_depth`."""
        picture = LaterPicture(arrived, lambda: self._driver.colour(frame(), arrived))
        if self._colour.listeners:
            self._colour.send(picture)
        wanted = [topic for topic in self._coloured if topic.listeners]
        coloured = self._driver.coloured_points(picture.read()) if wanted else None
        if coloured is not None:
            image, points = coloured
            for topic in wanted:
                topic.send(Points(image.stamp, image.frame_id, points))

    def _tell_diagnoses(self) -> None:
        found = {"Kinect": self._diagnose(self._ports.clock.now())}
        self._diagnoses.send(Diagnoses(found, self._source))

    def _diagnose(self, now: float) -> Diagnosis:
        values = {
            "Source": self._source,
            "Frequency": f"{self._driver.rate(now):.2f}",
            "Depth Images": str(self._driver.depth_images),
            "Times Lost": str(self._line.lost),
        }
        judged = partial(Diagnosis, values=values)
        if self._line.problem:
            return judged(Severity.ERROR, self._line.problem)
        if self._driver.silent(now):
            return judged(Severity.ERROR, "no depth images arrive")
        if self._driver.blind:
            return judged(Severity.WARN, BLIND)
        return judged(Severity.OK, "depth images arrive")


def _millimetres(image: DepthImage) -> Millimetres:
    return Millimetres(image.stamp, image.frame_id, millimetres_from_metres(image.depth))
