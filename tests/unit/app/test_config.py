from __future__ import annotations

import pytest

from florence_bt.app.bringup.config import Config, load_config, read_sections
from florence_bt.core.errors import ConfigError


def test_the_configuration_of_the_package_is_read():
    config = load_config()
    assert config and all(isinstance(section, dict) for section in config.values())


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"navigate: {a: 1\nb", r"robot\.yaml:2:\d+: not YAML"),
        (b"- navigate\n", "must map node names"),
        (b"", "must map node names"),
        (b"navigate: 3\n", r"robot\.yaml:1:11: navigate must map parameter names"),
        (b"navigate:\n", "navigate must map parameter names"),
        (b"navigate: \xff\xfe\n", "not UTF-8"),
        (b"navigate: {a: !!python/object:os.system {}}\n", "the tag .* is not allowed"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_with_its_name(tmp_path, content, problem):
    file = tmp_path / "robot.yaml"
    file.write_bytes(content)
    with pytest.raises(ConfigError, match=problem) as error:
        load_config(file)
    assert str(file) in str(error.value)


@pytest.mark.parametrize("name", ["nothing.yaml", "."])
def test_a_file_that_cannot_be_read_is_named(tmp_path, name):
    with pytest.raises(ConfigError, match="cannot be read"):
        load_config(tmp_path / name)


@pytest.mark.parametrize(
    "content",
    [
        "navigate: {speed: 1.5, frames: [map, odom]}",
        "navigate: {ros__parameters: {speed: 1.5, frames: [map, odom]}}",
        "/navigate:\n  ros__parameters:\n    speed: 1.5\n    frames: [map, odom]\n",
    ],
)
def test_parameter_files_of_ros_are_read_too(tmp_path, content):
    file = tmp_path / "robot.yaml"
    file.write_text(content)
    assert load_config(file) == {"navigate": {"speed": 1.5, "frames": ["map", "odom"]}}


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("navigate: {ros__parameters: 3}", "navigate must map parameter names"),
        ("navigate: {a: {}}", r":1:15: navigate: the parameter 'a' is not a number"),
        ("navigate: {a: [1, null]}", "the parameter 'a' is not a number"),
        ("navigate: {a: [{}]}", "the parameter 'a' is not a number"),
        ("navigate: {ros__parameters: {a: {b: {}}}}", "the parameter 'a.b' is not a number"),
        ("navigate: {a: 2020-01-01}", "the parameter 'a' is not a number"),
        ("navigate:\n  a: 2020-13-99", ":2:6: a value cannot be read: month must be"),
        (f"navigate: {{a: {'9' * 5000}}}", "a value cannot be read: Exceeds the limit"),
    ],
)
def test_values_that_are_no_parameters(tmp_path, content, problem):
    file = tmp_path / "robot.yaml"
    file.write_text(content)
    with pytest.raises(ConfigError, match=problem):
        load_config(file)


def test_values_have_the_types_of_yaml(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(
        "n: {a: yes, b: 0x10, c: '1', d: null, e: 1.0e+3, f: .inf, g: [1, true, x], h: '', i: }\n"
    )
    assert load_config(file)["n"] == {
        "a": True, "b": 16, "c": "1", "d": None, "e": 1000.0, "f": float("inf"), "g": [1, True, "x"], "h": "",
        "i": None,
    }  # fmt: skip


def test_overrides_go_over_the_configuration_and_none_is_no_override(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text("navigate: {speed: 1, frame: map}")
    config = Config(read_sections(file))
    assert config.of("navigate", speed=2, frame=None) == {"speed": 2, "frame": "map"}
    assert config.of("localiser", seed=3, port=None) == {"seed": 3}
    assert config.of("navigate") == {"speed": 1, "frame": "map"}


VALUES = "{mass: 1e-1, tiny: 5e-06, huge: 1e+20, plain: 2, name: 1e, text: '1e-1'}"


def test_numbers_with_an_exponent_are_numbers(tmp_path):
    """YAML 1.1, as PyYAML reads it, takes them for text where there is no point."""
    file = tmp_path / "robot.yaml"
    file.write_text(f"n: {VALUES}")
    expected = {"mass": 0.1, "tiny": 5e-06, "huge": 1e20, "plain": 2, "name": "1e", "text": "1e-1"}
    assert load_config(file)["n"] == expected


def test_a_node_that_is_there_twice_is_told(tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text("navigate: {}\n/navigate: {}\n")
    with pytest.raises(ConfigError, match=r":2:1: the node 'navigate' is there twice"):
        load_config(file)
