"""One comparison of names, types and states, for runs, ``check``, ``skills``, ``up`` and ``where``."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("nav2_msgs")

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.trees.language.declared_skills import mappings_in
from tests.ros.conftest import GENEROUS_S, Child, RosBench

pytestmark = pytest.mark.ros

SKILLS = """\
skills:
  scan: {like: call_trigger, service: cart/scan}
  scam: {like: call_set_bool, service: cart/scam}
  dose: {like: call_trigger, service: cart/dose}
  turn_off: {like: call_trigger, service: cart/water}
  water: {action: cart/water, type: nav2_msgs/action/Wait}
  open: {like: is_true, condition: cart/door}
  await_door: {wait_for: cart/door, type: std_msgs/msg/Bool, deadline: 1 s}
  shout: {like: publish_boolean, publish: cart/shout, deadline: 1 s}
  watch_flow: {wait_for: cart/flow, type: std_msgs/msg/Float64, outputs: {flow: {type: number, from: data}}}
  flows: {condition: cart/flow, type: std_msgs/msg/Float64, failures: {dry: {when: $data < 1}}}
"""
WHY = {
    "scan": ("has the type std_srvs/srv/SetBool", "type: std_srvs/srv/SetBool"),
    "scam": ("no service of this name", "/cart/scan"),
    "dose": ("/cart/pump is unconfigured", ""),
    "turn_off": ("/cart/water is an action (nav2_msgs/action/Spin)", "action: /cart/water"),
    "water": ("has the type nav2_msgs/action/Spin", "type: nav2_msgs/action/Spin"),
    "open": ("has the type std_msgs/msg/String", "type: std_msgs/msg/String"),
    "await_door": ("has the type std_msgs/msg/String", "type: std_msgs/msg/String"),
    "shout": ("has the type std_msgs/msg/String", "type: std_msgs/msg/String"),
}
INPUTS = {"scam": "{value: true}", "shout": "{value: true}"}
MISSION = "mission: m\ntree:\n  sequence:\n" + "".join(
    f"    - {name}: {INPUTS.get(name, '')}\n" for name in WHY
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    missions = tmp_path / "missions"
    missions.mkdir()
    (missions / "cart.skills.yaml").write_text(SKILLS, encoding="utf-8")
    (missions / "m.yaml").write_text(MISSION, encoding="utf-8")
    return missions


@pytest.fixture
def robot(start_process: Callable[..., Child]) -> Child:
    child = start_process(str(Path(__file__).with_name("odd_robot.py")))
    child.wait_for("the robot is there")
    return child


def ended(ros: RosBench, skill: Any, inputs: dict[str, Any] | None = None) -> Any:
    run = skill.start(inputs or {})
    return ros.spin_until(run.poll, what="the end of a run")


def test_a_run_says_what_is_wrong_with_its_server(ros: RosBench, robot: Child, folder: Path) -> None:
    from florence_bt.ros.node import FlorenceNode

    skills = make_skills(ros.add(FlorenceNode("missions")), mappings=mappings_in([folder]))
    ros.spin_until(lambda: all(str(skills[name].lack()) for name in WHY), what="the graph")
    for name, (problem, valid) in WHY.items():
        result = ended(ros, skills[name], {"value": True})
        assert result.code == "server_lost", name
        assert problem in result.reason and valid in result.reason, result.reason


def test_nan_is_told_and_is_not_silence(ros: RosBench, robot: Child, folder: Path) -> None:
    from florence_bt.ros.node import FlorenceNode

    skills = make_skills(ros.add(FlorenceNode("missions")), mappings=mappings_in([folder]))
    ros.spin_until(lambda: skills["flows"].start({}).poll().code != "server_lost", what="a message")
    for name in ("flows", "watch_flow"):
        result = ended(ros, skills[name])
        assert (result.code, "nan" in result.reason) == ("bad_output", True), result


def test_the_whole_robot_is_drafted_from_its_graph(
    ros_domain: int, start_process: Callable[..., Child], robot: Child, tmp_path: Path
) -> None:
    florence, file = (sys.executable, "-m", "florence_bt.cli"), tmp_path / "cart.skills.yaml"
    for _ in range(2):  # what is in the file already is left alone
        child = start_process(*florence, "skills", "add", "--all", "cart", "--file", file)
        assert child.process.wait(GENEROUS_S) == 0, child.output
    served = {(each.way, each.name): each for each in mappings_in([tmp_path]).values()}
    wanted = {("service", "/cart/scan"), ("action", "/cart/water"), ("condition", "/cart/door")}
    assert served.keys() == wanted | {
        *(("condition", "/cart/flow"), ("publish", "/cart/shout")),
        ("service", "/cart/pump/change_state"),
    }
    skill = served["service", "/cart/pump/change_state"].declaration.name
    assert skill == "change_pump"


def test_a_managed_node_is_activated_by_name(ros: RosBench, robot: Child, tmp_path: Path) -> None:
    from florence_bt.ros.node import FlorenceNode

    text = "  change_pump: {like: set_lifecycle, service: cart/pump/change_state}\n"
    (tmp_path / "cart.skills.yaml").write_text(SKILLS + text, encoding="utf-8")
    skills = make_skills(ros.add(FlorenceNode("missions")), mappings=mappings_in([tmp_path]))
    assert ended(ros, skills["change_pump"], {"transition": "activate"}).code == "refused"
    for transition in ("configure", "activate"):
        assert ended(ros, skills["change_pump"], {"transition": transition}).succeeded
    assert ended(ros, skills["dose"]).succeeded and not str(skills["dose"].lack())
    assert ended(ros, skills["change_pump"], {"transition": "deactivate"}).succeeded
    ros.spin_until(lambda: "/cart/pump is inactive" in str(skills["dose"].lack()), what="the state")
    assert skills["dose"].server_is_there() and not skills["dose"].lack().wrong_type


@pytest.mark.slow
def test_up_where_and_the_checks_say_the_same(
    ros_domain: int, start_process: Callable[..., Child], robot: Child, folder: Path, tmp_path: Path
) -> None:
    florence = (sys.executable, "-m", "florence_bt.cli")
    system = start_process(
        *florence, "up", "--missions-only", "--missions", folder, "--out", tmp_path / "out"
    )
    system.wait_for("in another terminal")
    for problem, valid in WHY.values():
        system.wait_for(problem)
        system.wait_for(valid)
    for words, code in (
        (("where",), 0),
        (("skills", "--live", "--missions", folder), 0),
        (("check", "--live", folder), 1),
    ):
        child = start_process(*florence, *words)
        assert child.process.wait(GENEROUS_S) == code, child.output
        for problem, valid in WHY.values():
            assert problem in child.output and valid in child.output, f"{words}: {child.output}"
    assert system.end() == 130
