"""The tree for the ecosystem's watchers: a client that knows the messages only, and nothing of our code.

It rebuilds the tree as the tree watcher of py_trees_ros does: by ids, with the five types that it knows.
"""

from __future__ import annotations

import math
import uuid

import py_trees
import pytest

from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.viewers.streams import StreamParameters

pytestmark = pytest.mark.ros

INVALID, RUNNING, SUCCESS, FAILURE = 1, 2, 3, 4
WATCHED = (
    "inputs:\n  way: {type: length, default: 1 m}\n"
    "tree:\n  selector:\n    - retry: 2\n      do:\n        sequence:\n"
    "          - set: {far: $way}\n          - drive: {way: $far}\n    - wait: 1 ms\n"
)


def rebuild(message):
    """A py_trees tree from a snapshot, and the ids on the path that was ticked."""
    by_id = {bytes(node.own_id.uuid): node for node in message.behaviours}
    assert len(by_id) == len(message.behaviours), "every node has an id of its own"
    (root,) = (node for node in message.behaviours if not any(node.parent_id.uuid))
    assert message.behaviours[0] == root
    statuses = {
        INVALID: py_trees.common.Status.INVALID,
        RUNNING: py_trees.common.Status.RUNNING,
        SUCCESS: py_trees.common.Status.SUCCESS,
        FAILURE: py_trees.common.Status.FAILURE,
    }
    active = set()

    def build(node):
        children = [build(by_id[bytes(child.uuid)]) for child in node.child_ids]
        memory = node.additional_detail == "WithMemory"
        if node.type == 2:
            made = py_trees.composites.Sequence(node.name, memory, children)
        elif node.type == 3:
            made = py_trees.composites.Selector(node.name, memory, children)
        elif node.type == 4:
            made = py_trees.composites.Parallel(
                node.name, py_trees.common.ParallelPolicy.SuccessOnAll(), children
            )
        elif node.type == 6:
            made = py_trees.decorators.PassThrough(node.name, children[0])
        else:
            assert node.type == 1 and not children
            made = py_trees.behaviours.Dummy(node.name)
        for child_id in node.child_ids:
            assert by_id[bytes(child_id.uuid)].parent_id == node.own_id
        if any(node.current_child_id.uuid):
            assert node.current_child_id in node.child_ids
        if any(node.tip_id.uuid):
            assert bytes(node.tip_id.uuid) in by_id
        made.status = statuses[node.status]
        made.feedback_message = node.message
        made.id = uuid.UUID(bytes=bytes(node.own_id.uuid))
        if node.is_active:
            active.add(made.id)
        return made

    return build(root), active


class Watcher:
    """Opens a stream, listens to it as the tree watcher does."""

    def __init__(self, bench, *, period=math.inf, data=False, activity=False, topic=""):
        from py_trees_ros_interfaces.srv import OpenSnapshotStream

        request = OpenSnapshotStream.Request(topic_name=topic)
        request.parameters.snapshot_period = period
        request.parameters.blackboard_data = data
        request.parameters.blackboard_activity = activity
        self.bench = bench
        self.topic = call(bench, OpenSnapshotStream, "snapshot_streams/open", request).topic_name
        self.heard = []
        if self.topic:
            self.subscription = listen(bench, self.topic, self.heard)

    def close(self):
        from py_trees_ros_interfaces.srv import CloseSnapshotStream

        request = CloseSnapshotStream.Request(topic_name=self.topic)
        return call(self.bench, CloseSnapshotStream, "snapshot_streams/close", request).result


def call(bench, service_type, name, request):
    fields = {field: getattr(request, field) for field in request.get_fields_and_field_types()}
    return bench.call(service_type, name, **fields)


def listen(bench, topic, heard):
    from py_trees_ros_interfaces.msg import BehaviourTree
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    latched = QoSProfile(
        depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE
    )
    return bench.node.create_subscription(BehaviourTree, topic, heard.append, latched)


def topics_of(bench):
    return {name for name, _ in bench.node.get_topic_names_and_types() if "_streams/" in name}


@pytest.fixture
def watched(bench_of):
    def make(*script):
        bench = bench_of(*(script or (Step(None),)))
        (bench.missions / "watched.yaml").write_text(f"mission: watched\n{WATCHED}")
        return bench

    return make


def test_a_watcher_rebuilds_the_tree(watched):
    bench = watched()
    bench.run("watched", way="2 m")
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    watcher = Watcher(bench, data=True)
    assert watcher.topic == "/florence_bt/snapshot_streams/_snapshots_0"
    bench.ros.spin_until(lambda: watcher.heard, what="the first snapshot")
    message = watcher.heard[-1]
    assert message.changed and message.statistics.count == 1
    root, active = rebuild(message)
    text = py_trees.display.ascii_tree(root, show_status=True, visited=dict.fromkeys(active))
    print(text)
    names = [node.name for node in root.iterate(direct_descendants=False)]
    assert len(names) == 6 and root.name == "watched" and root.status is py_trees.common.Status.RUNNING
    (drive,) = (node for node in message.behaviours if node.name == "drive")
    assert drive.status == RUNNING and drive.is_active and drive.type == 1 and drive.blackbox_level == 4
    assert drive.class_name.endswith("run_skill.RunSkill")
    assert [(access.key, access.value) for access in drive.blackboard_access] == [("/far", "r")]
    (wait,) = (node for node in message.behaviours if node.name.startswith("wait"))
    assert wait.status == INVALID and not wait.is_active
    values = {item.key: item.value for item in message.blackboard_on_visited_path}
    assert values == {"/far": "2", "/way": "2"}
    bench.stop()
    bench.ros.spin_until(lambda: watcher.heard[-1].behaviours[0].status == INVALID, what="the stop")
    assert watcher.close()


def test_the_default_topic_tells_changes_and_the_end_also_to_the_late(watched):
    bench = watched()
    heard = []
    listen(bench, "/florence_bt/snapshots", heard)
    bench.run("watched")
    # One at a time: a topic that keeps one message may skip those that come on the heels of each other.
    bench.ros.spin_until(lambda: heard, what="the first drive")
    bench.end_drive(failure("blocked", "a chair"))
    bench.ros.spin_until(lambda: len(bench.drive.runs) == 2 and len(heard) > 1, what="the second drive")
    bench.end_drive(success())
    bench.ros.spin_until(lambda: heard[-1].behaviours[0].status == SUCCESS, what="the end")
    counts = [message.statistics.count for message in heard]
    assert counts == sorted(counts) and len(heard) >= 3
    drives = [next(n for n in message.behaviours if n.name == "drive").status for message in heard]
    assert drives[0] == RUNNING and drives[-1] == SUCCESS
    assert heard[-1].statistics.tick_interval > 0.0 and heard[-1].statistics.tick_duration_average > 0.0
    assert heard[-1].statistics.stamp.sec > 0
    late = []
    listen(bench, "/florence_bt/snapshots", late)
    bench.ros.spin_until(lambda: late, what="the latched snapshot")
    assert late[0].behaviours[0].status == SUCCESS
    root, _ = rebuild(late[0])
    assert root.status is py_trees.common.Status.SUCCESS


def test_who_comes_after_the_end_is_given_the_last_tree_although_nobody_watched(watched):
    bench = watched(Step(success(), after=0.02))
    bench.run("watched")
    bench.wait("SUCCEEDED")
    late = []
    listen(bench, "/florence_bt/snapshots", late)
    bench.ros.spin_until(lambda: late, what="the last snapshot")
    assert late[0].behaviours[0].status == SUCCESS and late[0].statistics.count >= 2


def test_several_watchers_and_an_orderly_end(watched):
    from py_trees_ros_interfaces.srv import ReconfigureSnapshotStream

    bench = watched()
    every = Watcher(bench, period=0.0, activity=True)
    changes = Watcher(bench, topic="mine", data=True)
    absolute = Watcher(bench, topic="/elsewhere/tree")
    assert changes.topic == "/florence_bt/snapshot_streams/mine" and absolute.topic == "/elsewhere/tree"
    assert every.topic != changes.topic
    bench.ros.spin_until(lambda: bench.node.count_subscribers(absolute.topic), what="discovery")
    request = ReconfigureSnapshotStream.Request(topic_name=changes.topic)
    request.parameters.snapshot_period = 0.0
    request.parameters.blackboard_activity = True
    assert call(bench, ReconfigureSnapshotStream, "snapshot_streams/reconfigure", request).result
    request.topic_name = "/nobody"
    assert not call(bench, ReconfigureSnapshotStream, "snapshot_streams/reconfigure", request).result
    request.topic_name, request.parameters.snapshot_period = changes.topic, math.nan
    assert not call(bench, ReconfigureSnapshotStream, "snapshot_streams/reconfigure", request).result
    bench.run("watched", way="3 m")
    bench.ros.spin_until(lambda: every.heard, what="the first tick")
    bench.end_drive(success())
    for watcher in (every, changes, absolute):
        bench.ros.spin_until(
            lambda watcher=watcher: watcher.heard and watcher.heard[-1].behaviours[0].status == SUCCESS,
            what=watcher.topic,
        )
    activity = [item for message in every.heard for item in message.blackboard_activity]
    assert ("/far", "INITIALISED", "3") in {(i.key, i.activity_type, i.current_value) for i in activity}
    assert not absolute.heard[-1].blackboard_on_visited_path and not absolute.heard[-1].blackboard_activity
    for watcher in (every, changes, absolute):
        assert watcher.close() and not watcher.close()
        bench.node.destroy_subscription(watcher.subscription)
    bench.ros.spin_until(
        lambda: (
            not topics_of(bench) and "/elsewhere/tree" not in dict(bench.node.get_topic_names_and_types())
        ),
        what="the end of the topics",
    )


def test_a_shared_stream_ends_with_its_last_user(watched):
    bench = watched()
    first, second = Watcher(bench, topic="shared"), Watcher(bench, topic="shared")
    assert first.topic == second.topic
    assert first.close() and second.close() and not second.close()


@pytest.mark.parametrize("topic", ["white space", "//", "x" * 300, "/florence_bt/run_state", "~/1st"])
def test_a_topic_that_cannot_be_is_refused(watched, topic):
    assert Watcher(watched(), topic=topic).topic == ""


def test_streams_without_end_are_bounded(watched):
    bench = watched()
    topics = [Watcher(bench).topic for _ in range(33)]
    assert all(topics[:32]) and topics[32] == ""


def test_who_was_killed_leaves_no_stream_for_ever(watched, monkeypatch):
    from florence_bt.runtime.node import _streams

    bench = watched()
    watcher = Watcher(bench)
    bench.ros.spin_until(lambda: bench.node.count_publishers(watcher.topic), what="the stream")
    stream = bench.server._watching._snapshots._open[watcher.topic]
    bench.ros.spin_until(lambda: stream.listeners, what="the listener")
    monkeypatch.setattr(_streams, "LINGER_S", 1.0)
    bench.ros.spin_for(1.2)
    assert bench.node.count_publishers(watcher.topic) == 1, "it has a listener"
    bench.node.destroy_subscription(watcher.subscription)
    bench.ros.spin_until(lambda: not bench.node.count_publishers(watcher.topic), what="the end of the stream")
    assert not watcher.close()


def test_keys_can_be_watched(watched):
    from py_trees_ros_interfaces.srv import (
        CloseBlackboardStream,
        GetBlackboardVariables,
        OpenBlackboardStream,
    )
    from std_msgs.msg import String

    bench = watched(Step(None))
    variables = call(
        bench, GetBlackboardVariables, "blackboard_streams/get_variables", GetBlackboardVariables.Request()
    ).variables
    assert variables == []

    def open_board(*names, visited=False, activity=False):
        request = OpenBlackboardStream.Request(
            variables=names, filter_on_visited_path=visited, with_activity_stream=activity
        )
        topic = call(bench, OpenBlackboardStream, "blackboard_streams/open", request).topic
        heard = []
        bench.node.create_subscription(String, topic, lambda message: heard.append(message.data), 10)
        bench.ros.spin_until(lambda: bench.node.count_subscribers(topic), what="discovery")
        return topic, heard

    topic, one = open_board("far", activity=True)
    assert topic == "/florence_bt/blackboard_streams/_watcher_0"
    _, every = open_board(visited=True)
    bench.run("watched", way="2 m")
    bench.ros.spin_until(lambda: one and every and "/far" in every[-1], what="the keys")
    print(one[-1])
    assert "/far : 2" in one[-1] and "/way" not in one[-1] and "INITIALISED - -> 2" in one[-1]
    variables = call(
        bench, GetBlackboardVariables, "blackboard_streams/get_variables", GetBlackboardVariables.Request()
    ).variables
    assert variables == ["/far", "/way"]
    close = CloseBlackboardStream.Request(topic_name=topic)
    assert call(bench, CloseBlackboardStream, "blackboard_streams/close", close).result
    assert not call(bench, CloseBlackboardStream, "blackboard_streams/close", close).result


def test_keys_of_called_missions_stand_behind_their_call(watched):
    bench = watched(Step(None))
    (bench.missions / "outer.yaml").write_text(
        "mission: outer\ntree:\n  sequence:\n    - run: watched\n      with: {way: 4 m}\n"
    )
    bench.run("outer")
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    watcher = Watcher(bench, data=True)
    bench.ros.spin_until(lambda: watcher.heard, what="a snapshot")
    values = {item.key: item.value for item in watcher.heard[-1].blackboard_on_visited_path}
    assert values == {"/watched/far": "4", "/watched/way": "4"}


def test_who_asks_for_nothing_earlier_is_told_the_state_of_the_moment_too(watched):
    """As the blackboard watcher of py_trees_ros: a volatile subscription, while a skill goes on."""
    from py_trees_ros_interfaces.msg import BehaviourTree
    from py_trees_ros_interfaces.srv import OpenBlackboardStream
    from std_msgs.msg import String

    bench = watched(Step(None))
    bench.run("watched", way="2 m")
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    topic = call(bench, OpenBlackboardStream, "blackboard_streams/open", OpenBlackboardStream.Request()).topic
    for _ in range(2):
        heard = []
        bench.node.create_subscription(String, topic, heard.append, 1)
        bench.ros.spin_until(lambda heard=heard: heard, what="the keys")
        assert "/far" in heard[-1].data
    for topic in ("/florence_bt/snapshots", Watcher(bench).topic):
        for _ in range(2):
            heard = []
            bench.node.create_subscription(BehaviourTree, topic, heard.append, 1)
            bench.ros.spin_until(lambda heard=heard: heard, what="the tree")
            assert heard[-1].behaviours[0].status == RUNNING


def test_streams_are_closed_while_somebody_joins_and_leaves(watched):
    """What the executor still has to tell of a publisher that is gone must not end the mission server."""
    from py_trees_ros_interfaces.msg import BehaviourTree

    bench = watched()
    streams = bench.server._watching._snapshots
    for number in range(20):
        topic = streams.open("", StreamParameters())
        bench.ros.loop.drain(5)  # the executor has to know of the new publisher
        subscription = bench.node.create_subscription(BehaviourTree, topic, lambda m: None, 1)
        if number % 2:
            bench.node.destroy_subscription(subscription)
        assert streams.close(topic)
        bench.ros.loop.drain(20)
    assert bench.run("be_quick").accepted


def test_a_trigger_that_is_called_while_its_mission_goes_does_not_end_the_server(watched):
    from std_srvs.srv import Trigger

    bench = watched()
    client = bench.node.create_client(Trigger, "florence_bt/missions/be_quick")
    bench.ros.spin_until(client.service_is_ready, what="the trigger")
    (bench.missions / "be_quick.yaml").unlink()
    for _ in range(5):
        client.call_async(Trigger.Request())
    bench.server._reload(lambda success, report: None)
    bench.ros.loop.drain(50)
    bench.ros.spin_until(lambda: not client.service_is_ready(), what="the end of the trigger")
    assert bench.run("drive_once").accepted
