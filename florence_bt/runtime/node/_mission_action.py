"""Actions whose goals are runs of missions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from florence_interfaces.action import ApproachMe, ExecuteMission, FollowMe, FollowUser

from florence_bt.core.outcome import Outcome
from florence_bt.ros.action_server import PREEMPTED, SingleGoalServer
from florence_bt.ros.node import FlorenceNode, with_reason
from florence_bt.ros.qos import RELIABLE
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRun, RunStatus, TriggerPolicy

_OUTCOMES = {RunStatus.SUCCEEDED: Outcome.SUCCEEDED, RunStatus.STOPPED: Outcome.CANCELLED}


class MissionAction:
    """Serves an action: each goal starts a mission, and its result is that of the run.

    Attributes:
        run_id: The run of the goal that is worked on, None without one.

    Args:
        node: The node that serves it.
        missions: What runs the missions.
        action_type: The action.
        name: Its name.
        start: Given the goal, starts a mission: (accepted, run id, why not).
        result: The result message for a run; for None, of a goal that a newer one replaced before it began.
    """

    def __init__(
        self,
        node: FlorenceNode,
        missions: Executor,
        action_type: Any,
        name: str,
        start: Callable[[Any], tuple[bool, str, str]],
        result: Callable[[MissionRun | None, str], Any],
    ) -> None:
        self._missions = missions
        self._start = start
        self._result = result
        self._replaced: MissionRun | None = None
        self.run_id: str | None = None
        self._server = SingleGoalServer(
            node,
            action_type,
            name,
            on_goal=self._on_goal,
            on_cancel=self._on_cancel,
            on_replaced=lambda: result(
                self._replaced, f"replaced by {self.run_id}, a newer goal of the action"
            ),
        )

    def publish_feedback(self, message: Any) -> None:
        """Send feedback to the client of the goal that is worked on."""
        self._server.publish_feedback(message)

    def on_end(self, run: MissionRun) -> None:
        """Send its client the result if the run that has ended is the goal's."""
        if run.run_id != self.run_id:
            return
        self.run_id = None
        self._server.finish(self._result(run, ""), _OUTCOMES.get(run.status, Outcome.FAILED))

    def _on_goal(self, goal: Any) -> str | None:
        older = self.run_id
        accepted, run_id, message = self._start(goal)
        if not accepted:
            return message
        self.run_id = run_id
        self._replaced = self._missions.find(older) if older is not None else None
        if older is not None:
            # It may still wait in the queue; its client gets the result that it was replaced.
            self._missions.stop(f"replaced by {run_id}, a newer goal of the action", older)
        return None

    def _on_cancel(self) -> None:
        if self.run_id is not None:
            self._missions.stop("cancelled by the action client", self.run_id)


def execute_result(run: MissionRun | None, replaced: str) -> ExecuteMission.Result:
    """Make the result of ``execute_mission``.

    Args:
        run: The run; None when it is not known any more.
        replaced: Why it did not go on to its end, when it has none yet.
    """
    if run is None:
        return ExecuteMission.Result(reason=PREEMPTED)
    result = ExecuteMission.Result(
        run_id=run.run_id,
        state=run.status.value,
        code=run.code,
        reason=run.reason,
        cause=run.why.path if run.why else "",
        tree=run.tree,
        output_names=list(run.output_texts),
        output_values=list(run.output_texts.values()),
    )
    if replaced and run.why is None:
        result.state, result.code, result.reason = RunStatus.STOPPED.value, "stopped", replaced
        result.cause = run.mission
    return result


@dataclass(frozen=True, slots=True)
class PersonAction:
    """An action of the document that has to do with a person: a mission of the same name does it.

    Attributes:
        name: Of the action and of the mission.
        type: The action. Feedback and result say where the person is: x and y, robot frame, metres.
        units: The fields of the goal, which are the inputs of the mission, and their units.
        skills: The names of the skills' actions, whose feedback says where the person is.
        skill_type: Their type.
    """

    name: str
    type: Any
    units: Mapping[str, str]
    skills: tuple[str, ...]
    skill_type: Any

    def input_texts(self, goal: Any) -> list[str]:
        """Return the inputs of the mission, in the order of ``units``."""
        return [f"{getattr(goal, name)!r} {unit}".strip() for name, unit in self.units.items()]


FOLLOW_ME = PersonAction(
    "follow_me",
    FollowMe,
    {
        "x": "m",
        "y": "m",
        "max_lin_speed": "m/s",
        "max_ang_speed": "",
        "desired_follow_distance": "m",
    },
    ("follow_user", "search_for_user"),
    FollowUser,
)
"""Source: REFERENCE 12.6; document, table 54."""
APPROACH_ME = PersonAction(
    "approach_me",
    ApproachMe,
    {
        "x": "m",
        "y": "m",
        "desired_distance": "m",
        "desired_p2r_orientation": "rad",
        "desired_r2p_orientation": "rad",
        "max_lin_speed": "m/s",
        "max_ang_speed": "",
    },
    ("approach_person",),
    ApproachMe,
)
"""Source: REFERENCE 12.7; document, table 66."""


class PersonMission:
    """Serves an action of the document by its mission, and says where the person is.

    Args:
        node: The node that serves it.
        missions: What runs the missions.
        action: Which one.
        start: Triggers a mission given its name, its inputs' names and texts, the caller and the policy:
            (accepted, run id, why not).
    """

    def __init__(
        self,
        node: FlorenceNode,
        missions: Executor,
        action: PersonAction,
        start: Callable[[str, Sequence[str], Sequence[str], str, str], tuple[bool, str, str]],
    ) -> None:
        self._action = action
        self._trigger = start
        self._person = self._older = 0.0, 0.0
        self._goals = MissionAction(node, missions, action.type, action.name, self._start, self._result)
        for skill in action.skills:
            topic = f"{node.resolve_action_name(skill)}/_action/feedback"
            message_type = action.skill_type.Impl.FeedbackMessage
            node.create_subscription(message_type, topic, self._on_feedback, RELIABLE)

    def on_end(self, run: MissionRun) -> None:
        """Send its client the result if the run that has ended is the goal's."""
        self._goals.on_end(run)

    def _start(self, goal: Any) -> tuple[bool, str, str]:
        """Start the mission. It replaces that of an older goal, nothing else."""
        action = self._action
        policy = TriggerPolicy.REJECT if self._goals.run_id is None else TriggerPolicy.PREEMPT
        answer = self._trigger(
            action.name, list(action.units), action.input_texts(goal), f"{action.name} action", policy.value
        )
        if answer[0]:
            self._older, self._person = self._person, (goal.x, goal.y)
        return answer

    def _on_feedback(self, message: Any) -> None:
        self._person = x, y = message.feedback.x, message.feedback.y
        self._goals.publish_feedback(self._action.type.Feedback(x=x, y=y))

    def _result(self, run: MissionRun | None, replaced: str) -> Any:
        """Return where the person was last, and why it ended."""
        x, y = self._older if replaced else self._person
        result = self._action.type.Result(x=x, y=y, code=run.code if run is not None else "")
        return with_reason(
            result, run.reason if run is not None and run.why is not None else replaced or PREEMPTED
        )
