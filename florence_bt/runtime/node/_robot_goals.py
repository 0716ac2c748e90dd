"""The open goals that use the robot, also those that no mission sent: of ``goal_pose``, of other programs, of
a process that was killed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.skill import Skill
from florence_bt.ros.action_skill import ActionSkill
from florence_bt.ros.open_goals import OpenGoal, OpenGoals


def exclusive_actions(
    skills: Mapping[str, Skill], declarations: Mapping[str, SkillDeclaration]
) -> list[ActionSkill]:
    """Return the skills whose goals occupy a part of the robot (e.g. its base), of all packages."""
    return [
        skill
        for name, skill in skills.items()
        if isinstance(skill, ActionSkill) and name in declarations and declarations[name].resources
    ]


class RobotGoals:
    """The open goals of the actions that use the robot.

    Args:
        goals: The open goals of these actions.
        skills: The skills that send goals to them for missions.
    """

    def __init__(self, goals: OpenGoals, skills: Iterable[ActionSkill]) -> None:
        self._goals = goals
        self._skills = tuple(skills)

    def unowned(self) -> list[OpenGoal]:
        """Return those that belong to no run of a mission."""
        owned = {goal_id for skill in self._skills for goal_id in skill.goal_ids()}
        return [goal for goal in self._goals.open() if goal.goal_id not in owned]

    def cancel_unowned(self) -> list[OpenGoal]:
        """Ask for the end of each that belongs to no run; gives them."""
        found = self.unowned()
        for goal in found:
            self._goals.cancel(goal)
        return found

    def cancel_all(self) -> None:
        """Ask for the end of every goal, also of one that is not known of yet."""
        for action in self._goals.actions:
            if self._goals.server_is_there(action):
                self._goals.cancel_all(action)
