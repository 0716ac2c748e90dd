"""What is published is in the recording, message for message, and Foxglove can look at it."""

from __future__ import annotations

import json
import socket
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("foxglove")
pytest.importorskip("rclpy")

import rclpy
from rclpy.qos import QoSProfile
from rosbags.highlevel import AnyReader
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import String

from florence_bt.app.recording import node as recording
from florence_bt.app.recording.intake import Intake
from florence_bt.app.recording.node import RecorderNode
from florence_bt.core.errors import ConfigError
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, SENSOR

pytestmark = pytest.mark.ros


@pytest.fixture(autouse=True)
def looks_often(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let new topics be found at once: each test waits for several."""
    monkeypatch.setattr(recording, "TOPICS_LOOK_S", 0.05)


def read(folder: Path) -> list[tuple[str, int, Any]]:
    """Return topic, time in nanoseconds and message of everything in the files of a folder, in order."""
    found = []
    for file in sorted(folder.glob("*.mcap")):
        with AnyReader([file]) as reader:
            found += [
                (connection.topic, stamp, reader.deserialize(data, connection.msgtype))
                for connection, stamp, data in reader.messages()
            ]
    return found


class Robot(FlorenceNode):
    """Publishes one topic of each kind."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.words = self.create_publisher(String, "words", RELIABLE)
        self.scan = self.create_publisher(LaserScan, "scan", SENSOR)
        self.map = self.create_publisher(String, "map", LATCHED)
        self.picture = self.create_publisher(Image, "camera", SENSOR)
        self.hidden = self.create_publisher(String, "drive/_action/feedback", RELIABLE)
        self.map.publish(String(data="the flat"))


def record(ros: Any, robot: Robot, folder: Path, **parameters: Any) -> RecorderNode:
    recorder = ros.add(RecorderNode(parameters={"folder": str(folder), **parameters}))
    ros.spin_until(lambda: recorder.counts["/map"] or "/map" not in recorder.types)
    ros.spin_until(lambda: all(each in recorder.types for each in ("/words", "/scan")))
    ros.spin_until(lambda: robot.words.get_subscription_count() and robot.scan.get_subscription_count())
    return recorder


def publish(ros: Any, robot: Robot, recorder: RecorderNode, count: int) -> None:
    for number in range(count):
        robot.words.publish(String(data=f"word {number}"))
        robot.scan.publish(LaserScan(ranges=[float(number)] * 683))
        robot.picture.publish(Image(height=1, width=1, data=[1]))
        robot.hidden.publish(String(data="a step"))
        ros.spin_until(lambda number=number: recorder.counts["/words"] > number)  # type: ignore[misc]
    ros.spin_until(lambda: recorder.counts["/scan"] == count)


def test_every_message_is_there_once_as_it_was(ros: Any, tmp_path: Path) -> None:
    robot = ros.add(Robot())
    recorder = record(ros, robot, tmp_path)
    publish(ros, robot, recorder, 50)
    counts = recorder.counts
    ros.close_node(recorder)
    found = read(tmp_path)
    assert Counter(topic for topic, _, _ in found) == counts
    assert [message.data for topic, _, message in found if topic == "/words"] == [
        f"word {number}" for number in range(50)
    ]
    assert [len(message.ranges) for topic, _, message in found if topic == "/scan"] == [683] * 50
    assert [message.data for topic, _, message in found if topic == "/map"] == ["the flat"]
    assert not {"/camera", "/drive/_action/feedback"} & set(counts)


def test_latched_messages_are_in_every_file(ros: Any, tmp_path: Path) -> None:
    robot = ros.add(Robot())
    recorder = record(ros, robot, tmp_path, file_size=0.001)
    assert recorder.files is not None
    publish(ros, robot, recorder, 5)
    ros.spin_until(lambda: len(recorder.files.written) > 1)
    ros.spin_until(lambda: recorder.counts["/map"] > 1)
    ros.close_node(recorder)
    second = recorder.files.written[1]
    with AnyReader([second]) as reader:
        assert "/map" in {connection.topic for connection, _, _ in reader.messages()}


def test_topics_are_chosen_by_patterns(ros: Any, tmp_path: Path) -> None:
    robot = ros.add(Robot())
    recorder = ros.add(
        RecorderNode(
            parameters={"folder": str(tmp_path), "topics": ("/cam*", "/s*", "/m*"), "exclude": ("/scan",)}
        )
    )
    ros.spin_until(lambda: recorder.counts["/map"] and robot.picture.get_subscription_count())
    assert set(recorder.types) == {"/map", "/camera"}
    assert not robot.words.get_subscription_count() and not robot.scan.get_subscription_count()


def test_the_time_is_that_of_the_simulation_from_the_first_message_on(ros: Any, tmp_path: Path) -> None:
    robot = ros.add(Robot())
    clock = robot.create_publisher(Clock, "/clock", RELIABLE)
    recorder = ros.add(RecorderNode(parameters={"folder": str(tmp_path)}))
    ros.spin_until(lambda: robot.words.get_subscription_count() and clock.get_subscription_count())
    robot.words.publish(String(data="before the first clock"))
    ros.spin_for(0.2)  # the map has come, too
    assert not recorder.counts.total()
    now = Clock()
    now.clock.sec, now.clock.nanosec = 17, 500_000_000
    clock.publish(now)
    ros.spin_until(lambda: recorder.counts["/words"] and recorder.counts["/map"])
    ros.close_node(recorder)
    stamps = {topic: stamp for topic, stamp, _ in read(tmp_path)}
    assert stamps["/words"] == stamps["/map"] == 17_500_000_000


def simulate(ros: Any, robot: Robot) -> Callable[[int], None]:
    """Return what tells the time of a simulation, in seconds."""
    clock = robot.create_publisher(Clock, "/clock", RELIABLE)

    def tell(seconds: int) -> None:
        ros.spin_until(lambda: clock.get_subscription_count(), what="somebody who follows the clock")
        now = Clock()
        now.clock.sec = seconds
        clock.publish(now)

    return tell


@pytest.mark.parametrize("chosen", [{"topics": ("/words",)}, {"exclude": ("/clock",)}])
def test_the_time_counts_also_where_it_is_not_recorded(
    ros: Any, tmp_path: Path, chosen: dict[str, Any]
) -> None:
    robot = ros.add(Robot())
    tell = simulate(ros, robot)
    recorder = ros.add(RecorderNode(parameters={"folder": str(tmp_path), **chosen}))
    ros.spin_until(lambda: robot.words.get_subscription_count())
    for seconds in (17, 18):
        tell(seconds)
        ros.spin_for(0.2)
        robot.words.publish(String(data="a word"))
        ros.spin_until(lambda seconds=seconds: recorder.counts["/words"] > seconds - 17)  # type: ignore[misc]
    ros.close_node(recorder)
    found = read(tmp_path)
    assert [stamp // 1_000_000_000 for topic, stamp, _ in found if topic == "/words"] == [17, 18]
    assert "/clock" not in {topic for topic, _, _ in found} | set(recorder.types)


@pytest.mark.parametrize("bound", ["clock_wait", "MOST_HELD"])
def test_nothing_waits_for_ever_for_a_clock_that_stands(
    ros: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bound: str
) -> None:
    robot = ros.add(Robot())
    clock = robot.create_publisher(Clock, "/clock", RELIABLE)
    parameters: dict[str, Any] = {"folder": str(tmp_path), "topics": ("/words", "/map")}
    if bound == "MOST_HELD":
        monkeypatch.setattr(recording, "MOST_HELD", 10)
    recorder = ros.add(
        RecorderNode(parameters={**parameters, "clock_wait": 0.5 if bound == "clock_wait" else 60.0})
    )
    ros.spin_until(lambda: robot.words.get_subscription_count() and clock.get_subscription_count())
    robot.words.publish(String(data="a word"))
    ros.spin_until(lambda: recorder.counts["/words"] and recorder.counts["/map"])


def test_a_publisher_that_offers_less_is_heard_too(
    ros: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "LOOKS_AT_KNOWN", 1)
    robot = ros.add(Robot())
    recorder = record(ros, robot, tmp_path)
    other = ros.add(FlorenceNode("other")).create_publisher(String, "words", SENSOR)
    ros.spin_until(lambda: other.get_subscription_count())
    other.publish(String(data="a whisper"))
    ros.spin_until(lambda: recorder.counts["/words"] == 1)


def free_port() -> int:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        port: int = server.getsockname()[1]
        return port


def test_foxglove_sees_what_it_asks_for_and_cameras_rest_otherwise(ros: Any, tmp_path: Path) -> None:
    client_of = pytest.importorskip("websockets.sync.client").connect
    robot = ros.add(Robot())
    tell = simulate(ros, robot)  # which nobody looks at
    port = free_port()
    ros.add(RecorderNode(parameters={"foxglove_port": port}))
    assert not robot.words.get_subscription_count()
    with client_of(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"]) as client:
        channels: dict[str, Any] = {}

        def advertised() -> bool:
            try:
                answer = json.loads(client.recv(timeout=0.01))
            except TimeoutError:
                return False
            channels.update({each["topic"]: each for each in answer.get("channels", ())})
            return {"/words", "/camera", "/map"} <= set(channels)

        ros.spin_until(advertised)
        assert channels["/camera"]["schemaName"] == "sensor_msgs/msg/Image"
        assert not robot.picture.get_subscription_count()
        wanted = [
            {"id": number, "channelId": channels[name]["id"]}
            for number, name in ((1, "/camera"), (2, "/map"))
        ]
        client.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        ros.spin_until(lambda: robot.picture.get_subscription_count())
        received: list[bytes] = []
        tell(17)

        def map_came() -> bool:
            try:
                answer = client.recv(timeout=0.01)
            except TimeoutError:
                return False
            if isinstance(answer, bytes):
                received.append(answer)
            return any(b"the flat" in each for each in received)

        ros.spin_until(map_came, what="the latched message")
    ros.spin_until(lambda: not robot.picture.get_subscription_count(), what="the camera at rest")


def test_a_viewer_who_leaves_while_the_recorder_closes_breaks_nothing(ros: Any, tmp_path: Path) -> None:
    robot = ros.add(Robot())
    recorder = record(ros, robot, tmp_path, foxglove_port=free_port())
    recorder.add_viewers("/camera", 1)
    ros.spin_until(lambda: robot.picture.get_subscription_count())
    recorder.shut_down()
    recorder.call_soon(lambda: recorder.add_viewers("/camera", -1))
    ros.spin_until(lambda: not robot.picture.get_subscription_count())


def test_what_is_only_looked_at_is_not_in_the_files(ros: Any, tmp_path: Path) -> None:
    robot = ros.add(Robot())
    recorder = record(ros, robot, tmp_path)
    recorder.add_viewers("/camera", 1)
    ros.spin_until(robot.picture.get_subscription_count)
    publish(ros, robot, recorder, 5)
    ros.spin_for(0.2)
    ros.close_node(recorder)
    assert {topic for topic, _, _ in read(tmp_path)} >= {"/words", "/scan", "/map"}
    assert "/camera" not in {topic for topic, _, _ in read(tmp_path)}


def test_a_port_that_is_taken_is_told(ros: Any) -> None:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        with pytest.raises(ConfigError, match="another port"):
            RecorderNode(parameters={"foxglove_port": server.getsockname()[1]})


def test_a_recorder_without_a_purpose_is_refused(ros: Any) -> None:
    with pytest.raises(ConfigError, match="nothing to record"):
        RecorderNode()


def test_a_topic_that_is_subscribed_to_anew_loses_nothing_and_has_nothing_twice(ros: Any) -> None:
    """As when the first publisher that is found is latched, and the others are not."""
    other = rclpy.Context()  # a participant of its own, which takes its time to find the subscription
    rclpy.init(context=other)
    robot = rclpy.create_node("robot", context=other)
    qos = QoSProfile(depth=1000)
    words = robot.create_publisher(String, "words", qos)
    intake = Intake("intake", ros.add(FlorenceNode("recorder")).context)
    taken: list[bytes] = []
    intake.subscribe("/words", "std_msgs/msg/String", qos)
    ros.spin_until(lambda: words.get_subscription_count())
    for number in range(200):
        if number == 50:
            intake.subscribe("/words", "std_msgs/msg/String", qos)
        words.publish(String(data=f"{number:03}"))
        taken += [message for _, _, message in intake.take()]

    def all_came() -> bool:
        taken.extend(message for _, _, message in intake.take())
        return len(taken) >= 200

    ros.spin_until(all_came)
    intake.close()
    robot.destroy_node()
    rclpy.shutdown(context=other)
    assert sorted(taken) == sorted({*taken}) and len(taken) == 200
