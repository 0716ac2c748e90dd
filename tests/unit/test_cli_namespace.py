"""``--namespace``, ``FLORENCE_NAMESPACE`` and ``--ros-args`` of the command ``florence``."""

from __future__ import annotations

import sys

import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("rclpy")

from florence_bt import cli
from florence_bt.app.runs import remote, switch_override
from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import OK, USAGE
from florence_bt.ros import arguments
from florence_bt.ros.arguments import namespace, ros_arguments

VERBS = [
    "run",
    "status",
    "stop",
    "pause",
    "resume",
    "override",
    "release",
    "reload",
    "answer",
    "runs",
    "where",
    "up",
    "demo",
    "doctor",
    "calibrate",
    "missions",
    "check",
    "skills",
]
SEEN = [
    ([], {}, ""),
    (["--namespace", "/robot1"], {}, "/robot1"),
    ([], {"FLORENCE_NAMESPACE": "robot2"}, "/robot2"),
    (["--namespace", "/robot1"], {"FLORENCE_NAMESPACE": "robot2"}, "/robot1"),
    (["--ros-args", "-r", "__ns:=/robot1"], {"FLORENCE_NAMESPACE": "robot2"}, "/robot1"),
    (["--namespace", "/robot1", "--ros-args", "-r", "__ns:=/robot1"], {}, "/robot1"),
]


@pytest.fixture(autouse=True)
def _without(monkeypatch):
    monkeypatch.setattr(arguments, "_arguments", ())
    monkeypatch.delenv("FLORENCE_NAMESPACE", raising=False)


def test_every_verb_that_talks_to_ros_takes_them():
    verbs = typer.main.get_command(app).commands
    groups = [verbs["map"].commands["save"], verbs["skills"].commands["add"]]
    for verb in [*(verbs[name] for name in VERBS), *groups]:
        assert {"--namespace", "--ros-args"} <= {word for each in verb.params for word in each.opts}, (
            verb.name
        )


@pytest.mark.parametrize(("words", "environment", "expected"), SEEN)
def test_a_verb_has_the_namespace_while_it_works(monkeypatch, words, environment, expected):
    seen = []

    def stop(run_id, reason):
        seen.append(namespace())
        return True, "stopped"

    monkeypatch.setattr(remote, "stop_mission", stop)
    assert CliRunner().invoke(app, ["stop", *words], env=environment).exit_code == OK
    assert (seen, ros_arguments()) == ([expected], ())


@pytest.mark.parametrize(("words", "environment", "expected"), SEEN)
def test_the_emergency_button_has_it_too(monkeypatch, words, environment, expected):
    seen = []

    def stop(by: str) -> switch_override.Stopped:
        seen.append((True, namespace()))
        return switch_override.Stopped("", 1)

    monkeypatch.setattr(switch_override, "stop_the_robot", stop)
    monkeypatch.setattr(sys, "argv", ["florence", "override", *words])
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert (end.value.code, seen) == (OK, [(True, expected)])


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["status", "--namespace", "a b"], "not a namespace"),
        (["stop", "--namespace", "/a", "--ros-args", "-r", "__ns:=/b"], "/a and /b"),
        (["up", "--sim", "--ros-args", "-r", "__node:=x"], "__node"),
        (["up", "--sim", "--params-file", "none.yaml"], "none.yaml: the file cannot be read"),
        (["up", "--sim", "--ros-args", "-p", "navigat:max_vel_x:=1.0"], "navigate"),
        (["draw", "goto_user", "--namespace", "/a"], "No such option"),
    ],
)
def test_wrong_usage(monkeypatch, tmp_path, words, text):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, words)
    assert done.exit_code == USAGE and text in done.stderr, done.stderr
    monkeypatch.setattr(sys, "argv", ["florence", "override", "--namespace", "a b"])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == USAGE
