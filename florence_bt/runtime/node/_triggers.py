"""Every way to start a mission: the service, a trigger per mission, the action, the topic of the document."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from florence_interfaces.action import ExecuteMission
from florence_interfaces.srv import RunMission
from std_msgs.msg import Bool
from std_srvs.srv import Trigger

from florence_bt.core.errors import FlorenceError
from florence_bt.ros.conversions import stamp_from_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.node._mission_action import (
    APPROACH_ME,
    FOLLOW_ME,
    MissionAction,
    PersonMission,
    execute_result,
)
from florence_bt.runtime.requests import check_in_time, request_from_texts, same_again
from florence_bt.runtime.run import MissionRun, RunStatus, TriggerPolicy
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.vocabulary import IDENTIFIER

SEARCH = "detect_user"
"""The mission that ``detect_user/cmd`` starts and stops. Source: REFERENCE 12.2; document, table 12."""


class Triggers:
    """Serves ``florence_bt/run_mission``, ``florence_bt/missions/*`` and actions whose goals are missions.

    The actions are ``florence_bt/execute_mission``, ``follow_me`` and ``approach_me``
    (:mod:`._mission_action`).
    ``detect_user/cmd`` starts the mission of that name with true and stops the run it started with false.

    Args:
        node: The node that serves them.
        missions: What runs the missions.
        runs_folder: Where the journal is: the id of an earlier run starts the same mission once more.
    """

    def __init__(self, node: FlorenceNode, missions: Executor, runs_folder: Path) -> None:
        self._node = node
        self._missions = missions
        self._runs_folder = runs_folder
        self._run_of_topic: str | None = None
        self._by_name: dict[str, Any] = {}
        self._served: MissionLibrary | None = None
        node.create_service(RunMission, "florence_bt/run_mission", self._on_run_mission)
        self._execute = MissionAction(
            node,
            missions,
            ExecuteMission,
            "florence_bt/execute_mission",
            self._execute_mission,
            execute_result,
        )
        self._with_person = [
            PersonMission(node, missions, action, self._start) for action in (FOLLOW_ME, APPROACH_ME)
        ]
        node.create_subscription(Bool, f"{SEARCH}/cmd", self._on_search_command, RELIABLE)
        self.sync()

    def sync(self) -> None:
        """Serve a trigger for every mission that needs no inputs, and none for those that are gone."""
        library = self._missions.library
        if library is self._served:
            return
        self._served = library
        wanted = [
            name
            for name in library.names()
            # The name of a file with errors may be no name for a service.
            if IDENTIFIER.fullmatch(name) and not library.get(name).required_inputs()
        ]
        for name in wanted:
            if name not in self._by_name:
                service = f"florence_bt/missions/{name}"
                self._by_name[name] = self._node.create_service(
                    Trigger, service, partial(self._on_trigger, name)
                )
        for name in tuple(self._by_name):
            if name not in wanted:
                self._node.retire(self._by_name.pop(name))

    def _sync_soon(self) -> None:
        """Sync when the present request is answered: its own service may be one that goes."""
        self._node.call_soon(self.sync)

    def publish_feedback(self, run: MissionRun, tip: str, tree: str) -> None:
        """Publish feedback for the client of the action, if this is its run."""
        if run.run_id == self._execute.run_id:
            self._execute.publish_feedback(ExecuteMission.Feedback(run_id=run.run_id, tip=tip, tree=tree))

    def on_end(self, run: MissionRun) -> None:
        """Send the result of a run that has ended, if it belongs to the client of an action."""
        self._execute.on_end(run)
        for action in self._with_person:
            action.on_end(run)

    def _on_run_mission(
        self, request: RunMission.Request, response: RunMission.Response
    ) -> RunMission.Response:
        try:
            check_in_time(stamp_from_ros(request.valid_until))
        except FlorenceError as error:
            response.message = str(error)
            return response
        answer = self._start_asked(request, "run_mission service")
        response.accepted, response.run_id, response.message = answer
        return response

    def _on_trigger(
        self, mission: str, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        response.success, run_id, message = self._start(mission, (), (), f"missions/{mission} service")
        response.message = f"{message} (run {run_id})" if response.success else message
        return response

    def _on_search_command(self, message: Bool) -> None:
        caller = f"{SEARCH}/cmd topic"
        if not message.data:
            if self._run_of_topic is not None:
                self._missions.stop(f"false on {SEARCH}/cmd", self._run_of_topic)
            return

        accepted, run_id, _ = self._start(SEARCH, (), (), caller)
        if accepted:
            self._run_of_topic = run_id

    def _execute_mission(self, goal: ExecuteMission.Goal) -> tuple[bool, str, str]:
        older = self._execute.run_id
        if older is not None and goal.policy == TriggerPolicy.QUEUE.value:
            queued = "to queue more use the service run_mission"
            return False, "", f"this action has one goal at a time, now {older}; {queued}"
        return self._start_asked(goal, "execute_mission action")

    def _start_asked(
        self, asked: RunMission.Request | ExecuteMission.Goal, caller: str
    ) -> tuple[bool, str, str]:
        names, values = asked.input_names, asked.input_values
        return self._start(asked.mission, names, values, asked.caller or caller, asked.policy, asked.priority)

    def _start(
        self,
        mission: str,
        names: Sequence[str],
        values: Sequence[str],
        caller: str,
        policy: str = "",
        priority: int = 0,
    ) -> tuple[bool, str, str]:
        """Trigger a mission: (accepted, run id, message). Nothing that a caller sends raises from here."""
        self._missions.reload()
        try:
            request = request_from_texts(
                mission, names, values, caller=caller, policy=policy, priority=priority
            )
            run = self._missions.accept(same_again(request, self._missions.library, self._runs_folder))
        except FlorenceError as error:
            self._sync_soon()
            self._node.get_logger().warning(
                f"{_short(mission)!r} asked by {_short(caller)!r} was refused: {error}"
            )
            return False, "", str(error)
        self._sync_soon()
        self._node.get_logger().info(f"{run.run_id} {run.status.value.lower()}, asked by {caller}")
        word = "starts" if run.status is RunStatus.RUNNING else "waits for its turn"
        note = f"; {run.note}" if run.note else ""
        return True, run.run_id, f"{mission} {word}{note}"


def _short(text: str) -> str:
    """Shorten what a stranger sent, for the log."""
    return text if len(text) <= 100 else f"{text[:100]}..."
