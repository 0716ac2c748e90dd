"""The node ``recorder``: what is published, as it comes, into files and to Foxglove."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any

import foxglove
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from florence_bt.app.recording.files import RecordingFiles, RecordingLimits, make_folder
from florence_bt.app.recording.foxglove_port import FoxglovePort, bind, check_origins
from florence_bt.app.recording.intake import Intake
from florence_bt.app.recording.schemas import message_schema
from florence_bt.core.clock import call_every
from florence_bt.core.errors import ConfigError
from florence_bt.core.limits import CheckedParameters, Limits, Positive
from florence_bt.core.topic_names import CLOCK
from florence_bt.ros.arguments import namespace
from florence_bt.ros.node import FlorenceNode

TOPICS_LOOK_S = 1.0
"""Period of looking for topics: what a topic says before it is found is not recorded, unless latched."""
LOOKS_AT_KNOWN, LOOKS_AT_OFFERS = 5, 50
"""Every so many looks the publishers of known topics are counted, and all their offers looked at: for each
topic the one takes a tenth of a millisecond, the other a whole one."""
TAKE_S = 0.1
"""Period of writing what came: Foxglove shows it so much later."""
QUEUE_DEPTH = 500
"""Messages of a topic that may wait to be taken."""
INTAKE = "_recorder_intake"
"""The node that hears the topics."""
MOST_HELD = 64_000_000
"""Bytes of messages that may wait for the time of a simulation; with more, nobody waits any longer."""
PICTURES = frozenset({"Image", "CompressedImage", "PointCloud2", "MultiEchoLaserScan"})
"""Types of sensor_msgs that have 100 times the bytes of all others; cameras make them on demand."""
OF_ALL_ROBOTS = ("/tf", "/tf_static", CLOCK, "/rosout", "/diagnostics")
"""Topics that a robot in a namespace may share with others."""
_CLOCK = "rosgraph_msgs/msg/Clock"
_TIME = struct.Struct("<4xiI")
"""The beginning of a serialised message with a time: the CDR header, seconds, nanoseconds."""


@dataclass(frozen=True, slots=True)
class RecorderParameters(CheckedParameters):
    """Parameters of the recorder.

    Attributes:
        folder: Where the files go; empty for no files.
        topics: Patterns such as ``/scan`` or ``*costmap*``: what to record; without one everything but
            pictures.
        exclude: Patterns of topics that are left out.
        pictures: Whether images and clouds of points are recorded.
        clock_wait: Seconds that what comes first waits for the time of a simulation, by which it is written;
            after that the time of this machine counts until a simulation tells its own.
        foxglove_port: The TCP port of 127.0.0.1 at which Foxglove finds the robot; 0 for none.
        foxglove_origins: Web sites that may look there, such as ``https://app.foxglove.dev``; the desktop
            application always may.
    """

    folder: str = ""
    topics: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()
    pictures: bool = False
    clock_wait: Positive = 2.0
    foxglove_port: Annotated[int, Limits(0, 65535)] = 0
    foxglove_origins: tuple[str, ...] = ()


class _Topic:
    """A topic that is recorded or looked at.

    Attributes:
        count: Messages that were written.
        publishers: How many offered it when that was looked at.
        viewers: How many clients of Foxglove look at it.
        recorded: Whether it goes into the files.
    """

    def __init__(self, name: str, type_name: str, channel: foxglove.Channel) -> None:
        self.name = name
        self.type_name = type_name
        self.channel = channel
        self.count = 0
        self.viewers = 0
        self.recorded = False
        self.qos: QoSProfile | None = None
        self.publishers = 0

    @property
    def is_used(self) -> bool:
        return self.recorded or self.viewers > 0

    @property
    def is_latched(self) -> bool:
        return self.qos is not None and self.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL


class RecorderNode(FlorenceNode):
    """Writes what is published into MCAP files without decoding it, and shows it to Foxglove.

    Subscriptions ask for what the publishers offer, so that reliable messages arrive reliably and latched
    ones are in every file. Hidden topics, such as those of actions, are left out, as rosbag2 does.

    Args:
        parameters: Overrides of the node's parameters.

    Raises:
        ConfigError: There is nothing to do, the folder cannot be written to, the port is taken, or an origin
            is none.
    """

    parameter_classes = (RecorderParameters, RecordingLimits)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("recorder", parameters=parameters)
        self._params = params = self.read_parameters(RecorderParameters)
        limits = self.read_parameters(RecordingLimits)
        if not params.folder and not params.foxglove_port:
            raise ConfigError("nothing to record for", valid=["folder", "foxglove_port"])
        self._logged = foxglove.Context()
        self._intake = Intake(INTAKE, self.context)
        # A viewer's leave may come after the close, from a thread of the server.
        self.on_destroy(self._intake.close)
        self._topics: dict[str, _Topic] = {}
        self._refused: set[str] = set()
        self._looks = 0
        self._simulated_ns: int | None = None
        self._held: list[tuple[_Topic, bytes, int]] | None = []
        self._held_bytes = 0
        self._files: RecordingFiles | None = None
        if params.folder:
            self._files = RecordingFiles(Path(params.folder), limits, self._logged, self._is_wanted)
            self.on_close(self._files.close)
            for line in self._files.mended:
                self.get_logger().warning(line)
        self.on_close(self._write_held)
        self.on_close(self._take)
        self._names: dict[int, str] = {}
        self._shown = self._serve_foxglove(params.foxglove_port) if params.foxglove_port else None
        call_every(self.steady, TOPICS_LOOK_S, self._look)
        call_every(self.steady, TOPICS_LOOK_S, self._keep_bounds)
        call_every(self.steady, TAKE_S, self._take)
        self.steady.call_at(self.steady.now() + params.clock_wait, self._write_held)
        self._look()

    @property
    def counts(self) -> Counter[str]:
        """Count the messages of each topic that were written."""
        return Counter({each.name: each.count for each in self._topics.values() if each.recorded})

    @property
    def types(self) -> Mapping[str, str]:
        """The type of each topic that is recorded."""
        return {each.name: each.type_name for each in self._topics.values() if each.recorded}

    @property
    def files(self) -> RecordingFiles | None:
        """The files that are written."""
        return self._files

    # ---- topics ---------------------------------------------------------------------------------------

    def _look(self) -> None:
        """Find new topics, and follow changed publishers."""
        for name, (type_name, *_) in self.get_topic_names_and_types():
            if name in self._refused or not self._is_ours(name):
                continue
            try:
                self._follow(name, type_name)
            except Exception as error:  # of the middleware: one topic holds up no other
                self._refuse(name, error)
        self._looks += 1

    def _keep_bounds(self) -> None:
        """Keep the bounds of the files."""
        if self._files is None:
            return
        try:
            begun = self._files.look()
        except ConfigError as error:
            self.get_logger().error(str(error))
            self.fatal = error
            return
        for topic in self._topics.values():
            if begun and topic.is_latched:
                self._subscribe(topic)  # which brings its last message into the new file, too

    def _is_ours(self, name: str) -> bool:
        """Tell whether a topic is one of this robot's, and not hidden."""
        robot = namespace()
        below = not robot or name.startswith(f"{robot}/") or name in OF_ALL_ROBOTS
        return below and "/_" not in name

    def _follow(self, name: str, type_name: str) -> None:
        topic = self._topics.get(name)
        if topic is not None and self._looks % LOOKS_AT_KNOWN:
            return
        count = self.count_publishers(name)
        if topic is not None and topic.publishers == count and self._looks % LOOKS_AT_OFFERS:
            return
        publishers = self.get_publishers_info_by_topic(name)
        if not publishers:
            return
        if topic is None:
            topic = self._new_topic(name, type_name)
            if topic is None:
                return
        topic.publishers = count
        qos = _qos_of([each.qos_profile for each in publishers])
        if topic.qos != qos:
            topic.qos = qos
            self._subscribe(topic)

    def _new_topic(self, name: str, type_name: str) -> _Topic | None:
        try:
            schema = message_schema(type_name)
        except ConfigError as error:
            self._refuse(name, error)
            return None
        channel = foxglove.Channel(
            name,
            message_encoding="cdr",
            schema=foxglove.Schema(name=type_name, encoding="ros2msg", data=schema.encode()),
            context=self._logged,
        )
        topic = self._topics[name] = _Topic(name, type_name, channel)
        self._names[channel.id()] = name
        if self._shown is not None:
            self._shown.advertise(channel.id(), name, type_name, schema)
        topic.recorded = self._files is not None and self._is_wanted(name, type_name)
        return topic

    def _refuse(self, name: str, error: Exception) -> None:
        """Leave a topic out for good."""
        self._refused.add(name)
        self.get_logger().warning(f"{name} is not recorded: {error}")

    def _is_wanted(self, name: str, type_name: str) -> bool:
        patterns = self._params.topics
        if any(fnmatchcase(name, each) for each in self._params.exclude):
            return False
        if any(fnmatchcase(name, each) for each in patterns):
            return True
        package, _, last = type_name.partition("/msg/")
        is_picture = package == "sensor_msgs" and last in PICTURES
        return not patterns and (self._params.pictures or not is_picture)

    def _subscribe(self, topic: _Topic) -> None:
        """Subscribe to a topic that is recorded or looked at, once more if need be; else end that.

        The time of a simulation is always followed: all else is written by it.
        """
        if topic.qos is None or not (topic.is_used or topic.type_name == _CLOCK):
            self._intake.unsubscribe(topic.name)
        else:
            self._intake.subscribe(topic.name, topic.type_name, topic.qos)

    # ---- messages -------------------------------------------------------------------------------------

    def _take(self) -> None:
        """Write what came since the last time, or keep it until it is known which time counts."""
        for received_ns, name, serialised in self._intake.take():
            topic = self._topics[name]
            if topic.type_name == _CLOCK:
                seconds, nanoseconds = _TIME.unpack_from(serialised)
                self._simulated_ns = seconds * 1_000_000_000 + nanoseconds
                self._write_held()
            if self._held is None:
                self._write(topic, serialised, received_ns)
                continue
            self._held.append((topic, serialised, received_ns))
            self._held_bytes += len(serialised)
            if self._held_bytes > MOST_HELD:
                self._write_held()

    def _write(self, topic: _Topic, serialised: bytes, received_ns: int) -> None:
        if not topic.is_used:
            return
        topic.count += 1
        time_ns = self._simulated_ns or received_ns
        topic.channel.log(serialised, log_time=time_ns)
        if self._shown is not None and topic.viewers:
            self._shown.show(topic.channel.id(), time_ns, serialised)

    def _write_held(self) -> None:
        """Write what came before it was known which time counts, which nothing waits for any longer."""
        held, self._held = self._held or (), None
        for message in held:
            self._write(*message)

    # ---- Foxglove -------------------------------------------------------------------------------------

    def _serve_foxglove(self, port: int) -> FoxglovePort:
        """Show the topics at a port of this machine; cameras work only while somebody looks."""
        shown = FoxglovePort(port, self._params.foxglove_origins, self._on_look)
        self.on_close(shown.close)
        self.get_logger().info(f"Foxglove finds the robot at ws://127.0.0.1:{port}")
        return shown

    def _on_look(self, channel: int, more: int) -> None:
        """Hand over what a viewer does, from the thread of Foxglove's port."""
        self.call_soon(lambda: self.add_viewers(self._names[channel], more))

    def add_viewers(self, name: str, more: int) -> None:
        """Note that somebody began (1) or ceased (-1) to look at a topic."""
        topic = self._topics[name]
        topic.viewers += more
        # A new viewer needs the last message of a latched topic.
        if topic.name not in self._intake or not topic.recorded or (more > 0 and topic.is_latched):
            self._subscribe(topic)


def check_recorder(parameters: Mapping[str, Any]) -> None:
    """Refuse what a recorder would not start with, before anything starts.

    Raises:
        ConfigError: Its folder cannot be written to, the port for Foxglove is taken, or an origin is none.
    """
    bind(parameters.get("foxglove_port", 0)).close()
    check_origins(parameters.get("foxglove_origins", ()))
    if parameters["folder"]:
        make_folder(Path(parameters["folder"]))


def _qos_of(offers: Sequence[QoSProfile]) -> QoSProfile:
    """Return what a subscriber asks for that wants to hear all of these publishers, as well as it can."""
    reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offers)
    latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offers)
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=QUEUE_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
