"""ROS arguments of a command line: which words they are, and the namespace in them."""

from __future__ import annotations

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.ros import arguments
from florence_bt.ros.arguments import (
    namespace,
    namespace_in,
    parameters_in,
    renamed_nodes,
    ros_arguments,
    split_ros_arguments,
    use_arguments,
    use_namespace,
    where_else,
    without_parameters,
)


@pytest.fixture(autouse=True)
def _own_arguments(monkeypatch):
    monkeypatch.setattr(arguments, "_arguments", ())


@pytest.mark.parametrize(
    ("words", "others", "of_ros"),
    [
        ("status", "status", ""),
        ("status --ros-args -r a:=b", "status", "-r a:=b"),
        ("run --ros-args -r a:=b -- goto_room room=kitchen", "run goto_room room=kitchen", "-r a:=b"),
        ("--ros-args -p x:=1 -- up --ros-args --log-level debug", "up", "-p x:=1 --log-level debug"),
        ("check -- --ros-args", "check --", ""),
    ],
)
def test_ros_arguments_are_taken_out_of_a_command_line(words, others, of_ros):
    assert split_ros_arguments(words.split()) == (others.split(), of_ros.split())


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("", None),
        ("-r a:=b", None),
        ("-r __ns:=/robot1", "/robot1"),
        ("--remap __ns:=/a/b -r __ns:=/c", "/a/b"),
        ("-r __ns:=/", ""),
        ("-p __ns:=/robot1", None),
    ],
)
def test_the_first_rule_for_a_namespace_counts(words, expected):
    assert namespace_in(words.split()) == expected


@pytest.mark.parametrize("text", ["/robot1", "robot1", "robot1/"])
def test_a_namespace_becomes_a_rule_once(text):
    use_namespace(text)
    use_namespace(text)
    assert (namespace(), ros_arguments()) == ("/robot1", ("-r", "__ns:=/robot1"))


@pytest.mark.parametrize("text", ["", "/"])
def test_the_root_needs_no_rule(text):
    use_namespace(text)
    assert (namespace(), ros_arguments()) == ("", ())


@pytest.mark.parametrize("text", ["a b", "1robot", "/a//b", "robot-1"])
def test_what_is_no_namespace_is_told(text):
    with pytest.raises(ConfigError, match="not a namespace"):
        use_namespace(text)


def test_the_environment_gives_way_to_a_rule_and_two_words_of_the_command_line_do_not_agree():
    use_arguments(["-r", "__ns:=/robot1"])
    use_namespace("/robot2", chosen=False)
    assert namespace() == "/robot1"
    with pytest.raises(ConfigError, match="/robot2 and /robot1"):
        use_namespace("/robot2")


def test_parameters_are_told_apart_from_the_rest():
    words = [
        "-r",
        "a:=b",
        "-p",
        "navigate:x:=1",
        "--log-level",
        "debug",
        "--params-file",
        "f.yaml",
        "--param",
        "y:=2",
    ]
    assert list(parameters_in(words)) == [(False, "navigate:x:=1"), (True, "f.yaml"), (False, "y:=2")]
    assert without_parameters(words) == ["-r", "a:=b", "--log-level", "debug"]


def test_rules_that_rename_nodes_are_found():
    assert renamed_nodes(["-r", "__node:=x", "-r", "navigate:__ns:=/y", "-r", "a:=b", "-r", "__ns:=/z"]) == [
        "__node",
        "navigate:__ns",
    ]


def test_systems_elsewhere_are_told_with_what_reaches_them():
    assert where_else([]) == ""
    assert where_else(["/robot2", "/robot1", "/robot2"]).endswith("--namespace /robot1 or /robot2")
    assert where_else(["/"]).endswith("--namespace /")
