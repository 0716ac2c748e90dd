"""Whole missions on scripted skills and a manual clock."""

import math

import pytest
from py_trees.common import Status

from florence_bt.behaviours.why import explain
from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import failure, success
from florence_bt.testing.mocks import ScriptedSkill, Step
from florence_bt.testing.ticking import drain, make_context, tick_until
from florence_bt.trees.compile import compile_mission
from florence_bt.trees.declarations import collect_declarations
from florence_bt.trees.inputs import parse_inputs
from florence_bt.trees.loader import MissionLibrary

USER = Pose2(3.0, 2.0, math.pi)
ROBOT = Pose2(1.0, 2.0, 0.0)
HOTSPOT = Pose2(4.0, 5.0, 0.5)
PROPOSALS = (Pose2(2.5, 2.0, 0.0), Pose2(2.6, 2.4, -0.8), Pose2(2.6, 1.6, 0.8))
NOBODY = Step(failure("no_user_seen", "nobody was in front of the camera"), after=5.0)
FOUND = Step(success(user=USER, distance=2.0, user_id=7), after=1.0)


def default_scripts():
    """Everything succeeds; the robot is elsewhere, the user is seen at the first look."""
    return {
        "get_user_room": [Step(success(room="kitchen"))],
        "robot_in_room": [Step(failure("elsewhere", "the robot is in the hall"))],
        "get_hotspot": [Step(success(pose=HOTSPOT))],
        "navigate_to": [Step(success(), after=10.0, accept_after=0.1, cancel_takes=0.5)],
        "turn": [Step(success(), after=2.0, accept_after=0.1, cancel_takes=0.2)],
        "start_tracker": [Step(success(), after=0.1, accept_after=0.05)],
        "stop_tracker": [Step(success(), after=0.1, accept_after=0.05)],
        "look_for_user": [FOUND],
        "set_user_position": [Step()],
        "get_robot_pose": [Step(success(pose=ROBOT))],
        "propose_approach_pose": [Step(success(pose=pose), after=0.05) for pose in PROPOSALS],
    }


class Stage:
    """One mission with its skills, clock and context."""

    def __init__(self, mission, inputs=None, **scripts):
        self.clock = ManualClock()
        self.declarations = collect_declarations()
        self.started = []
        self.skills = {
            name: ScriptedSkill(self.declarations[name], self.clock, steps)
            for name, steps in {**default_scripts(), **scripts}.items()
        }
        self.context = make_context(
            self.clock,
            self.skills,
            self.declarations,
            on_skill_started=lambda path, skill, _: skill in self.skills and self.started.append(skill),
        )
        library = MissionLibrary.load()
        loaded = library.get(mission)
        self.tree = compile_mission(loaded, library, parse_inputs(loaded, inputs or {}), self.context)
        self.root = self.tree.root

    def run(self, done=None):
        """Run to the end; the status, and nothing may be left running."""
        tick_until(self.root, self.clock, self.context, done)
        if done is None:
            assert self.root.status is not Status.RUNNING
            drain(self.clock, self.context)
            self.assert_quiet()
        return self.root.status

    def stop_at(self, seconds):
        """Run to a moment, stop the tree, and let what was cancelled end."""
        mark = self.clock.call_at(seconds, lambda: None)
        tick_until(self.root, self.clock, self.context, lambda: self.clock.now() >= seconds)
        mark.cancel()
        self.root.stop(Status.INVALID)
        drain(self.clock, self.context)
        self.assert_quiet()

    def assert_quiet(self):
        assert {name: skill.active for name, skill in self.skills.items() if skill.active} == {}
        assert self.context.runs == []
        assert self.clock.next_time() is None, "a timer was left behind"

    def why(self):
        return explain(self.root)

    def calls(self, skill):
        return self.skills[skill].calls

    @property
    def tracker_is_on(self):
        """Whether the last word to the tracker was start."""
        words = [skill for skill in self.started if skill in ("start_tracker", "stop_tracker")]
        return bool(words) and words[-1] == "start_tracker"


@pytest.fixture
def stage():
    return Stage
