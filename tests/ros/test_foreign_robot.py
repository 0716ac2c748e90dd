"""Missions drive a robot that is not ours: plain servers in a process of their own, skills from YAML only."""

from __future__ import annotations

import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("nav2_msgs")

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.runtime.node import MissionNode
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import mappings_in
from tests.ros.conftest import GENEROUS_S, Child, MissionBench, RosBench

pytestmark = pytest.mark.ros

QUIZ = """\
mission: quiz
inputs: {speed: {type: speed, default: 0.3 m/s}}
outputs: {answer: {type: text}}
tree:
  sequence:
    - say: {text: Is it $speed?}
    - wait_for_answer: {time_limit: 2 min}
      out: {answer: answer}
"""
EXAMPLE = Path(__file__).parents[2] / "examples" / "foreign_robot"


class ForeignBench(MissionBench):
    """A mission server that knows the robot by the example's file only."""

    def __init__(self, ros: RosBench, runs: Path) -> None:
        from florence_bt.ros.node import FlorenceNode

        mappings = mappings_in([EXAMPLE / "missions"])
        self.ros, self._clients = ros, {}
        self.skills: dict[str, Any] = {}

        def skills(node: FlorenceNode) -> dict[str, Any]:
            self.skills = make_skills(node, mappings=mappings)
            return self.skills

        self.server = ros.add(
            MissionNode(
                skills,
                {
                    **{name: mapping.declaration for name, mapping in mappings.items()},
                    **own_declarations(),
                },
                parameters={"runs_folder": str(runs), "mission_folders": (str(EXAMPLE / "missions"),)},
            )
        )
        self.node = ros.add(FlorenceNode("client"))

    def hears_the_battery(self) -> bool:
        return self.skills["charged"].start({"least": 0.0}).poll().succeeded


@pytest.fixture
def start(ros: RosBench, start_process: Callable[..., Child], tmp_path: Path) -> Callable[..., Any]:
    def start(*options: str) -> tuple[Child, ForeignBench]:
        robot = start_process(sys.executable, EXAMPLE / "robot.py", *options)
        bench = ForeignBench(ros, tmp_path / "runs")
        ros.spin_until(bench.hears_the_battery, what="the robot")
        return robot, bench

    return start


def test_a_mission_uses_an_action_a_service_a_topic_and_a_condition(start: Callable[..., Any]) -> None:
    _, bench = start()
    assert bench.run("fetch_thing").accepted
    status = bench.wait("SUCCEEDED")
    assert "[+] drive robot" in status.tree
    assert bench.run("open_hand").accepted
    status = bench.wait("FAILED")
    assert (status.code, status.reason) == ("hand_failed", "tb4/gripper: the hand is open already")


def test_codes_of_the_server_decide_what_comes_next(start: Callable[..., Any]) -> None:
    _, bench = start()
    assert bench.run("try_places").accepted
    tree = bench.wait("SUCCEEDED").tree
    assert "no way to x = 100" in tree and "no way to x = 101" in tree


def test_an_empty_battery_stops_it(start: Callable[..., Any]) -> None:
    _, bench = start("--battery", "0.1")
    assert bench.run("fetch_thing").accepted
    status = bench.wait("FAILED")
    assert (status.code, status.reason) == ("battery_low", "tb4/battery: the battery holds no more than that")


def test_no_goal_is_left_when_the_run_is_stopped_and_a_dead_server_is_told(start: Callable[..., Any]) -> None:
    robot, bench = start()
    assert bench.run("fetch_thing").accepted
    bench.ros.spin_until(lambda: "m to go" in bench.status().tree, what="the drive")
    bench.stop()
    assert bench.wait("STOPPED").unowned_goals == []
    assert bench.run("fetch_thing").accepted
    bench.ros.spin_until(lambda: "m to go" in bench.status().tree, what="the drive")
    robot.process.send_signal(signal.SIGKILL)
    assert bench.wait("FAILED").code == "server_lost"


def test_the_running_robot_tells_types_and_who_is_there(
    ros_domain: int, start_process: Callable[..., Child]
) -> None:
    from florence_bt.app.mission_files.live_skills import servers_now, type_in_graph
    from florence_bt.core.errors import ConfigError
    from florence_bt.trees.language.loader import MissionLibrary

    start_process(sys.executable, EXAMPLE / "robot.py").wait_for("the robot is there")
    assert type_in_graph("action", "tb4/drive_to") == ("nav2_msgs/action/NavigateToPose", False)
    assert type_in_graph("service", "/tb4/gripper")[0] == "std_srvs/srv/SetBool"
    assert type_in_graph("condition", "tb4/battery")[0] == "sensor_msgs/msg/BatteryState"
    with pytest.raises(ConfigError, match="/tb4/drive_two"):
        type_in_graph("action", "tb4/drive_two")
    now = servers_now(MissionLibrary.load([EXAMPLE / "missions"]))
    assert now["drive_robot"].startswith("there:") and "turn" not in now


def test_a_topic_of_another_type_is_told_by_those_who_look(
    ros_domain: int, start_process: Callable[..., Child], tmp_path: Path
) -> None:
    from florence_bt.app.mission_files.live_skills import servers_now
    from florence_bt.trees.language.loader import MissionLibrary

    start_process(sys.executable, EXAMPLE / "robot.py").wait_for("the robot is there")
    (tmp_path / "mine.skills.yaml").write_text(
        "skills:\n  lit: {like: is_true, condition: tb4/battery}\n"
        "  grip: {like: call_set_bool, service: tb4/gripper}\n",
        encoding="utf-8",
    )
    now = servers_now(MissionLibrary.load([tmp_path]))
    assert now["lit"].startswith("WRONG TYPE") and "sensor_msgs/msg/BatteryState" in now["lit"]
    assert list(now)[:2] == ["grip", "lit"] and now["grip"].startswith("there"), "one's own skills come first"
    assert "dock_robot" not in now, "nobody asked for it, and nobody serves it"


def test_two_types_on_one_topic_take_away_only_one_skill(ros: RosBench, tmp_path: Path) -> None:
    from florence_bt.ros.node import FlorenceNode

    condition = (
        "  {0}:\n    condition: fill\n    type: std_msgs/msg/{1}\n    failures: {{full: {{when: {2}}}}}\n"
    )
    file = tmp_path / "mine.skills.yaml"
    file.write_text(
        "skills:\n"
        + condition.format("one", "Float32", "$data > 1")
        + condition.format("other", "String", "$data == 'x'")
        + "  grip:\n    service: grip\n    type: std_srvs/srv/Trigger\n",
        encoding="utf-8",
    )
    skills = make_skills(ros.add(FlorenceNode("missions")), mappings=mappings_in([tmp_path]))
    codes = [skills[name].start({}).poll().code for name in ("one", "other")]
    assert sorted(codes) == ["no_skill", "server_lost"] and hasattr(skills["grip"], "server_is_there")


@pytest.mark.slow
def test_only_the_mission_server_beside_a_robot_that_runs(
    ros_domain: int, start_process: Callable[..., Child], tmp_path: Path
) -> None:
    florence = (sys.executable, "-m", "florence_bt.cli")
    missions = tmp_path / "missions"
    shutil.copytree(EXAMPLE / "missions", missions)
    (missions / "quiz.yaml").write_text(QUIZ)
    folders = ("--missions", missions, "--out", tmp_path / "out")
    system = start_process(*florence, "up", "--missions-only", *folders)
    told = system.wait_for("  grip: service /tb4/gripper (std_srvs/srv/SetBool)")
    assert "nobody serves" in told and "navigate_to" not in told
    robot = start_process(sys.executable, EXAMPLE / "robot.py")
    system.wait_for("every server that missions need is there")
    run = start_process(*florence, "run", "try_places", "--headless")
    assert run.process.wait(GENEROUS_S) == 0, run.output
    check = start_process(*florence, "check", "--live", EXAMPLE / "missions")
    assert check.process.wait(GENEROUS_S) == 0, check.output
    needs_ours = start_process(*florence, "run", "goto_pose", "x=1 m", "y=1 m", "--headless")
    assert needs_ours.process.wait(GENEROUS_S) == 1 and "server_lost" in needs_ours.output, needs_ours.output

    quiz = start_process(*florence, "run", "quiz", "--headless")
    quiz.wait_for("the robot says: Is it 0.3 m/s?")
    while (asked := start_process(*florence, "answer")).process.wait(GENEROUS_S):
        assert "no mission waits for an answer" in asked.output, "the robot still speaks"
    answer = start_process(*florence, "answer", "yes", "it", "is")
    assert answer.process.wait(GENEROUS_S) == 0 and "Is it 0.3 m/s?" in answer.output, answer.output
    assert quiz.process.wait(GENEROUS_S) == 0 and "yes it is" in quiz.output, quiz.output
    nobody = start_process(*florence, "answer")
    assert nobody.process.wait(GENEROUS_S) == 1, nobody.output
    assert "the robot says: Is it 0.3 m/s?" in system.output
    runs = start_process(*florence, "runs")
    assert runs.process.wait(GENEROUS_S) == 0 and "-quiz" in runs.output, runs.output

    with (missions / "robot.skills.yaml").open("a") as file:
        file.write("\n# edited\n")
    reload = start_process(*florence, "reload")
    assert reload.process.wait(GENEROUS_S) == 1 and "robot.skills.yaml: " in reload.output, reload.output
    told = system.output
    robot.end(signal.SIGKILL)
    # Far less than the 20 s after which discovery misses it.
    lost = start_process(*florence, "run", "open_hand", "--headless")
    assert lost.process.wait(GENEROUS_S) == 1 and "server_lost" in lost.output, lost.output
    system.wait_for("  grip: service /tb4/gripper (std_srvs/srv/SetBool)", begin=len(told))
    assert system.end() == 130
