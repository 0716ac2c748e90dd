"""What changes the course of things: stop, pause, resume, reload, and the manual override of the document."""

from __future__ import annotations

from collections.abc import Callable

from florence_interfaces.srv import PauseMission, ReloadMissions, ResumeMission, StopMission
from std_msgs.msg import Bool

from florence_bt.core.errors import FlorenceError
from florence_bt.ros.deferred import Deferred, allow_deferred
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.requests import MAX_VALUE, checked_text
from florence_bt.runtime.run import RunStatus

OVERRIDE_TOPIC = "florenceLocator/manualOverride"
"""The document's name (REFERENCE 11.1, table 11)."""


class Controls:
    """Serves ``florence_bt/stop``, ``pause``, ``resume`` and ``reload_missions``, and obeys the override.

    Args:
        node: The node that serves them.
        missions: What runs the missions.
        reload: Reads the mission files again; tells later whether all went well, and a report for people.
        stop_base: Stops the robot at once, whoever drives it.
    """

    def __init__(
        self,
        node: FlorenceNode,
        missions: Executor,
        reload: Callable[[Callable[[bool, str], None]], None],
        stop_base: Callable[[], None],
    ) -> None:
        self._node = node
        self._missions = missions
        self._reload = reload
        self._stop_base = stop_base
        node.create_service(StopMission, "florence_bt/stop", self._on_stop)
        node.create_service(PauseMission, "florence_bt/pause", self._on_pause)
        node.create_service(ResumeMission, "florence_bt/resume", self._on_resume)
        allow_deferred(node.create_service(ReloadMissions, "florence_bt/reload_missions", self._on_reload))
        node.create_subscription(Bool, OVERRIDE_TOPIC, self._on_override, RELIABLE)

    def _on_stop(self, request: StopMission.Request, response: StopMission.Response) -> StopMission.Response:
        try:
            reason = checked_text("the reason", request.reason, MAX_VALUE)
            run_id = checked_text("the run's id", request.run_id)
        except FlorenceError as error:
            response.message = str(error)
            return response
        run = self._missions.stop(reason or "stop asked by service", run_id or None)
        response.success = run is not None
        if run is not None:
            response.message = f"{run.run_id} stops"
        elif run_id:
            response.message = f"no run {run_id!r} is running or queued"
        else:
            response.message = "no mission is running"
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
            run = self._missions.resume(_id(request.run_id))
        except FlorenceError as error:
            response.message = str(error)
            return response
        waits = " as soon as its skills have stopped" if run.status is RunStatus.PAUSED else ""
        response.success, response.message = True, f"{run.run_id} goes on{waits}"
        return response

    def _on_reload(self, request: ReloadMissions.Request, response: ReloadMissions.Response) -> Deferred:
        answer = Deferred()

        def reloaded(success: bool, report: str) -> None:
            response.success, response.report = success, report
            answer.answer(response)

        self._reload(reloaded)
        return answer

    def _on_override(self, message: Bool) -> None:
        """True: everything stops and nothing may start; false: missions may start again, nothing resumes."""
        if message.data:
            # Again at every message: somebody presses the button because the robot moves.
            # The robot first, the books after it.
            try:
                self._stop_base()
            finally:
                self._missions.override(f"true on {OVERRIDE_TOPIC}")
            self._node.get_logger().warning("manual override: everything stops, missions are refused")
        elif self._missions.release():
            self._node.get_logger().info("manual override released: missions may start again")


def _id(text: str) -> str | None:
    return checked_text("the run's id", text) or None
