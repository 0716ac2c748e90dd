"""Names of a real DDS participant that ROS does not allow: left out and told, whoever reads the graph."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("foxglove")
pytest.importorskip("rclpy")

from std_msgs.msg import Float64
from std_srvs.srv import SetBool

from florence_bt.app.recording import node as recording
from florence_bt.app.recording.files import RecordingFiles
from florence_bt.app.recording.node import RecorderNode
from florence_bt.ros.graph_names import GraphNames
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE
from tests.ros.conftest import Child
from tests.ros.odd_names import publish_by_dds_name

pytestmark = pytest.mark.ros

ODD = ("rt//double", "rt/1abc", "rt/a b", "rt/x/", "rt/\x1b[2J")
PROGRAM = Path(__file__).with_name("odd_names.py")


class Stranger(FlorenceNode):
    """Publishes topics of odd names, a service of one, and a topic after them in the alphabet."""

    def __init__(self) -> None:
        super().__init__("stranger")
        for name in ODD:
            publish_by_dds_name(self, name)
        publish_by_dds_name(self, "rq/2x!Request", SetBool.Request)
        self.create_publisher(Float64, "zoo", RELIABLE)


def test_a_reader_of_the_graph_gets_what_ros_allows_and_tells_the_rest_once(
    ros: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    ros.add(Stranger())
    reader = ros.add(FlorenceNode("reader"))
    told: list[str] = []
    monkeypatch.setattr(reader, "_graph_names", GraphNames(told.append))
    ros.spin_until(lambda: "/zoo" in dict(reader.get_topic_names_and_types()))
    for _ in range(3):
        for name, types in (
            *reader.get_topic_names_and_types(),
            *reader.get_service_names_and_types(),
            *reader.get_action_names_and_types(),
        ):
            assert types and reader.count_publishers(name) >= 0, name
    assert [line for line in told if line.startswith("the service '/2x!'")]
    left_out = [line for line in told if line.startswith("the topic")]
    assert sorted(line.split("'")[1] for line in left_out) == sorted(
        repr(name.removeprefix("rt"))[1:-1] for name in ODD
    )
    assert "\x1b" not in "".join(told), "a name does not act on the terminal"
    assert len(told) == len(set(told))


def test_names_and_types_are_judged_at_the_door() -> None:
    told: list[str] = []
    door = GraphNames(told.append)
    assert door.typed("topic", [("/a", ["std_msgs/msg/Float64", "odd type"])]) == [
        ("/a", ["std_msgs/msg/Float64"])
    ]
    assert door.typed("service", [("/b", ["other::Type_"]), ("/c", []), ("relative", ["a/msg/B"])]) == []
    assert door.nodes([("good", "/"), ("1 bad", "/"), ("good", "//")]) == [("good", "/")]
    assert len(told) == 5


def test_a_recorder_records_the_others_and_keeps_its_bounds(
    ros: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "TOPICS_LOOK_S", 0.05)
    looks: list[RecordingFiles] = []
    look = RecordingFiles.look

    def noted_look(files: RecordingFiles) -> bool:
        looks.append(files)
        return look(files)

    monkeypatch.setattr(RecordingFiles, "look", noted_look)
    ros.add(Stranger())
    recorder = ros.add(RecorderNode(parameters={"folder": str(tmp_path)}))
    ros.spin_until(lambda: "/zoo" in recorder.types)
    seen = len(looks)
    ros.spin_until(lambda: len(looks) > seen)
    assert not recorder.failures

    # Whatever else goes wrong with a topic: the others are recorded, and the disk does not fill up.
    def refuse(name: str) -> int:
        if name == "/late":
            raise RuntimeError("the middleware does not want to")
        return FlorenceNode.count_publishers(recorder, name)

    monkeypatch.setattr(recorder, "count_publishers", refuse)
    other = ros.add(FlorenceNode("other"))
    other.create_publisher(Float64, "late", RELIABLE)
    other.create_publisher(Float64, "zoo2", RELIABLE)
    ros.spin_until(lambda: "/zoo2" in recorder.types)
    seen = len(looks)
    ros.spin_until(lambda: len(looks) > seen)
    assert "/late" not in recorder.types


def test_skills_are_drafted_beside_them(ros_domain: int, start_process: Callable[..., Child]) -> None:
    from florence_bt.app.mission_files.live_skills import offered, type_in_graph

    start_process(sys.executable, PROGRAM, *ODD, "rt/zoo").wait_for("the names are there")
    offers = offered()
    assert ("condition", "/zoo", "std_msgs/msg/Float64") in {(o.way, o.name, o.interface) for o in offers}
    assert not any("double" in offer.name or "1abc" in offer.name for offer in offers)
    assert type_in_graph("condition", "/zoo") == ("std_msgs/msg/Float64", False)
