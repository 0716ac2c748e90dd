"""Transforms over ROS."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TransformStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from tf2_msgs.msg import TFMessage

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3
from florence_bt.ros.conversions import transform_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, OWN_TF_LISTENER
from florence_bt.ros.tf import (
    JUDGED_AFTER_S,
    StaticTransformBroadcaster,
    TransformBroadcaster,
    TransformListener,
)

pytestmark = pytest.mark.ros
SIMULATED = {"use_sim_time": True}

LASER = Transform3.from_xyz_rpy((0.1, 0.0, 0.2), (math.pi, 0.0, 0.0))
CAMERA = Transform3.from_xyz_rpy((0.0, 0.0, 0.5), (0.0, 0.1, 0.0))


def test_static_transforms_reach_late_listeners_from_every_broadcaster(ros: Any) -> None:
    first, second = ros.add(FlorenceNode("first")), ros.add(FlorenceNode("second"))
    broadcaster = StaticTransformBroadcaster(first)
    broadcaster.send([("base_link", "laser", LASER)])
    broadcaster.send([("base_link", "camera", CAMERA)])
    StaticTransformBroadcaster(second).send([("camera", "lens", CAMERA)])
    buffer = TransformListener(ros.add(FlorenceNode("late"))).buffer
    ros.spin_until(lambda: buffer.frames() == ("camera", "laser", "lens"))
    np.testing.assert_allclose(buffer.lookup("base_link", "laser").rotation, LASER.rotation, atol=1e-9)
    np.testing.assert_allclose(buffer.lookup("base_link", "lens").translation, (CAMERA @ CAMERA).translation)


def test_moving_transforms(ros: Any) -> None:
    node = ros.add(FlorenceNode("base"))
    broadcaster = TransformBroadcaster(node)
    # Its stamps are of a simulated time that nobody tells.
    buffer = TransformListener(ros.add(FlorenceNode("listener", parameters=SIMULATED))).buffer
    ros.spin_until(lambda: node.count_subscribers("/tf") == 2)
    for step in range(50):
        broadcaster.send("odom", "base_footprint", 10.0 + 0.1 * step, Pose2(0.1 * step, 0.0, 0.5))
    ros.spin_until(lambda: (buffer.latest_stamp("base_footprint") or 0.0) > 14.8)
    pose = buffer.lookup_pose("odom", "base_footprint", 12.05)
    assert (pose.x, pose.yaw) == (pytest.approx(2.05), pytest.approx(0.5))


def test_a_lost_transform_does_not_hold_the_next_ones_back(ros: Any) -> None:
    """A reliable listener would be given none of them until the writer's next heartbeat, seconds later."""
    listener = ros.add(FlorenceNode("listener"))
    TransformListener(listener)
    base = ros.add(FlorenceNode("base"))
    TransformBroadcaster(base)
    heard = ros.spin_until(lambda: base.get_subscriptions_info_by_topic("/tf"))
    (told,) = ros.spin_until(lambda: listener.get_publishers_info_by_topic("/tf"))
    assert {each.qos_profile.reliability for each in heard} == {ReliabilityPolicy.BEST_EFFORT}
    assert told.qos_profile.reliability is ReliabilityPolicy.RELIABLE, "as tf2's listeners want it"


def test_a_message_with_a_broken_transform_is_refused(ros: Any) -> None:
    node = ros.add(FlorenceNode("base"))
    listener = ros.add(FlorenceNode("listener", parameters=SIMULATED))
    buffer = TransformListener(listener).buffer
    publisher = node.create_publisher(TFMessage, "/tf", QoSProfile(depth=100))
    ros.spin_until(lambda: node.count_subscribers("/tf") == 2)
    good, broken = TransformStamped(child_frame_id="good"), TransformStamped(child_frame_id="broken")
    good.header.frame_id = broken.header.frame_id = "odom"
    broken.transform.rotation.w = 0.0
    publisher.publish(TFMessage(transforms=[broken, good]))
    publisher.publish(TFMessage(transforms=[good]))
    ros.spin_until(lambda: buffer.frames() == ("good",))
    assert listener.health.refused == {"/tf": 1}


class _Stranger:
    """Another program that publishes transforms."""

    def __init__(self, ros: Any) -> None:
        self.node = ros.add(FlorenceNode("stranger"))
        self._moving = self.node.create_publisher(TFMessage, "/tf", QoSProfile(depth=100))
        self._static = self.node.create_publisher(TFMessage, "/tf_static", LATCHED)

    def say(self, parent: str, child: str, *, ahead: float = 0.0, static: bool = False) -> None:
        """Publish that a frame is 50 m away."""
        stamp = self.node.timebase.now() + ahead
        transform = transform_to_ros(parent, child, stamp, Pose2(50.0, 50.0))
        (self._static if static else self._moving).publish(TFMessage(transforms=[transform]))


@pytest.mark.parametrize("static_first", [True, False])
def test_other_programs_neither_freeze_nor_move_florences_frames(ros: Any, static_first: bool) -> None:
    """One latched static map -> odom, or samples stamped ahead, had the last word for seconds or for ever."""
    stranger = _Stranger(ros)
    if static_first:
        stranger.say("map", "odom", static=True)
    listener, base = ros.add(FlorenceNode("listener")), ros.add(FlorenceNode("base"))
    tf = TransformListener(listener)
    broadcaster = TransformBroadcaster(base)
    StaticTransformBroadcaster(base).send([("base_footprint", "laser", LASER)])
    ros.spin_until(lambda: base.count_subscribers("/tf") >= 2 and base.count_subscribers("/tf_static") >= 2)
    if static_first:
        ros.spin_until(lambda: "odom" in tf.buffer.frames())

    def goes_on() -> Any:
        now = base.timebase.now()
        broadcaster.send_all(now, [("map", "odom", Pose2(1.0)), ("odom", "base_footprint", Pose2(2.0))])
        for ahead in (0.05, 1.0, 9.0):
            stranger.say("map", "odom", ahead=ahead)
            stranger.say("odom", "base_footprint", ahead=ahead)
            stranger.say("base_footprint", "map", ahead=ahead)
        if tf.buffer.is_own("odom") and tf.buffer.is_own("base_footprint") and tf.buffer.is_own("laser"):
            assert tf.buffer.lookup_pose("map", "laser").x == pytest.approx(3.1)
        ros.spin_for(0.05)
        told = listener.health.refused
        return told["/tf"] > 3 and (static_first or told["/tf_static"])

    if not static_first:
        ros.spin_until(
            lambda: (
                broadcaster.send("map", "odom", base.timebase.now(), Pose2(1.0)) or tf.buffer.is_own("odom")
            )
        )
        stranger.say("map", "odom", static=True)
    ros.spin_until(goes_on)


def test_florences_own_transforms_are_never_refused(ros: Any) -> None:
    listener, base = ros.add(FlorenceNode("listener")), ros.add(FlorenceNode("base"))
    tf, broadcaster = TransformListener(listener), TransformBroadcaster(base)
    static = StaticTransformBroadcaster(base)
    ros.spin_until(lambda: base.count_subscribers("/tf") >= 2)

    def later_than(stamp: float) -> bool:
        broadcaster.send("map", "odom", base.timebase.now() + 0.2, Pose2(1.0))
        static.send([("base_footprint", "laser", LASER)])
        ros.spin_for(0.05)
        return (tf.buffer.latest_stamp("odom") or 0.0) > stamp

    end = base.timebase.now() + 1.0
    ros.spin_until(lambda: later_than(end))
    assert not listener.health.refused


class _LosesOwnCopies(FlorenceNode):
    """A node so late that its subscription to Florence's own transforms loses two of three messages."""

    def create_subscription(self, msg_type: Any, topic: str, *rest: Any, **options: Any) -> Any:
        if topic == "/tf" and rest[1] is OWN_TF_LISTENER:
            kept, numbers = options["sift"], itertools.count()
            options["sift"] = lambda data: next(numbers) % 3 == 0 and kept(data)
        return super().create_subscription(msg_type, topic, *rest, **options)


@pytest.mark.parametrize("bystander", [False, True])
def test_a_lost_copy_of_our_own_transform_is_nobody_elses(ros: Any, bystander: bool) -> None:
    """On a busy machine each frame that jumped, as odom does below map, was told as another program's."""
    listener, base = ros.add(_LosesOwnCopies("listener")), ros.add(FlorenceNode("base"))
    tf, broadcaster = TransformListener(listener), TransformBroadcaster(base)
    stranger = _Stranger(ros) if bystander else None
    ros.spin_until(lambda: base.count_subscribers("/tf") >= 2)
    if stranger is not None:
        ros.spin_until(lambda: stranger.node.count_subscribers("/tf") >= 2)

    def later_than(stamp: float) -> bool:
        now = base.timebase.now()
        # With a bystander the poses alone tell a lost copy from a contradiction: one jump between two others.
        jumps = now // 0.4 if bystander else now // 0.01
        broadcaster.send("map", "odom", now, Pose2(3.0 * (jumps % 2)))
        if stranger is not None:
            stranger.say("map", "somebody_elses")
        ros.spin_for(0.02)
        return (tf.buffer.latest_stamp("odom") or 0.0) > stamp

    end = base.timebase.now() + 2.0 * JUDGED_AFTER_S
    ros.spin_until(lambda: later_than(end))
    assert not listener.health.refused


def test_who_contradicts_our_transforms_is_told_by_name(ros: Any) -> None:
    listener, base = ros.add(_LosesOwnCopies("listener")), ros.add(FlorenceNode("base"))
    TransformListener(listener)
    broadcaster, stranger = TransformBroadcaster(base), _Stranger(ros)
    told: list[str] = []

    def read(message: DiagnosticArray) -> None:
        told.extend(value.value for status in message.status for value in status.values if value.key == "/tf")

    base.create_subscription(DiagnosticArray, "diagnostics", read, 10)

    def goes_on() -> bool:
        broadcaster.send("map", "odom", base.timebase.now(), Pose2(1.0))
        stranger.say("map", "odom")
        ros.spin_for(0.02)
        return bool(told)

    ros.spin_until(goes_on)
    assert "/stranger" in told[0] and "'odom'" in told[0]


def test_a_transform_of_another_program_is_used_unless_it_is_stamped_ahead(ros: Any) -> None:
    """As those of Nav2's localisation are."""
    stranger, listener = _Stranger(ros), ros.add(FlorenceNode("listener"))
    tf = TransformListener(listener)
    ros.spin_until(lambda: stranger.node.count_subscribers("/tf") >= 1)
    stranger.say("map", "far_ahead", ahead=5.0)
    stranger.say("map", "odom", ahead=1.0)
    ros.spin_until(lambda: "odom" in tf.buffer.frames())
    assert tf.buffer.frames() == ("odom",) and listener.health.refused == {"/tf": 1}
    stranger.say("map", "odom", static=True)
    ros.spin_until(lambda: listener.health.refused["/tf_static"])
    assert tf.buffer.latest_stamp("odom") is not None


def test_bytes_that_are_no_message_are_refused(ros: Any) -> None:
    listener, stranger = ros.add(FlorenceNode("listener")), _Stranger(ros)
    tf = TransformListener(listener)
    publisher = stranger.node.create_publisher(TFMessage, "/tf", QoSProfile(depth=1))
    ros.spin_until(lambda: stranger.node.count_subscribers("/tf") >= 1)
    publisher.publish(b"\0\1\0\0\xff\xff\xff\xff")
    stranger.say("map", "odom")
    ros.spin_until(lambda: "odom" in tf.buffer.frames() and listener.health.refused["/tf"])
