"""The skills of the rig: the pure components behind the contract that behaviours know (core.skill)."""

from __future__ import annotations

from collections.abc import Callable

from florence_bt.core.outcome import Result, cancelled
from florence_bt.core.skill import Event, Inputs, InstantSkill, RunState, Skill, SkillRun
from florence_bt.skills.locator import declaration as locate
from florence_bt.skills.locator.locator import Locator
from florence_bt.skills.people.approach_user.declaration import PROPOSE_APPROACH_POSE
from florence_bt.skills.people.approach_user.polite_pose import propose_approach


class ComponentRun:
    """A run of a component in this process: accepted at once, ended by :meth:`finish`.

    Args:
        feedback: What the component does.
        on_cancel: Tells the component to stop; it then finishes the run.
    """

    def __init__(self, feedback: str, on_cancel: Callable[[], None]) -> None:
        self._state = RunState(feedback)
        self._on_cancel = on_cancel
        self._state.handle(Event.ACCEPTED)

    @property
    def feedback(self) -> str:
        """What the component does."""
        return self._state.feedback

    def poll(self) -> Result | None:
        """The result, or None."""
        return self._state.result

    def cancel(self) -> None:
        """Tell the component to stop."""
        if self._state.handle(Event.CANCEL):
            self._on_cancel()

    def on_change(self, callback: Callable[[], None]) -> None:
        """Remember whom to wake."""
        self._state.on_change(callback)

    def finish(self, result: Result) -> None:
        """End the run; later results are dropped."""
        self._state.handle(Event.FINISHED, result)


class ExclusiveComponent:
    """A component that serves one run at a time; a newer run ends the older one, as a Nav2 server would."""

    def __init__(self) -> None:
        self._run: ComponentRun | None = None

    def begin(self, feedback: str, on_cancel: Callable[[], None]) -> ComponentRun:
        """Make the run that is served from now on."""
        self.finish(cancelled("preempted by a newer goal"))
        self._run = ComponentRun(feedback, on_cancel)
        return self._run

    def finish(self, result: Result) -> None:
        """End the run that is served, if there is one."""
        run, self._run = self._run, None
        if run is not None:
            run.finish(result)


class StartingSkill:
    """A skill whose start is a plain function."""

    def __init__(self, start: Callable[[Inputs], SkillRun]) -> None:
        self._start = start

    def start(self, inputs: Inputs) -> SkillRun:
        """Call the function."""
        return self._start(inputs)


def locator_skills(locator: Locator) -> dict[str, Skill]:
    """The skills of the locator by name."""

    def user_room(inputs: Inputs) -> Result:
        return locator.get_user_room()

    def hotspot(inputs: Inputs) -> Result:
        return locator.get_hotspot(inputs["label"])

    def robot_in_room(inputs: Inputs) -> Result:
        return locator.robot_in_room(inputs["room"])

    def robot_pose(inputs: Inputs) -> Result:
        return locator.get_robot_pose()

    def set_user(inputs: Inputs) -> Result:
        return locator.set_user_position(inputs["user"])

    return {
        locate.GET_USER_ROOM.name: InstantSkill(user_room),
        locate.GET_HOTSPOT.name: InstantSkill(hotspot),
        locate.ROBOT_IN_ROOM.name: InstantSkill(robot_in_room),
        locate.GET_ROBOT_POSE.name: InstantSkill(robot_pose),
        locate.SET_USER_POSITION.name: InstantSkill(set_user),
    }


def approach_skills(cost_at: Callable[[float, float], int]) -> dict[str, Skill]:
    """The skill that proposes polite poses.

    Args:
        cost_at: Occupancy 0..100 of a point of the global costmap, -1 where unknown.
    """

    def proposal(inputs: Inputs) -> Result:
        return propose_approach(
            inputs["user"], inputs["robot"], inputs["trial"], inputs["safe_distance"], cost_at
        )

    return {PROPOSE_APPROACH_POSE.name: InstantSkill(proposal)}
