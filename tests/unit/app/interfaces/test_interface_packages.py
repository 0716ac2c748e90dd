"""Packages of interfaces: what is refused before anything is built, what is listed and shown."""

from __future__ import annotations

import sys
import sysconfig
from pathlib import Path

import pytest
from typer.testing import CliRunner

pytest.importorskip("rosidl_adapter")
pytest.importorskip("nav2_msgs")

from florence_bt.app.interfaces.adding import DEFINITIONS, add_package
from florence_bt.app.interfaces.building import InterfacePackage
from florence_bt.app.interfaces.installed import installed_packages, show
from florence_bt.cli.application import app
from florence_bt.core.errors import ConfigError


@pytest.fixture(autouse=True)
def no_sourced_ros(monkeypatch):
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


def package(folder: Path, name: str = "hand_msgs", **files: str) -> str:
    """Write a package without package.xml; ``msg_Finger`` is ``msg/Finger.msg``."""
    for key, text in files.items():
        kind, _, last = key.partition("_")
        file = folder / name / kind / f"{last}.{kind}"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return str(folder / name)


def refused(source: str, tmp_path: Path, **options: bool) -> ConfigError:
    with pytest.raises(ConfigError) as caught:
        add_package(source, prefix=tmp_path / "prefix", **options)
    assert not (tmp_path / "prefix").exists()
    return caught.value


@pytest.mark.parametrize(
    ("files", "line", "about"),
    [
        ({"msg_Finger": "# a finger\nfloat64 force\nfloat65 position\n"}, 3, "float65"),
        ({"msg_Finger": "float64 force\nposition\n"}, 2, "position"),
        ({"msg_Finger": "uint8 OPEN=300\n"}, 1, "300"),
        ({"msg_Finger": "geometry_msgs/Pose2 where\n"}, 1, "Pose2"),
        ({"msg_Finger": "Thumb thumb\n"}, 1, "Thumb"),
        ({"srv_Grip": "float64 width\n---\nbool 1st\n"}, 3, "1st"),
        ({"srv_Grip": "float64 width\n"}, 1, "---"),
        ({"action_Grip": "float64 width\n---\nbool done\n"}, 1, "---"),
        ({"msg_Finger": "float64 force\nother_msgs/Thing thing\n"}, 2, "other_msgs"),
    ],
)
def test_a_definition_that_is_wrong_is_told_with_its_line(tmp_path, files, line, about):
    error = refused(package(tmp_path, **files), tmp_path)
    assert (error.line, Path(error.file).parents[1].name) == (line, "hand_msgs")
    assert about in error.problem


def test_everything_that_is_wrong_with_a_package_is_told_at_once(tmp_path):
    source = package(
        tmp_path,
        msg_Finger="float64 force\nfloat65 position\nwidth\nfloat64 good\ngeometry_msgs/Pose2 where\n",
        msg_Hand="other_msgs/Thing thing\nFinger[5] fingers\nThumb thumb\nanother_msgs/Thing thing2\n",
        srv_Grip="float64 width\nbool 1st\n",
    )
    error = refused(source, tmp_path)
    lines = error.problem.splitlines()[1:]
    places = [tuple(line.partition("hand_msgs/")[2].split(":")[:2]) for line in lines]
    finger, hand, grip = ("msg/Finger.msg", "msg/Hand.msg", "srv/Grip.srv")
    assert places == [
        *[(finger, line) for line in "235"],
        *[(hand, line) for line in "134"],
        *[(grip, line) for line in "12"],
    ]
    for line, about in zip(
        lines, ["float65", "width", "Pose2", "other_msgs", "Thumb", "another_msgs", "---", "1st"], strict=True
    ):
        assert about in line
    for kind, text in (("Finger", "# Größe\n"), ("Hand", "# Länge\n")):
        Path(source, "msg", f"{kind}.msg").write_bytes(text.encode("latin-1"))
    told = refused(source, tmp_path).problem
    assert "Finger.msg:1" in told and "Hand.msg:1" in told and "1st" in told


def test_a_definition_in_another_encoding_is_told_with_its_line(tmp_path):
    source = package(tmp_path, msg_Finger="float64 force\n")
    Path(source, "msg", "Finger.msg").write_bytes("# eine Zahl\nfloat64 force # Größe\n".encode("latin-1"))
    error = refused(source, tmp_path)
    assert (error.line, error.column) == (2, 19) and "UTF-8" in f"{error.problem} {error.valid}"


def test_a_wrong_name_of_a_file_is_one_mistake(tmp_path):
    error = refused(package(tmp_path, msg_finger="uint8 force\nfloat64 width\n"), tmp_path)
    assert error.file.endswith("finger.msg") and "'finger'" in error.problem


def test_a_package_that_is_needed_and_not_there_says_how_to_add_it(tmp_path):
    error = refused(package(tmp_path, msg_Finger="other_msgs/Thing thing\n"), tmp_path)
    assert "florence interfaces add FOLDER_OF_other_msgs" in error.valid


def test_a_broken_manifest_is_told_with_its_line(tmp_path):
    source = package(tmp_path, msg_Finger="float64 force\n")
    Path(source, "package.xml").write_text("<package>\n  <name>hand_msgs</nam>\n</package>\n")
    error = refused(source, tmp_path)
    assert (Path(error.file).name, error.line) == ("package.xml", 2)


def test_nothing_to_build_and_no_such_package(tmp_path):
    (tmp_path / "empty").mkdir()
    assert "no definitions" in refused(str(tmp_path / "empty"), tmp_path).problem
    assert "nav2_msgs" in refused("nav_2_msgs", tmp_path).valid


def test_an_installed_package_is_not_shadowed(tmp_path):
    source = package(tmp_path, "std_srvs", srv_Wave="---\n")
    assert "--replace" in refused(source, tmp_path).valid
    with pytest.raises(ConfigError, match="ros-std-srvs"):  # others are built against it
        add_package(source, replace=True)


def test_without_a_compiler(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    error = refused(package(tmp_path, msg_Finger="float64 force\n"), tmp_path)
    assert "compiler" in error.problem and "apt install build-essential" in error.valid


def test_without_the_headers_of_python(tmp_path, monkeypatch):
    monkeypatch.setattr(sysconfig, "get_path", lambda name: str(tmp_path))
    error = refused(package(tmp_path, msg_Finger="float64 force\n"), tmp_path)
    assert "headers" in error.problem and "apt install python3-dev" in error.valid


def test_with_a_sourced_ros_nothing_is_built(tmp_path, monkeypatch):
    index = tmp_path / "ros" / "share" / "ament_index" / "resource_index" / "rosidl_interfaces"
    index.mkdir(parents=True)
    (index / "nav2_msgs").write_text("msg/Costmap.idl\nmsg/Costmap.msg")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "ros"))
    assert installed_packages()["nav2_msgs"].origin == str(tmp_path / "ros")
    said: list[str] = []
    add_package("nav2_msgs", say=said.append)
    assert str(tmp_path / "ros") in said[0]
    with pytest.raises(ConfigError, match="a ROS 2 is sourced"):
        add_package(package(tmp_path, msg_Finger="float64 force\n"))


def test_the_name_of_a_folder_without_manifest_is_that_of_the_package(tmp_path):
    made = InterfacePackage.read(
        Path(package(tmp_path, msg_A="int8 a\n", action_B="---\n---\nstd_msgs/Bool b\n"))
    )
    assert (made.name, made.files) == ("hand_msgs", ("msg/A.msg", "action/B.action"))
    assert {"std_msgs", "action_msgs", "service_msgs"} <= set(made.needs)


def test_the_list_counts_types_and_says_where_they_are_from():
    listed = CliRunner().invoke(app, ["interfaces"])
    lines = {line.split()[0]: line.split()[1:] for line in listed.output.splitlines()}
    assert lines["std_srvs"] == ["-", "3", "-", "Python", "package"]
    assert installed_packages()["std_srvs"].prefix == Path(sys.prefix)


def test_a_type_is_shown_with_constants_and_the_fields_of_its_fields():
    shown = show("sensor_msgs/msg/BatteryState").splitlines()
    assert any(line.split()[1:] == ["POWER_SUPPLY_STATUS_CHARGING", "=", "1"] for line in shown)
    assert "    builtin_interfaces/Time stamp" in shown and "        uint32 nanosec" in shown
    assert show("std_srvs/SetBool") == show("std_srvs/srv/SetBool")
    assert show("std_srvs").split() == ["std_srvs/srv/Empty", "std_srvs/srv/SetBool", "std_srvs/srv/Trigger"]


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("std_srvs/srv/SetBol", "std_srvs/srv/SetBool"),
        ("std_srv/srv/SetBool", "std_srvs"),
        ("std_srvs/SetBool/x", "nav2_msgs/action/Spin"),
    ],
)
def test_what_is_not_installed_is_not_shown(name, near):
    with pytest.raises(ConfigError) as caught:
        show(name)
    assert near in caught.value.valid


def test_the_definitions_that_come_with_florence_are_sound():
    from florence_bt.app.interfaces.adding import _wrong_definitions
    from florence_bt.app.interfaces.building import ADDED, Environment

    here = Environment(Path(sys.prefix), Path(sys.prefix), ADDED)
    installed = installed_packages()
    for folder in DEFINITIONS.iterdir():
        assert not [*_wrong_definitions(InterfacePackage.read(folder), installed, here)]
    assert len(InterfacePackage.read(DEFINITIONS / "nav2_msgs").files) == 50
