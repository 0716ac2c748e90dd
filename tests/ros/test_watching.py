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

    def __init__(self, bench):
        from py_trees_ros_interfaces.srv import OpenSnapshotStream

        request = OpenSnapshotStream.Request()
        request.parameters.snapshot_period = math.inf
        self.bench = bench
        self.topic = call(bench, OpenSnapshotStream, "snapshot_streams/open", request).topic_name
        self.heard = []
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
    watcher = Watcher(bench)
    assert watcher.topic == "/florence_bt/snapshots"
    bench.ros.spin_until(lambda: watcher.heard, what="the first snapshot")
    message = watcher.heard[-1]
    assert message.changed
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
    assert values == {"/far": "2 m", "/way": "2 m"}
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
    assert len(heard) >= 3
    drives = [next(n for n in message.behaviours if n.name == "drive").status for message in heard]
    assert drives[0] == RUNNING and drives[-1] == SUCCESS
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
    assert late[0].behaviours[0].status == SUCCESS


def test_watchers_share_the_topic_and_one_that_leaves_takes_nothing_from_the_others(watched):
    from py_trees_ros_interfaces.srv import CloseSnapshotStream, ReconfigureSnapshotStream

    bench = watched()
    first, second = Watcher(bench), Watcher(bench)
    request = ReconfigureSnapshotStream.Request(topic_name=first.topic)
    assert call(bench, ReconfigureSnapshotStream, "snapshot_streams/reconfigure", request).result
    request.topic_name = "/nobody"
    assert not call(bench, ReconfigureSnapshotStream, "snapshot_streams/reconfigure", request).result
    assert first.close()
    unknown = CloseSnapshotStream.Request(topic_name="/nobody")
    assert not call(bench, CloseSnapshotStream, "snapshot_streams/close", unknown).result
    bench.run("watched", way="3 m")
    bench.ros.spin_until(lambda: second.heard, what="the first tick")
    bench.end_drive(success())
    bench.ros.spin_until(lambda: second.heard[-1].behaviours[0].status == SUCCESS, what="the end")


def test_keys_of_called_missions_stand_behind_their_call(watched):
    bench = watched(Step(None))
    (bench.missions / "outer.yaml").write_text(
        "mission: outer\ntree:\n  sequence:\n    - run: watched\n      with: {way: 4 m}\n"
    )
    bench.run("outer")
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    watcher = Watcher(bench)
    bench.ros.spin_until(lambda: watcher.heard, what="a snapshot")
    values = {item.key: item.value for item in watcher.heard[-1].blackboard_on_visited_path}
    assert values == {"/watched/far": "4 m", "/watched/way": "4 m"}


def test_who_asks_for_nothing_earlier_is_told_the_state_of_the_moment_too(watched):
    from py_trees_ros_interfaces.msg import BehaviourTree

    bench = watched(Step(None))
    bench.run("watched", way="2 m")
    bench.ros.spin_until(lambda: bench.drive.runs, what="the drive")
    for _ in range(2):
        heard = []
        bench.node.create_subscription(BehaviourTree, "/florence_bt/snapshots", heard.append, 1)
        bench.ros.spin_until(lambda heard=heard: heard, what="the tree")
        assert heard[-1].behaviours[0].status == RUNNING


def test_a_trigger_that_is_called_while_its_mission_goes_does_not_end_the_server(watched):
    from std_srvs.srv import Trigger

    bench = watched()
    client = bench.node.create_client(Trigger, "florence_bt/missions/be_quick")
    bench.ros.spin_until(client.service_is_ready, what="the trigger")
    (bench.missions / "be_quick.yaml").unlink()
    for _ in range(5):
        client.call_async(Trigger.Request())
    bench.server._reload()
    bench.ros.loop.drain(50)
    bench.ros.spin_until(lambda: not client.service_is_ready(), what="the end of the trigger")
    assert bench.run("drive_once").accepted
