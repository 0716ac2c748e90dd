"""Values of a configuration that a node would refuse: told with their place before any process starts."""

from __future__ import annotations

import dataclasses
import inspect
import re
import typing

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.bringup.config import Config, read_sections
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.preflight import check_options
from florence_bt.app.bringup.topology import NODES, node_class, node_classes, refuse_wrong_parameters
from florence_bt.core.errors import ConfigError
from florence_bt.core.limits import Limits
from florence_bt.ros.parameters import from_parameter

SQUARE = "[[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]]"


def test_every_node_has_its_class():
    assert set(node_classes()) == {node for nodes in NODES.values() for node in nodes} | {"page_server"}


@pytest.mark.parametrize("name", node_classes())
def test_what_a_node_reads_is_what_is_checked(name):
    kind = node_class(name)
    read = re.findall(r"read_parameters\((\w+)\)", inspect.getsource(kind))
    assert set(read) <= {cls.__name__ for cls in kind.parameter_classes}


def test_the_configuration_of_the_package_is_right():
    refuse_wrong_parameters(Config(read_sections()))


@pytest.mark.parametrize(
    ("content", "place", "part"),
    [
        ("velocity_filter: {max_linear_acc: -1.0}", "1:35", "max_linear_acc: 1.0 (above 0)"),
        ("velocity_filter: {max_linear_acc: fast}", "1:35", "a number"),
        ("/navigate:\n  ros__parameters:\n    max_vel_x: .nan\n", "3:16", "max_vel_x is nan"),
        ("localiser: {transform_rate: 1e+20}", "1:29", "at most 1000"),
        ("localiser: {laser_max_range: .inf}", "1:30", "laser_max_range is inf"),
        ("navigate: {max_vel: 1}", "1:21", "would have worked: max_vel_x"),
        ("navigate: {escape_vel: 1}", "1:24", "backs up as a recovery behaviour"),
        ("navigate: {spin_min_speed: 3.0}", "1:28", "must not be above spin_max_speed"),
        ("navigate: {active_scan_period: -1.0}", "1:32", "active_scan_period"),
        ("navigate: {scan.obstacle_range: -1.0}", "1:33", "0 or more"),
        ("navigate: {footprint: [1.0, 2.0]}", "1:23", "three or more corners"),
        ("navigate: {footprint: '[[0.2'}", "1:23", "a list"),
        ("navigate: {use_sim_time: 3}", "1:26", "use_sim_time"),
        ("florence_bt: {keep_runs: -3}", "1:26", "0 or more"),
        ("turtlebot_node: {port: 3}", "1:24", "a text"),
        ("map_server: {}\nnavigat: {a: 1}", "2:1", "would have worked: navigate"),
    ],
)
@pytest.mark.parametrize("options", [{}, {"simulated": False}, {"simulated": False, "emulated": True}])
def test_a_bad_value_is_told_with_its_place(tmp_path, content, place, part, options):
    file = tmp_path / "robot.yaml"
    file.write_text(content)
    with pytest.raises(ConfigError) as error:
        check_options(BringUp(folder=str(tmp_path / "out"), config_file=str(file), **options))
    assert str(error.value).startswith(f"{file}:{place}: ") and part in str(error.value)


def test_everything_that_is_wrong_with_a_configuration_is_told_in_the_order_of_the_file(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(
        "navigate: {max_vel_x: -1.0, scan.obstacle_range: -1.0, max_vel: 1, footprint: 7}\n"
        "navigat: {a: 1}\n"
        "turtlebot_node:\n  port: 3\n  data_timeout: 0.0\n  lowest_charge: 2.0\n"
        "/**: {no_such: 1, nor_such: 2}\n"
    )
    with pytest.raises(ConfigError) as error:
        check_options(BringUp(folder=str(tmp_path / "out"), config_file=str(file)))
    head, *told = str(error.value).splitlines()
    assert head == "10 mistakes:"
    places = [line.removeprefix(f"{file}:").partition(": ")[0] for line in told]
    assert [int(place.partition(":")[0]) for place in places] == [1, 1, 1, 1, 2, 4, 5, 6, 7, 7]
    for line, name in zip(told, ["max_vel_x", "obstacle_range", "max_vel", "footprint"], strict=False):
        assert name in line, line


def test_a_footprint_as_nav2_writes_it(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(f'navigate: {{footprint: "{SQUARE}", use_sim_time: true}}')
    refuse_wrong_parameters(Config(read_sections(file)))
    read = from_parameter("footprint", tuple[float, ...], SQUARE)
    assert read == (0.2, 0.2, 0.2, -0.2, -0.2, -0.2, -0.2, 0.2)


@pytest.mark.parametrize("name", node_classes())
def test_every_number_has_limits(name):
    """NaN and infinity are told by limits alone."""
    unlimited = {"seed", "operation_mode", "save_map_timeout"}  # any; one of a list; of the map server
    for cls in node_class(name).parameter_classes:
        hints = typing.get_type_hints(cls, include_extras=True)
        for field in dataclasses.fields(cls):
            kind = hints[field.name]
            if kind in (float, int) and field.name not in unlimited:
                pytest.fail(f"{cls.__name__}.{field.name} takes every number: {Limits.__name__}")
