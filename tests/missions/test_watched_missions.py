"""Conditions that are watched, as scenarios and pytest play them and as the executor runs them."""

import pytest

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.mission_testing.mission_tester import MissionTester

GUARDED = """mission: guarded
tree:
  sequence:
    - robot_in_room: {room: kitchen}
    - navigate_to: {goal: {x: 1 m, y: 2 m, yaw: 0}}
  memory: false
"""
LONG_DRIVE = "running 100 s, then SUCCESS"


def test_a_mock_changes_its_answer_at_a_moment(robot):
    robot.mock("navigate_to", LONG_DRIVE)
    robot.mock("robot_in_room", 'SUCCESS for 10.5 s, then FAILURE elsewhere "it is in the hall"')
    play = (
        robot.run(robot.load(GUARDED))
        .assert_failed("elsewhere", reason="in the hall")
        .assert_duration("11 s")
    )
    play.assert_called("robot_in_room", times=12).assert_called("navigate_to", times=1)


def test_a_pause_asks_nothing_and_the_resume_asks_at_once(robot):
    robot.mock("navigate_to", LONG_DRIVE)
    robot.mock("robot_in_room", "SUCCESS 4 times, then FAILURE elsewhere")
    play = robot.start(robot.load(GUARDED))
    robot.advance("2.5 s")
    robot.pause("a child")
    robot.advance("1 h")
    assert len(play.calls("robot_in_room")) == 3
    robot.resume()
    robot.advance("0.9 s")
    assert len(play.calls("robot_in_room")) == 4 and play.status == "RUNNING"
    robot.advance("0.2 s")
    play.assert_failed("elsewhere")
    assert robot.clock.next_time() is None


@pytest.mark.parametrize("mission", ["goto_room", "goto_user", "detect_user", "approach_user"])
def test_an_ordinary_mission_has_no_timer_of_a_condition(robot, mission, monkeypatch):
    asked = []
    monkeypatch.setattr("florence_bt.behaviours.watched_skill.WatchedSkill.ask_again", asked.append)
    inputs = {"goto_room": {"room": "kitchen"}, "approach_user": {"user": "(3 m, 2 m, 0 deg)"}}
    robot.run(mission, **inputs.get(mission, {}))
    assert not asked and robot.clock.next_time() is None


def test_a_mocked_skill_that_reports_changes_is_asked_when_its_script_goes_on(tmp_path):
    charged = SkillDeclaration("charged", "Ask", failures={"low": "no"}, instant=True, reports_changes=True)
    work = SkillDeclaration("work", "Work", deadline_s=1000.0)
    stage = MissionTester(declarations={"charged": charged, "work": work}, scratch=tmp_path)
    stage.mock("charged", "SUCCESS for 10.5 s, then FAILURE low")
    stage.mock("work", LONG_DRIVE)
    play = stage.run(stage.load("mission: m\ntree: {sequence: [charged: , work: ], memory: false}\n"))
    play.assert_failed("low").assert_duration("10.5 s").assert_called("charged", times=2)
