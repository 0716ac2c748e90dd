"""Services that change the course of runs: stop, pause, resume, reload, and the manual override."""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import UTC, datetime

from florence_interfaces.msg import ManualOverride, Question
from florence_interfaces.srv import (
    AnswerQuestion,
    PauseMission,
    ReloadMissions,
    ResumeMission,
    SetBreakpoints,
    StopMission,
)
from std_msgs.msg import String
from std_srvs.srv import SetBool

from florence_bt.core.errors import FlorenceError
from florence_bt.core.message_skills import NOBODY_ASKS, AnswerWait, AskedQuestion
from florence_bt.core.topic_names import DOCK, OVERRIDE_BY, OVERRIDE_STATE, SWITCH_OVERRIDE
from florence_bt.ros.conversions import stamp_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.missions import ReloadReport
from florence_bt.runtime.node._robot_goals import RobotGoals
from florence_bt.runtime.requests import MAX_VALUE, check_in_time, checked_text
from florence_bt.runtime.run import MissionRun, RunStatus

OVERRIDE_BY_S = 5.0
"""Wall seconds within which the word of who switches the override belongs to its switch."""


class Controls:
    """Serves ``florence_bt/stop``, ``pause``, ``resume``, ``breakpoints`` and the like, obeys overrides.

    Args:
        node: The node that serves them.
        missions: What runs the missions.
        reload: Reads the mission files again.
        goals: The open goals that use the robot.
        answers: What waits for answers; None when no skill does.

    Attributes:
        last_override: The date at which the manual override was switched on last, None when it never was or
            nobody has said so yet.
    """

    def __init__(
        self,
        node: FlorenceNode,
        missions: Executor,
        reload: Callable[[], ReloadReport],
        goals: RobotGoals,
        answers: AnswerWait | None,
    ) -> None:
        self._node = node
        self._missions = missions
        self._reload = reload
        self._goals = goals
        node.create_service(StopMission, "florence_bt/stop", self._on_stop)
        node.create_service(PauseMission, "florence_bt/pause", self._on_pause)
        node.create_service(ResumeMission, "florence_bt/resume", self._on_resume)
        node.create_service(SetBreakpoints, "florence_bt/breakpoints", self._on_breakpoints)
        node.create_service(ResumeMission, "florence_bt/step", self._on_step)
        node.create_service(ReloadMissions, "florence_bt/reload_missions", self._on_reload)
        if answers is not None:
            self._answers = answers
            node.create_service(AnswerQuestion, "florence_bt/answer", self._on_answer)
            missions.add_listener(self._on_event)
        self._switched_by, self._switched_at = "", -math.inf
        self._overridden_by = ""
        node.create_subscription(String, OVERRIDE_BY, self._on_override_by, RELIABLE)
        self.last_override: datetime | None = None
        self._override: ManualOverride | None = None
        node.create_subscription(ManualOverride, OVERRIDE_STATE, self._on_override, LATCHED)
        self._dock = node.create_client(SetBool, DOCK)

    def _on_stop(self, request: StopMission.Request, response: StopMission.Response) -> StopMission.Response:
        try:
            reason = checked_text("the reason", request.reason, MAX_VALUE)
            run_id = checked_text("the run's id", request.run_id)
        except FlorenceError as error:
            response.message = str(error)
            return response
        run = self._missions.stop(reason or "stop asked by service", run_id or None)
        goals = [] if run_id else self._goals.cancel_unowned()
        if not run_id and self._dock.service_is_ready():
            self._dock.call_async(SetBool.Request(data=False))  # of no effect on a base that does not dock
        if run is not None:
            text = f"{run.run_id} stops"
        else:
            text = f"no run {run_id!r} is running or queued" if run_id else "no mission is running"
        if goals:
            text += f"; cancelled, owned by no mission: {', '.join(map(str, goals))}"
        response.success, response.message = run is not None or bool(goals), text
        return response

    def _on_pause(
        self, request: PauseMission.Request, response: PauseMission.Response
    ) -> PauseMission.Response:
        try:
            reason = checked_text("the reason", request.reason, MAX_VALUE) or "asked by service"
            run = self._missions.pause(reason, _id(request.run_id))
        except FlorenceError as error:
            response.message = str(error)
            return response
        already = f" already, because: {run.paused}" if run.paused != reason else ""
        response.success, response.message = True, f"{run.run_id} is paused{already}"
        return response

    def _on_resume(
        self, request: ResumeMission.Request, response: ResumeMission.Response
    ) -> ResumeMission.Response:
        try:
            check_in_time(stamp_from_ros(request.valid_until))
            run = self._missions.resume(_id(request.run_id))
        except FlorenceError as error:
            response.message = str(error)
            return response
        waits = " as soon as its skills have stopped" if run.status is RunStatus.PAUSED else ""
        response.success, response.message = True, f"{run.run_id} goes on{waits}"
        return response

    def _on_breakpoints(
        self, request: SetBreakpoints.Request, response: SetBreakpoints.Response
    ) -> SetBreakpoints.Response:
        try:
            added, removed = (
                [checked_text("the name of a node", name) for name in names]
                for names in (request.add, request.remove)
            )
            if request.clear or removed:
                self._missions.clear(() if request.clear else removed)
            if added:
                self._missions.break_before(added)
            response.success = True
        except FlorenceError as error:
            response.message = str(error)
        response.breakpoints = list(self._missions.breakpoints)
        return response

    def _on_step(
        self, request: ResumeMission.Request, response: ResumeMission.Response
    ) -> ResumeMission.Response:
        try:
            check_in_time(stamp_from_ros(request.valid_until))
            run = self._missions.step(_id(request.run_id))
        except FlorenceError as error:
            response.message = str(error)
            return response
        response.success, response.message = True, f"{run.run_id} goes on to its next leaf"
        return response

    def _on_reload(
        self, request: ReloadMissions.Request, response: ReloadMissions.Response
    ) -> ReloadMissions.Response:
        report = self._reload()
        response.success, response.report = report.ok, report.text()
        return response

    def _on_answer(
        self, request: AnswerQuestion.Request, response: AnswerQuestion.Response
    ) -> AnswerQuestion.Response:
        try:
            text = checked_text("the answer", request.text)
            question = checked_text("the question's id", request.question)
        except FlorenceError as error:
            response.message = str(error)
            return response
        if text:
            taken = self._answers.offer(String(data=text), question)
            response.accepted, response.message = taken.accepted, taken.text
        else:
            told = [_told(each) for each in self._answers.questions]
            response.accepted, response.message = bool(told), "\n".join(told) or NOBODY_ASKS
        response.questions = [
            Question(id=each.id, text=each.text, choices=each.choices) for each in self._answers.questions
        ]
        return response

    def _on_event(self, run: MissionRun, event: RunEvent) -> None:
        if event.kind in (EventKind.STARTED, EventKind.ENDED):
            self._answers.forget()

    def _on_override(self, message: ManualOverride) -> None:
        """Obey the override. On: all runs and goals end, nothing starts. Off: missions may, none resumes.

        The base itself obeys without us: its driver says what is so.
        """
        before, self._override = self._override, message
        self._note_date(message, known=before is not None)
        if before is not None and (message.on, message.stops) == (before.on, before.stops):
            return  # the driver says it again and again
        by = self._take_switched_by()
        if message.on:
            by = self._overridden_by = by or self._overridden_by
            self._missions.override(f"true on {SWITCH_OVERRIDE}{by}")
            self._goals.cancel_all()
            self._node.get_logger().warning(f"manual override{by}: everything stops, missions are refused")
            return
        self._overridden_by = ""
        if self._missions.release():
            self._node.get_logger().info(f"manual override released{by}: missions may start again")

    def _note_date(self, message: ManualOverride, *, known: bool) -> None:
        """End everything, too, when the override was on and released while we hung: only its date tells."""
        seconds = stamp_from_ros(message.switched_on)
        date = datetime.fromtimestamp(seconds, UTC) if seconds > 0.0 else None
        news, self.last_override = known and date != self.last_override, date
        if news:
            self._missions.give_up_robot("it was switched on")
            self._goals.cancel_all()

    def _take_switched_by(self) -> str:
        """Return who has just switched the override, for people, once; empty when nobody said so."""
        recent = self._node.steady.now() - self._switched_at < OVERRIDE_BY_S
        by = f", by {self._switched_by}" if recent and self._switched_by else ""
        self._switched_by = ""
        return by

    def _on_override_by(self, message: String) -> None:
        try:
            self._switched_by = checked_text("who switches the manual override", message.data)
        except FlorenceError as error:
            self._node.get_logger().warning(str(error))
            return
        self._switched_at = self._node.steady.now()

    def missing_override(self) -> list[str]:
        """Return what is not known of the override yet, for people; empty if no driver ever tells."""
        topic = self._node.resolve_topic_name(OVERRIDE_STATE)
        told = self._override is not None or not self._node.count_publishers(topic)
        return [] if told else ["the word of the base's driver about the manual override"]


def _told(question: AskedQuestion) -> str:
    """Say what is open, with a line for each answer that the mission names."""
    return "\n  ".join([f"open: {question}", *question.choices])


def _id(text: str) -> str | None:
    return checked_text("the run's id", text) or None
