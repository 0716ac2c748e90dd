"""What messages may hold, by their types."""

from __future__ import annotations

import math
from typing import Any

import pytest

pytest.importorskip("rclpy")
from florence_interfaces.msg import RunTree
from geometry_msgs.msg import Twist
from nav2_msgs.action import NavigateToPose, Spin
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import BatteryState, LaserScan
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from florence_bt.ros.validation import problem_with
from tools.safety_campaign.messages import ordinary

NOW = 1_700_000_000.0


def changed(message_type: Any, field: str, value: Any, stamp: float = NOW) -> Any:
    """An ordinary message with another value in one field."""
    message = ordinary(message_type, stamp)
    *path, last = field.split(".")
    part = message
    for name in path:
        part = part[int(name)] if name.isdigit() else getattr(part, name)
    setattr(part, last, value)
    return message


@pytest.mark.parametrize(
    ("message_type", "field", "value", "problem"),
    [
        (NavigateToPose.Goal, "pose.pose.position.x", 1e17, "pose.position.x is 1e+17"),
        (NavigateToPose.Goal, "pose.pose.position.y", math.nan, "-10000 to 10000 m"),
        (Spin.Goal, "target_yaw", 1e30, "target_yaw is 1e+30"),
        (Twist, "linear.x", math.inf, "linear.x is inf"),
        (Odometry, "pose.pose.position.x", 1e308, "pose.position.x is 1e+308"),
        (Odometry, "pose.pose.orientation.w", 0.0, "not a rotation"),
        (Odometry, "header.frame_id", "a\x1b[2J", "characters that can be printed"),
        (RunTree, "nodes.0.status", 0, "status is 0 (would have worked: 1 to 4)"),
        (RunTree, "nodes.0.depth", 1, "depth is 1"),
        (RunTree, "nodes.0.seconds", math.inf, "seconds of a node is inf"),
        (RunTree, "seconds", math.nan, "seconds is nan"),
        (RunTree, "output_names", ["a"], "the number of output_values is 0"),
        (OccupancyGrid, "info.width", 61, "a map of 61 x 50 cells has 3000 values"),
        (OccupancyGrid, "info.width", 0, "the number of cells is 0"),
        (OccupancyGrid, "info.height", 2**32 - 1, "1 to 2.5e+07"),
        (OccupancyGrid, "info.resolution", 0.0, "resolution is 0"),
        (OccupancyGrid, "info.resolution", 1e-30, "0.001 to 1 m"),
        (BatteryState, "percentage", 65.529 / 2.696, "percentage is 24.3"),
        (BatteryState, "percentage", -1.0, "percentage is -1"),
        (LaserScan, "ranges", [], "the number of ranges is 0"),
        (LaserScan, "angle_increment", math.nan, "the angle from the first to the last beam is nan"),
        (LaserScan, "angle_increment", 0.0, "angle_increment is 0 rad: all 101 beams go the same way"),
        (LaserScan, "angle_increment", -1e-30, "1e-05 rad and more"),
        (LaserScan, "intensities", [1.0], "1 intensities for 101 ranges"),
        (
            TFMessage,
            "transforms.0.transform.translation.x",
            math.inf,
            "translation of 'base_footprint'.x is inf",
        ),
        (TFMessage, "transforms.0.header.frame_id", "base_footprint", "'base_footprint' is its own parent"),
    ],
)
def test_what_nobody_can_mean_is_refused_with_what_would_have_worked(
    message_type: Any, field: str, value: Any, problem: str
) -> None:
    assert problem_with(ordinary(message_type, NOW), lambda _: NOW) is None
    text = problem_with(changed(message_type, field, value), lambda _: NOW)
    assert text is not None and problem in text and "would have worked" in text


@pytest.mark.parametrize("message_type", [Odometry, LaserScan, TFMessage])
@pytest.mark.parametrize(
    ("offset", "problem"), [(3e8, "after"), (10.5, "after"), (-10.5, "before"), (9.0, "")]
)
def test_a_reading_is_of_the_present(message_type: Any, offset: float, problem: str) -> None:
    text = problem_with(ordinary(message_type, NOW + offset), lambda _: NOW)
    assert (text is None) == (problem == "")
    assert problem in (text or "")


@pytest.mark.parametrize("now", [None, lambda _: 0.0])
def test_no_stamp_is_judged_while_the_time_is_not_known_nor_on_latched_topics(now: Any) -> None:
    assert problem_with(ordinary(Odometry, 7.0), now) is None


def test_a_type_without_a_check_is_not_judged() -> None:
    assert problem_with(String(data="\x1b" * 100_000)) is None
