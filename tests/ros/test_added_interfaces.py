"""A robot with interfaces of its own: their package is built and added, and missions drive it."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("rosidl_adapter")

from tests.ros.conftest import Child

pytestmark = [pytest.mark.ros, pytest.mark.slow]

EXAMPLE = Path(__file__).parents[2] / "examples" / "foreign_robot"
FLORENCE = (sys.executable, "-m", "florence_bt.cli")
MISSIONS = ("--missions", EXAMPLE / "hand_missions")


def test_the_hand_of_the_example(
    ros_domain: int,
    start_process: Callable[..., Child],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def florence(*words: str | Path) -> tuple[int, str]:
        child = start_process(*FLORENCE, *words)
        return child.process.wait(500), child.output

    code, said = florence("check", EXAMPLE / "hand_missions")
    assert code == 0 and "'gripper_interfaces' is not installed" in said

    prefix = tmp_path / "prefix"
    code, said = florence("interfaces", "add", EXAMPLE / "gripper_interfaces", "--prefix", prefix)
    assert code == 0, said
    code, said = florence("interfaces", "add", EXAMPLE / "gripper_interfaces", "--prefix", prefix)
    assert code == 0 and "from the cache" in said, "what one has added oneself can be added again"
    python = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    for variable, place in (
        ("PYTHONPATH", prefix / "lib" / python / "site-packages"),
        ("LD_LIBRARY_PATH", prefix / "lib"),
    ):
        monkeypatch.setenv(variable, os.pathsep.join([str(place), *filter(None, [os.environ.get(variable)])]))
    code, said = florence("check", EXAMPLE / "hand_missions")
    assert code == 0 and "no problem found" in said, said

    system = start_process(*FLORENCE, "up", "--missions-only", *MISSIONS, "--out", tmp_path / "out")
    told = system.wait_for("  take: action /tb4/hand/grip")
    assert "gripper_interfaces/action/Grip" in told and "dock_robot" not in told
    start_process(sys.executable, EXAMPLE / "robot.py", "--hand")
    system.wait_for("every server that missions need is there")
    code, said = florence("run", "take_cup", "--headless")
    assert code == 0 and "force" in said and "10" in said, said
    code, said = florence("run", "take_feather", "--headless")
    assert code == 1 and "nothing felt in 3 tries" in said, said
    code, said = florence("skills", "add")
    assert "action /tb4/hand/grip gripper_interfaces/action/Grip" in said.splitlines()
    assert "service /tb4/light std_srvs/srv/SetBool" in said.splitlines() and "rosout" not in said
    assert system.end() == 130
