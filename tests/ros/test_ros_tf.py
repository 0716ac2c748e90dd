"""Transforms over ROS."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")
from geometry_msgs.msg import TransformStamped
from rclpy.qos import ReliabilityPolicy
from tf2_msgs.msg import TFMessage

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import TF
from florence_bt.ros.tf import StaticTransformBroadcaster, TransformBroadcaster, TransformListener

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
    ros.spin_until(lambda: node.count_subscribers("/tf") == 1)
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
    (heard,) = ros.spin_until(lambda: base.get_subscriptions_info_by_topic("/tf"))
    (told,) = ros.spin_until(lambda: listener.get_publishers_info_by_topic("/tf"))
    assert heard.qos_profile.reliability is ReliabilityPolicy.BEST_EFFORT
    assert told.qos_profile.reliability is ReliabilityPolicy.RELIABLE, "as tf2's listeners want it"


def test_a_message_with_a_broken_transform_is_refused(ros: Any) -> None:
    node = ros.add(FlorenceNode("base"))
    listener = ros.add(FlorenceNode("listener", parameters=SIMULATED))
    buffer = TransformListener(listener).buffer
    publisher = node.create_publisher(TFMessage, "/tf", TF)
    ros.spin_until(lambda: node.count_subscribers("/tf") == 1)
    good, broken = TransformStamped(child_frame_id="good"), TransformStamped(child_frame_id="broken")
    good.header.frame_id = broken.header.frame_id = "odom"
    broken.transform.rotation.w = 0.0
    publisher.publish(TFMessage(transforms=[broken, good]))
    publisher.publish(TFMessage(transforms=[good]))
    ros.spin_until(lambda: buffer.frames() == ("good",))
    assert listener.health.refused == {"/tf": 1}
