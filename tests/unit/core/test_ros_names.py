"""Names of ROS: those of rcl's own validation, and what is offered in place of others."""

from __future__ import annotations

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.ros_names import check_ros_name


@pytest.mark.parametrize("name", ["a", "/a/b_2", "~/b", "_a/B", "a/" * 20 + "b"])
def test_names_of_ros_are_let_in(name: str) -> None:
    check_ros_name(name)


@pytest.mark.parametrize(
    ("name", "valid"),
    [
        ("a//b", "a/b"),
        ("1a/b", "n1a/b"),
        ("a b", "a_b"),
        ("a/", "a"),
        ("tür/auf", "t_r/auf"),
        ("{robot}/b", "_robot_/b"),
        ("$name", "_name"),
        ("/", "robot/arm"),
        ("", "robot/arm"),
        ("a\nb", "a_b"),
    ],
)
def test_what_is_none_is_told_with_what_may_be_meant(name: str, valid: str) -> None:
    with pytest.raises(ConfigError) as caught:
        check_ros_name(name)
    assert caught.value.valid == (valid,)
    check_ros_name(valid)


def test_rcl_says_the_same() -> None:
    pytest.importorskip("rclpy")
    from rclpy.exceptions import InvalidTopicNameException
    from rclpy.expand_topic_name import expand_topic_name
    from rclpy.validate_full_topic_name import validate_full_topic_name

    for name in ("a", "/a/b", "~/b", "a//b", "1a/b", "a b", "a/", "a__b", "tür", "/", "a/1b", "_a", "a/_b"):
        try:
            validate_full_topic_name(expand_topic_name(name, "node", "/"))
        except (InvalidTopicNameException, ValueError):
            with pytest.raises(ConfigError):
                check_ros_name(name)
        else:
            check_ros_name(name)
