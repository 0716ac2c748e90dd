"""Florence's skills on a Nav2 of other people, played by a process of its own (``nav2_peer.py``)."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from florence_bt.app.bringup.options import BringUp
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.paths import find_data
from florence_bt.skills.navigation.navigate.bindings import NOT_OF_NAV2
from tests.ros.conftest import GENEROUS_S

pytestmark = pytest.mark.ros

PEER = Path(__file__).parent / "nav2_peer.py"
HERE = Pose2()


@pytest.fixture
def nav2(ros: Any, start_process: Any) -> Any:
    peer = start_process(PEER)
    ros.spin_until(lambda: "up" in peer.output, what="the peer")
    return peer


@pytest.fixture
def skills(ros: Any, nav2: Any) -> Any:
    from florence_bt.app.bringup.skills_ros import make_skills
    from florence_bt.ros.node import FlorenceNode

    return make_skills(ros.add(FlorenceNode("missions")))


def run(ros: Any, skills: Any, name: str, **inputs: Any) -> Result:
    started = skills[name].start(inputs)
    ros.spin_until(lambda: started.poll() is not None, what=name)
    return started.poll()


def inputs_of(name: str, number: float) -> dict[str, Any]:
    """Inputs whose goal has a number in it, which tells the peer what to do."""
    return {
        "navigate_to": {"goal": Pose2(number)},
        "navigate_through": {"via": HERE, "goal": Pose2(number)},
        "plan_to": {"goal": Pose2(number)},
        "turn": {"angle": number, "time_allowance": 5.0},
        "drive_back": {"distance": number, "speed": 0.1, "time_allowance": 5.0},
        "drive_straight": {"distance": number, "speed": 0.1, "time_allowance": 5.0},
    }[name]


SKILLS = ("navigate_to", "navigate_through", "plan_to", "turn", "drive_back", "drive_straight")


def test_every_skill_of_nav2_succeeds_and_is_rejected_with_a_reason(ros: Any, skills: Any) -> None:
    for name in SKILLS:
        assert run(ros, skills, name, **inputs_of(name, 0.0)).succeeded, name
        rejected = run(ros, skills, name, **inputs_of(name, 1.0))
        assert (rejected.outcome, rejected.code) == (Outcome.FAILED, "rejected"), name
        assert rejected.reason
    assert run(ros, skills, "plan_to", goal=Pose2(0.0, 3.0)).outputs == {"length": 3.0}
    assert run(ros, skills, "clear_costmap").succeeded


@pytest.mark.parametrize(
    ("name", "codes"),
    [
        (
            "navigate_to",
            {
                100: "blocked", 101: "blocked", 102: "no_pose", 103: "blocked", 104: "blocked",
                105: "no_progress", 106: "blocked", 107: "no_scan", 200: "bad_input", 202: "no_transform",
                203: "start_outside", 204: "goal_outside", 205: "blocked", 206: "goal_occupied",
                207: "timed_out", 208: "no_path", 702: "blocked", 999: "blocked",
            },
        ),
        ("navigate_through", {104: "blocked", 303: "start_outside", 306: "goal_occupied", 308: "no_path"}),
        ("plan_to", {202: "no_transform", 205: "start_occupied", 206: "goal_occupied", 208: "no_path"}),
        ("turn", {700: "turn_failed", 701: "time_allowance", 702: "no_pose", 703: "collision_ahead"}),
        (
            "drive_back",
            {710: "drive_failed", 711: "time_allowance", 713: "bad_input", 714: "collision_ahead"},
        ),
        ("drive_straight", {720: "drive_failed", 721: "time_allowance", 723: "collision_ahead"}),
    ],
)  # fmt: skip
def test_error_codes_of_nav2(ros: Any, skills: Any, name: str, codes: dict[int, str]) -> None:
    for number, code in codes.items():
        result = run(ros, skills, name, **inputs_of(name, float(number)))
        assert (result.outcome, result.code) == (Outcome.FAILED, code)
        assert str(number) in result.reason


def test_a_goal_that_is_accepted_late_is_reached_or_cancelled(ros: Any, skills: Any, nav2: Any) -> None:
    assert run(ros, skills, "navigate_to", goal=Pose2(2.0)).succeeded
    late = skills["navigate_to"].start({"goal": Pose2(4.0)})
    late.cancel()
    ros.spin_until(lambda: late.poll() is not None, what="the cancel")
    assert late.poll().outcome is Outcome.CANCELLED
    endless = skills["turn"].start({"angle": 4.0, "time_allowance": 5.0})
    ros.spin_until(lambda: "Spin 4" in nav2.output, what="the work")
    endless.cancel()
    ros.spin_until(lambda: endless.poll() is not None, what="the cancel")
    assert endless.poll().outcome is Outcome.CANCELLED


def test_a_nav2_that_dies_is_told(ros: Any, skills: Any, nav2: Any) -> None:
    result = run(ros, skills, "navigate_to", goal=Pose2(3.0))
    assert (result.outcome, result.code) == (Outcome.FAILED, "server_lost")
    assert nav2.process.wait(GENEROUS_S) == 1
    assert run(ros, skills, "navigate_to", goal=HERE).code == "server_lost"


def test_what_cannot_be_combined(tmp_path: Path) -> None:
    for options, part in (
        ({"nav": "nav3"}, "would have worked: nav2"),
        ({"base": "none"}, "--base is 'none'"),
        ({"base": "running"}, "--robot CONFIG --base running --nav nav2"),
        ({"base": "running", "simulated": False}, "--robot CONFIG --base running --nav nav2"),
    ):
        with pytest.raises(ConfigError, match=part):
            BringUp(folder=str(tmp_path), **options)  # type: ignore[arg-type]


def test_what_nav2_cannot_do_says_so(ros: Any) -> None:
    from florence_bt.app.bringup.skills_ros import make_skills
    from florence_bt.ros.node import FlorenceNode

    lacking = make_skills(ros.add(FlorenceNode("missions")), without=NOT_OF_NAV2)["follow_user"].start({})
    result = lacking.poll()
    assert result is not None
    assert (result.code, result.reason) == ("no_skill", "nothing serves follow_user with --nav nav2")


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "options",
    [
        ("--sim", "--person", "absent"),
        ("--robot", str(find_data("config", "turtlebot4.yaml")), "--base", "running"),
    ],
)
def test_a_system_with_nav2_runs_missions(
    ros_domain: int,
    start_process: Any,
    tmp_path: Path,
    options: tuple[str, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("NAV2_PEER_LACKS", "spin")
    florence = [sys.executable, "-m", "florence_bt.cli"]
    peer = start_process(PEER, find_data("maps", "flat.yaml"), "4.5", "1.4", "0.0")
    up = start_process(*florence[1:], "up", *options, "--nav", "nav2", "--out", tmp_path / "up")
    wait_for(lambda: "in another terminal" in up.output or up.process.poll() is not None)
    assert "in another terminal" in up.output, up.output
    assert "'follow_user' is missing: nothing serves follow_user with --nav nav2" in up.output

    def mission(*words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*florence, "run", *words], capture_output=True, text=True, timeout=GENEROUS_S)

    there = mission("goto_pose", "x=0.2 m", "y=2.0 m", "phi=0 rad")
    assert there.returncode == 0, there.stdout + there.stderr
    wait_for(lambda: "NavigateToPose 0" in peer.output)
    # What nobody serves is told, and keeps down only what needs it.
    wait_for(lambda: "turn: action /spin (nav2_msgs/action/Spin)" in up.output)
    assert "navigate_to: " not in up.output
    failed = mission("goto_pose", "x=106 m", "y=2.0 m", "phi=0 rad")
    assert failed.returncode == 1
    assert "error code 106 [blocked]" in failed.stdout
    os.kill(up.process.pid, signal.SIGTERM)
    up.process.wait(GENEROUS_S)


def wait_for(condition: Any, limit_s: float = 240.0) -> None:
    end = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.1)
