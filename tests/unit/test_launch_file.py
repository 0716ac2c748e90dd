"""``launch/florence.launch.py``, read with a stand-in for ROS 2 launch, which is not on PyPI."""

from __future__ import annotations

import inspect
import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

pytest.importorskip("rclpy")

from florence_bt.app.bringup import topology
from florence_bt.app.bringup.config import config_of
from florence_bt.app.bringup.options import BringUp
from florence_bt.cli.application import app
from florence_bt.cli.launch_arguments import command_words, launch_arguments
from florence_bt.core.errors import ConfigError

ROOT = Path(__file__).parents[2]
FILE = ROOT / "launch" / "florence.launch.py"
ASKED_FOR = {"map", "robot", "namespace", "missions", "nav", "sim", "params_file"}


class Declared:
    """``launch.actions.DeclareLaunchArgument`` of Jazzy, as far as it is used."""

    def __init__(
        self, name: str, *, default_value: str | None = None, description: str | None = None
    ) -> None:
        self.name, self.default, self.description = name, default_value, description


class Opaque:
    """``launch.actions.OpaqueFunction``."""

    def __init__(self, *, function: Any) -> None:
        self.function = function


class Configuration:
    """``launch.substitutions.LaunchConfiguration``."""

    def __init__(self, name: str) -> None:
        self._name = name

    def perform(self, context: Any) -> str:
        value: str = context.launch_configurations[self._name]
        return value


class Started:
    """``launch_ros.actions.Node`` of Jazzy, with what Florence uses of it; texts only, as launch wants."""

    def __init__(
        self,
        *,
        executable: str,
        package: str,
        namespace: str,
        arguments: list[str],
        output: str,
        emulate_tty: bool,
        sigterm_timeout: str,
        sigkill_timeout: str,
    ) -> None:
        texts = (executable, package, namespace, *arguments, output, sigterm_timeout, sigkill_timeout)
        assert all(isinstance(text, str) for text in texts)
        assert emulate_tty and float(sigterm_timeout) > 5.0
        self.package, self.executable = package, executable
        # What launch_ros adds to the command line for a namespace, also for one of an outer launch file.
        rule = ["--ros-args", "-r", f"__ns:=/{namespace.strip('/')}"] if namespace else []
        self.words = [*arguments, *rule]


def description(monkeypatch: pytest.MonkeyPatch) -> tuple[list[Declared], Any]:
    """Read the launch file; gives its arguments, and what starts the process."""
    for name, parts in {
        "launch": {"LaunchContext": object, "LaunchDescription": list},
        "launch.actions": {"DeclareLaunchArgument": Declared, "OpaqueFunction": Opaque},
        "launch.substitutions": {"LaunchConfiguration": Configuration},
        "launch_ros": {},
        "launch_ros.actions": {"Node": Started},
    }.items():
        module = ModuleType(name)
        vars(module).update(parts)
        monkeypatch.setitem(sys.modules, name, module)
    *declared, start = runpy.run_path(str(FILE))["generate_launch_description"]()
    return declared, start.function


def launched(monkeypatch: pytest.MonkeyPatch, **given: str) -> Started:
    declared, start = description(monkeypatch)
    names = {each.name: each.default for each in declared}
    assert set(given) <= set(names)
    (node,) = start(SimpleNamespace(launch_configurations={**names, **given}))
    assert isinstance(node, Started)
    return node


def brought_up(monkeypatch: pytest.MonkeyPatch, words: list[str]) -> BringUp:
    """What ``florence up`` makes of a command line."""
    made: list[BringUp] = []
    monkeypatch.setattr(
        "florence_bt.app.bringup.up.run_up", lambda options, fork_server: made.append(options)
    )
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    return made[0]


def test_its_arguments_are_the_options_of_up(monkeypatch):
    from florence_bt.cli.system import up

    declared, _ = description(monkeypatch)
    names = {each.name for each in declared}
    assert names >= ASKED_FOR and all(each.description for each in declared)
    of_up = set(inspect.signature(up).parameters)
    assert len(names) == len(of_up) + 1  # and the namespace, which every verb has that talks to ROS


@pytest.mark.parametrize(
    ("given", "options"),
    [
        ({"sim": "true"}, ["--sim"]),
        ({"sim": "True", "map": "m.yaml", "seed": "3"}, ["--sim", "--map", "m.yaml", "--seed", "3"]),
        (
            {"sim": "true", "namespace": "robot1", "params_file": "PARAMS", "missions": "a:b"},
            [
                "--sim",
                "--namespace",
                "/robot1",
                "--params-file",
                "PARAMS",
                "--missions",
                "a",
                "--missions",
                "b",
            ],
        ),
        (
            {"robot": "r.yaml", "nav": "nav2", "base": "running"},
            ["--robot", "r.yaml", "--nav", "nav2", "--base", "running"],
        ),
        ({"missions_only": "true"}, ["--missions-only"]),
        ({"folder": "robot", "split": "true"}, ["robot", "--split"]),
        ({"robot": "r.yaml", "emulate": "1", "sim": "false"}, ["--robot", "r.yaml", "--emulate"]),
    ],
)
def test_it_starts_the_processes_nodes_and_parameters_of_up(monkeypatch, tmp_path, given, options):
    monkeypatch.chdir(tmp_path)
    Path("PARAMS").write_text("/robot1/navigate:\n  ros__parameters: {max_vel_x: 0.21}\n")
    Path("r.yaml").write_text("navigate: {max_vel_x: 0.22}\n")
    Path("robot").mkdir()
    Path("robot/florence.yaml").write_text("robot: ../r.yaml\nout: runs\n")
    node = launched(monkeypatch, **given)
    assert (node.package, node.executable) == ("florence_bt", "florence")
    by_launch = brought_up(monkeypatch, node.words)
    by_hand = brought_up(monkeypatch, ["up", *options])
    assert set(by_launch.ros_arguments) == set(by_hand.ros_arguments)
    assert by_launch.folder == by_hand.folder and by_launch.namespace == by_hand.namespace
    assert topology.processes(by_launch) == topology.processes(by_hand)
    assert topology.remappings(by_launch) == topology.remappings(by_hand)
    for name in topology.node_classes():
        assert config_of(by_launch).of(name) == config_of(by_hand).of(name)


def test_the_default_arguments_are_those_of_up(monkeypatch):
    assert launched(monkeypatch).words == ["up"]


def test_a_wrong_value_is_told():
    with pytest.raises(ConfigError, match="sim:=true"):
        command_words({"sim": "maybe"})
    with pytest.raises(ConfigError, match="params_file"):
        command_words({"param_file": "x"})


@pytest.mark.parametrize("folder", ["--sim", "-h", "--", "my_robot"])
def test_a_folder_is_never_an_option(folder):
    (last,) = command_words({"folder": folder})[1:]
    assert not last.startswith("-") and Path(last) == Path(folder)


def test_it_is_installed(monkeypatch):
    monkeypatch.chdir(ROOT)
    made: dict[str, Any] = {}
    monkeypatch.setattr("setuptools.setup", lambda **options: made.update(options))
    runpy.run_path(str(ROOT / "setup.py"))
    assert ("share/florence_bt/launch", ["launch/florence.launch.py"]) in made["data_files"]
    package = (ROOT / "package.xml").read_text()
    assert "<exec_depend>launch_ros</exec_depend>" in package and launch_arguments()
