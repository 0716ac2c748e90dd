"""Bags of ROS: MCAP and SQLite files of ROS 2, bag files of ROS 1. The package rosbags reads the bytes."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import Any

from florence_bt.app.maps.recordings.bag_files import COMPRESSED, open_bag
from florence_bt.app.maps.recordings.recording import Choices, RecordedScan
from florence_bt.core.errors import ConfigError, FrameError, closest_first
from florence_bt.core.installation import how_to_get
from florence_bt.core.sensing import LaserScan
from florence_bt.core.transforms import Transform3, TransformBuffer, TransformUnavailable
from florence_bt.ros.conversions import (
    frame_from_ros,
    odometry_from_ros,
    scan_from_ros,
    transform_from_ros,
)
from florence_bt.ros.validation import CHECKS, BadMessage

SCAN, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
BASE_FRAMES = ("base_footprint", "base_link")
_ODOM, _BASE = "the odometry", "the base"
"""Frames of an odometry that does not come by tf."""
_FIRST_TRANSFORMS = 2000
"""In so many messages of tf each frame of the robot comes."""
_KEEP_S = 30.0
"""Odometry may be recorded so much later than a scan of the same moment."""


def read_bag(path: Path, choices: Choices) -> Iterator[RecordedScan]:
    """Read the scans of a bag.

    Args:
        path: The file, or the folder of a rosbag2.
        choices: Which topics and frames.

    Raises:
        ConfigError: As :func:`read_recording`.
    """
    with _Bag(path) as bag:
        scan_topic = _choose(bag, SCAN, choices.scan, "laser scan", "--scan")
        odometry_topic = None
        if choices.odometry is not None or bag.topics_of(ODOMETRY):
            odometry_topic = _choose(bag, ODOMETRY, choices.odometry, "odometry", "--odom")
        yield from _Reading(bag, choices, scan_topic, odometry_topic).scans()


class _Bag:
    """A bag that is open."""

    def __init__(self, path: Path) -> None:
        try:
            from rosbags.typesys import Stores, get_typestore
        except ModuleNotFoundError as error:
            if not (error.name or "").startswith("rosbags"):
                raise
            problem = "bags are read by rosbags, which is not installed"
            raise ConfigError(problem, valid=[how_to_get("rosbags")]) from error
        self.path = path
        one = Path(path.stem if path.suffix in COMPRESSED else path.name).suffix == ".bag"
        store = get_typestore(Stores.ROS1_NOETIC if one else Stores.ROS2_JAZZY)
        self._decode = store.deserialize_ros1 if one else store.deserialize_cdr
        with ExitStack() as stack:
            try:
                self._readers = open_bag(path, stack)
            except ConfigError:
                raise
            except Exception as error:
                # Damaged files raise whatever their first wrong byte leads to.
                raise self._damaged(error) from error
            self._open = stack.pop_all()

    def _damaged(self, error: Exception) -> ConfigError:
        whole = {".mcap": "a copy that is whole", ".bag": f"rosbag reindex {self.path}"}
        valid = [whole.get(self.path.suffix, f"ros2 bag reindex {self.path}")]
        return ConfigError(f"the bag cannot be read: {error}", file=self.path, valid=valid)

    def __enter__(self) -> _Bag:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    @property
    def _connections(self) -> list[Any]:
        return [each for reader in self._readers for each in reader.connections]

    def topics_of(self, *types: str) -> dict[str, int]:
        """Return the topics of some types, and how many messages each has."""
        found: dict[str, int] = {}
        for each in self._connections:
            if each.msgtype in types:
                found[each.topic] = found.get(each.topic, 0) + each.msgcount
        return {topic: count for topic, count in sorted(found.items()) if count}

    def topics(self) -> list[str]:
        """Return all topics with their types."""
        return sorted({f"{each.topic} ({each.msgtype})" for each in self._connections})

    def _raw_messages(self, topics: set[str]) -> Iterator[tuple[Any, int, bytes]]:
        for reader in self._readers:
            connections = [each for each in reader.connections if each.topic in topics]
            if connections:
                yield from reader.messages(connections)

    def messages(self, topics: Iterable[str]) -> Iterator[tuple[str, str, Any, float]]:
        """Yield topic, type, message and the part of the bag that is read, in the order of recording."""
        wanted = set(topics)
        if not any(each.topic in wanted for each in self._connections):
            return
        start = min(reader.start_time for reader in self._readers)
        duration = max(1, max(reader.end_time for reader in self._readers) - start)
        stream = self._raw_messages(wanted)
        while True:
            try:
                connection, moment, data = next(stream)
                message = self._decode(data, connection.msgtype)
            except StopIteration:
                return
            except Exception as error:
                raise self._damaged(error) from error
            yield connection.topic, connection.msgtype, message, (moment - start) / duration


def _choose(bag: _Bag, kind: str, wanted: str | None, name: str, option: str) -> str:
    """Return the topic of a type: the wanted one, or the only one."""
    known = bag.topics_of(kind)
    if wanted is not None:
        for topic in (wanted, f"/{wanted.lstrip('/')}"):
            if topic in known:
                return topic
        valid = closest_first(wanted, known) if known else bag.topics()
        raise ConfigError(f"no {name} is recorded on {wanted!r}", file=bag.path, valid=valid)
    if not known:
        problem = f"no {name} ({kind}) is recorded; the topics are {', '.join(bag.topics()) or 'none'}"
        raise ConfigError(problem, file=bag.path, valid=["a recording of scan, odom, tf and tf_static"])
    if len(known) > 1:
        counts = ", ".join(f"{topic} ({count} messages)" for topic, count in known.items())
        problem = f"there is more than one {name}: {counts}"
        raise ConfigError(problem, file=bag.path, valid=[f"{option} {topic}" for topic in known])
    return next(iter(known))


class _Reading:
    """Reads a bag once the topics are chosen: each scan waits until the odometry has reached it."""

    def __init__(self, bag: _Bag, choices: Choices, scan_topic: str, odometry_topic: str | None) -> None:
        self._bag, self._choices = bag, choices
        self._scan_topic, self._odometry_topic = scan_topic, odometry_topic
        self._tf_topics = bag.topics_of(*TRANSFORMS)
        self._odom_frame = frame_from_ros(choices.odom_frame)
        self._base_frame = frame_from_ros(choices.base_frame or "")
        self._links: dict[str, tuple[str, Transform3]] = {}
        self._buffer = TransformBuffer(_KEEP_S)
        self._waiting: deque[tuple[LaserScan, float]] = deque()
        self._newest: float | None = None
        self._span: tuple[float, float] | None = None
        self._bad: list[str] = []
        self._mount = choices.mount

    def scans(self) -> Iterator[RecordedScan]:
        bag = self._bag
        static = [topic for topic in self._tf_topics if "static" in topic]
        moving = [topic for topic in self._tf_topics if topic not in static]
        for _, _, message, _ in bag.messages(static):
            self._take_transforms(message, static=True)
        for _, _, message, _ in islice(bag.messages(moving), _FIRST_TRANSFORMS):
            self._take_transforms(message, static=False, sample=False)
        topics = [self._scan_topic]
        topics += [self._odometry_topic] if self._odometry_topic else moving
        if not self._odometry_topic:
            self._choose_frames()
        found = False
        for topic, kind, message, read in bag.messages(topics):
            if topic == self._scan_topic:
                self._take_scan(message, read)
            elif kind == ODOMETRY:
                self._take_odometry(message)
            else:
                self._take_transforms(message, static=False)
            for recorded in self._ready(end=False):
                found = True
                yield recorded
        for recorded in self._ready(end=True):
            found = True
            yield recorded
        if not found:
            raise self._nothing_fits()

    def _choose_frames(self) -> None:
        """Find the robot's frame in tf, where no odometry names it."""
        wanted = (self._base_frame,) if self._base_frame else BASE_FRAMES
        for base in wanted:
            if self._odom_frame in self._line_above(base):
                self._base_frame = base
                return
        frames = sorted({*self._links, *(parent for parent, _ in self._links.values())})
        problem = (
            f"no odometry is recorded: neither {ODOMETRY}, nor the frame {' or '.join(wanted)} below "
            f"{self._odom_frame!r} in tf; the frames are {', '.join(frames) or 'none'}"
        )
        valid = ["a recording of odom, or of tf", "--odom-frame FRAME --base-frame FRAME"]
        raise ConfigError(problem, file=self._bag.path, valid=valid)

    def _line_above(self, frame: str) -> list[str]:
        line = [frame]
        while line[-1] in self._links and self._links[line[-1]][0] not in line:
            line.append(self._links[line[-1]][0])
        return line

    def _take_transforms(self, message: Any, *, static: bool, sample: bool = True) -> None:
        for each in message.transforms:
            try:
                parent, child, stamp, transform = transform_from_ros(each)
            except FrameError as error:
                self._bad.append(str(error))
                continue
            self._links[child] = (parent, transform)
            if static:
                self._buffer.set_static(parent, child, transform)
            elif sample:
                self._buffer.set_moving(parent, child, stamp, transform.to_pose2())
                if child in self._line_above(self._base_frame):
                    self._saw(stamp)

    def _take_odometry(self, message: Any) -> None:
        if not self._base_frame:
            self._base_frame = frame_from_ros(message.child_frame_id) or BASE_FRAMES[0]
        try:
            CHECKS["nav_msgs/Odometry"](message, None)
        except BadMessage as error:
            self._bad.append(str(error))
            return
        odometry = odometry_from_ros(message)
        self._buffer.set_moving(_ODOM, _BASE, odometry.stamp, odometry.pose)
        self._saw(odometry.stamp)

    def _saw(self, stamp: float) -> None:
        if self._newest is not None and stamp < self._newest - _KEEP_S:
            self._buffer.clear_moving()
        self._newest = stamp
        low, high = self._span or (stamp, stamp)
        self._span = min(low, stamp), max(high, stamp)

    def _take_scan(self, message: Any, read: float) -> None:
        try:
            CHECKS["sensor_msgs/LaserScan"](message, None)
        except BadMessage as error:
            self._bad.append(str(error))
            return
        self._waiting.append((scan_from_ros(message), read))

    def _ready(self, *, end: bool) -> Iterator[RecordedScan]:
        """Yield the scans whose middle the odometry has reached."""
        frames = (_ODOM, _BASE) if self._odometry_topic else (self._odom_frame, self._base_frame)
        while self._waiting and self._newest is not None:
            scan, read = self._waiting[0]
            if scan.middle_stamp > self._newest and not end:
                return
            self._waiting.popleft()
            try:
                odom = self._buffer.lookup_pose(*frames, scan.middle_stamp)
            except TransformUnavailable:
                # Before the first odometry, or in a gap of it.
                continue
            yield RecordedScan(scan, self._mounted(scan.frame_id), odom, min(1.0, read))

    def _mounted(self, frame: str) -> Transform3:
        if self._mount is None:
            self._mount = self._find_mount(frame)
        return self._mount

    def _find_mount(self, frame: str) -> Transform3:
        if self._choices.urdf is not None:
            from florence_bt.skills.robot_description.description import load_description

            self._links = {
                child: (parent, at) for parent, child, at in load_description(self._choices.urdf).frames
            }
        line = self._line_above(frame)
        # A laser that is described beside the robot's frame, below one above both.
        base_line = self._line_above(self._base_frame)
        root = next((each for each in line if each in base_line), None)
        if root is None:
            frames = sorted({*self._links, *(parent for parent, _ in self._links.values())})
            problem = (
                f"nothing tells where the laser {frame!r} is on the robot {self._base_frame!r}; "
                f"the frames are {', '.join(frames) or 'none'}"
            )
            valid = [
                "a recording of tf_static",
                "--urdf FILE",
                "--mount 'X Y Z ROLL PITCH YAW' (metres, degrees; roll 180: upside down)",
                "--base-frame FRAME",
            ]
            raise ConfigError(problem, file=self._bag.path, valid=valid)
        return self._down(base_line, root).inverse() @ self._down(line, root)

    def _down(self, line: Sequence[str], root: str) -> Transform3:
        """Return the transform from the first frame of a line to one above it."""
        found = Transform3.identity()
        for child in line[: line.index(root)]:
            found = self._links[child][1] @ found
        return found

    def _nothing_fits(self) -> ConfigError:
        if self._bad:
            problem, valid = f"no message can be used: {self._bad[0]}", "finite numbers in metres and radians"
        elif self._span is None:
            problem, valid = "the odometry never tells where the robot is", "a recording of odom, or of tf"
        else:
            low, high = self._span
            problem = f"no scan has the time of the odometry, which is from {low:.1f} to {high:.1f} s"
            valid = "stamps of one clock in scan and odom"
        return ConfigError(problem, file=self._bag.path, valid=[valid])
