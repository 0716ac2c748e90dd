"""Parameter files of ROS 2 and ``-p`` beside the configuration, for systems in a namespace."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.bringup.config import Config, config_of, read_sections
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.preflight import check_options
from florence_bt.app.bringup.topology import factories
from florence_bt.core.errors import ConfigError

ROBOT1 = ("-r", "__ns:=/robot1")


def written(folder: Path, content: str) -> Path:
    file = folder / "params.yaml"
    file.write_text(content)
    return file


@pytest.mark.parametrize(
    ("key", "namespace", "is_for"),
    [
        ("navigate", "", True),
        ("navigate", "/robot1", True),  # as Nav2's bring-up: below the namespace, whichever it is
        ("/navigate", "", True),
        ("/navigate", "/robot1", False),
        ("/robot1/navigate", "/robot1", True),
        ("/robot1/navigate", "/robot2", False),
        ("/robot1/navigate", "", False),
        ("/**", "", True),
        ("/**", "/a/b", True),
        ("/*", "", True),
        ("/*", "/robot1", False),
        ("/*/navigate", "/robot1", True),
        ("/*/navigate", "/a/b", False),
        ("/**/navigate", "/a/b", True),
        ("/**/navigate", "", True),
        ("/robot1/**", "/robot1", True),
        ("/robot1/**", "/robot11", False),
        ("/robot1/*", "/robot1", True),
    ],
)
@pytest.mark.parametrize("nested", [False, True])
def test_which_nodes_a_section_is_for(tmp_path, key, namespace, is_for, nested):
    where, _, last = key.rpartition("/")
    if nested and where:
        file = written(tmp_path, f"{where}:\n  '{last}':\n    ros__parameters: {{max_vel_x: 0.2}}\n")
    else:
        file = written(tmp_path, f"{key}:\n  ros__parameters: {{max_vel_x: 0.2}}\n")
    found = Config(read_sections(file), namespace).of("navigate")
    assert found == ({"max_vel_x": 0.2} if is_for else {})


def test_names_with_dots_may_be_written_as_mappings(tmp_path):
    file = written(
        tmp_path, "/navigate:\n  ros__parameters:\n    scan: {obstacle_range: 2.0, a: {b: [1, 2]}}\n"
    )
    assert Config(read_sections(file)).of("navigate") == {"scan.obstacle_range": 2.0, "scan.a.b": [1, 2]}


def test_later_files_and_rules_go_over_earlier_ones(tmp_path):
    robot = tmp_path / "robot.yaml"
    robot.write_text("navigate: {max_vel_x: 0.1, min_vel_x: 0.05}\n")
    file = written(tmp_path, "/*/navigate:\n  ros__parameters: {max_vel_x: 0.2, xy_goal_tolerance: 0.3}\n")
    rules = ("-p", "navigate:max_vel_x:=0.3", "-p", "seed:=7")
    options = BringUp(
        folder=str(tmp_path),
        config_file=str(robot),
        ros_arguments=(*ROBOT1, "--params-file", str(file), *rules),
    )
    found = config_of(options).of("navigate", known={"max_vel_x", "min_vel_x", "xy_goal_tolerance"})
    assert found == {"max_vel_x": 0.3, "min_vel_x": 0.05, "xy_goal_tolerance": 0.3}


def test_each_node_gets_what_it_has_of_a_section_for_all(tmp_path):
    file = written(tmp_path, "/**:\n  ros__parameters: {max_vel_x: 0.2, save_map_timeout: 3.0}\n")
    options = BringUp(folder=str(tmp_path), ros_arguments=(*ROBOT1, "--params-file", str(file)))
    given = {made.func.__name__: made.keywords["parameters"] for made in factories("navigation", options)}
    assert given["NavigationNode"]["max_vel_x"] == 0.2 and "max_vel_x" not in given["MapServerNode"]
    assert given["MapServerNode"]["save_map_timeout"] == 3.0


@pytest.mark.parametrize(
    ("content", "place", "part"),
    [
        ("/robot1/navigat:\n  ros__parameters: {a: 1}\n", "1:1", "'navigat' (would have worked: navigate"),
        ("/robot1:\n  navigat:\n    ros__parameters: {a: 1}\n", "2:3", "would have worked: navigate"),
        ("/navigate:\n  ros__parameters: {a: 1}\n", "1:1", "navigate, /robot1/navigate"),
        ("/*/navigat:\n  ros__parameters: {a: 1}\n", "1:1", "would have worked: navigate"),
        ("/**:\n  ros__parameters: {max_vel: 1.0}\n", "2:30", "max_vel_x"),
        ("/**:\n  ros__parameters: {max_vel_x: fast}\n", "2:32", "a number"),
        ("/*/navigate:\n  ros__parameters:\n    scan: {obstacle_range: -1.0}\n", "3:28", "0 or more"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(tmp_path, content, place, part):
    file = written(tmp_path, content)
    options = BringUp(folder=str(tmp_path), ros_arguments=(*ROBOT1, "--params-file", str(file)))
    with pytest.raises(ConfigError) as error:
        check_options(options)
    assert f"{file}:{place}: " in str(error.value) and part in str(error.value)


@pytest.mark.parametrize(
    ("rule", "part"),
    [
        ("navigat:max_vel_x:=1.0", "would have worked: navigate"),
        ("navigate:max_vel:=1.0", "would have worked: max_vel_x"),
        ("max_vel:=1.0", "max_vel_x"),
        ("navigate:max_vel_x:=fast", "a number"),
        ("navigate:max_vel_x", "sets no parameter"),
        ("max_vel_x:=", "sets no parameter"),
        ("max_vel_x:=[1", "not YAML"),
    ],
)
def test_what_is_wrong_with_a_rule_is_told(tmp_path, rule, part):
    with pytest.raises(ConfigError) as error:
        check_options(BringUp(folder=str(tmp_path), ros_arguments=("-p", rule)))
    assert rule in str(error.value) and part in str(error.value)


def test_one_file_may_serve_several_robots(tmp_path):
    file = written(
        tmp_path,
        "/robot1/navigate:\n  ros__parameters: {max_vel_x: 0.2}\n"
        "/robot2/navigate:\n  ros__parameters: {max_vel_x: 0.4}\n"
        "/robot2/arm_of_another_maker:\n  ros__parameters: {grip: true}\n",
    )
    options = BringUp(folder=str(tmp_path), ros_arguments=(*ROBOT1, "--params-file", str(file)))
    check_options(options)
    assert config_of(options).of("navigate")["max_vel_x"] == 0.2


def test_the_example_of_the_documentation_is_right(tmp_path):
    page = (Path(__file__).parents[3] / "docs" / "reference" / "ros_api.md").read_text()
    (example,) = re.findall(r"```yaml\n(# params\.yaml\n.*?)```", page, re.DOTALL)
    file = written(tmp_path, example)
    speeds = {}
    for namespace in ("/robot1", "/robot2"):
        rules = ("-r", f"__ns:={namespace}", "--params-file", str(file))
        options = BringUp(folder=str(tmp_path), ros_arguments=rules)
        check_options(options)
        config = config_of(options)
        speeds[namespace] = config.of("navigate")["max_vel_x"]
        assert config.of("navigate")["scan.obstacle_range"] == 2.5
        assert config.of("florence_bt")["keep_runs"] == 50
    assert speeds == {"/robot1": 0.25, "/robot2": 0.15}


@pytest.mark.parametrize("rule", ["__node:=florence", "navigate:__node:=nav", "navigate:__ns:=/x"])
def test_nodes_keep_their_names(tmp_path, rule):
    with pytest.raises(ConfigError, match="find each other by their names"):
        BringUp(folder=str(tmp_path), ros_arguments=("-r", rule))
