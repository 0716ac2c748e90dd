"""The mission server on ROS: triggers in; status, tree and run state out. Thin: convert, call the executor.

Names live under ``florence_bt/`` (ARCHITECTURE.md, ROS surface).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

from florence_interfaces.action import ExecuteMission
from florence_interfaces.msg import RunState
from florence_interfaces.srv import CheckMission, ListMissions, MissionStatus, RunMission, StopMission
from std_msgs.msg import String
from std_srvs.srv import Trigger

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome
from florence_bt.core.skill import Skill
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.ros.action_server import SingleGoalServer
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED
from florence_bt.ros.tf import TransformListener
from florence_bt.runtime.events import Event, EventKind
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.recorder import RunRecord, RunRecorder, read_record
from florence_bt.runtime.run import MissionRun, Policy, Request, RunIds, RunStatus
from florence_bt.runtime.status import RUN_STATES, status_text
from florence_bt.trees.findings import ERROR, has_errors
from florence_bt.trees.kinds import IDENTIFIER
from florence_bt.trees.lint import check
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.report import report_text


@dataclass(frozen=True, slots=True)
class MissionNodeParameters:
    """Parameters of the mission server.

    Attributes:
        runs_folder: Where the folders of the runs go.
        mission_folders: Folders of missions beside the built-in ones; later ones shadow earlier ones.
        base_frame: The robot's frame whose path is recorded.
    """

    runs_folder: str = "runs"
    mission_folders: tuple[str, ...] = ()
    base_frame: str = "base_footprint"


class MissionNode(FlorenceNode):
    """Serves the missions.

    Args:
        make_skills: Builds the skills by name over this node.
        declarations: What the skills say about themselves.
        on_recorded: Called when the files of a run are written.
        parameters: Overrides of the node's parameters.
    """

    def __init__(
        self,
        make_skills: Callable[[FlorenceNode], Mapping[str, Skill]],
        declarations: Mapping[str, SkillDeclaration],
        *,
        on_recorded: Callable[[RunRecord], None] | None = None,
        parameters: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__("florence_bt", parameters=parameters)
        self._settings = self.read_parameters(MissionNodeParameters)
        self._declarations = declarations
        library = MissionLibrary.load([Path(folder) for folder in self._settings.mission_folders])
        self._tf: TransformListener | None = None
        self._missions = Executor(
            library,
            make_skills(self),
            declarations,
            self.timebase,
            RunIds(datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")),
            call_soon=self.call_soon,
        )
        self._on_recorded = on_recorded
        self._runs_folder = Path(self._settings.runs_folder)
        recorder = RunRecorder(
            self._missions,
            self._runs_folder,
            self.timebase,
            self._robot_pose,
            self._recorded,
            on_trouble=self.get_logger().error,
        )
        self.on_close(recorder.close)
        self._missions.add_listener(self._on_event)
        self._missions.on_tick = self._on_tick
        self._tree_topic = self.create_publisher(String, "florence_bt/tree", LATCHED)
        self._state_topic = self.create_publisher(RunState, "florence_bt/run_state", LATCHED)
        self._told_tree = ""
        self._run_of_action: str | None = None
        self._create_services()
        self._tell_findings()
        self._state_topic.publish(RunState(state="IDLE"))

    def close(self) -> None:
        """Stop what runs; the skills' cancels go out, their answers would come too late."""
        self._on_recorded = None
        self._missions.blocked_by = "the mission server is shutting down"
        self._missions.abandon("the mission server is shutting down")

    # ---- services -------------------------------------------------------------------------------------

    def _create_services(self) -> None:
        self.create_service(RunMission, "florence_bt/run_mission", self._on_run_mission)
        self.create_service(StopMission, "florence_bt/stop", self._on_stop)
        self.create_service(MissionStatus, "florence_bt/status", self._on_status)
        self.create_service(ListMissions, "florence_bt/list_missions", self._on_list)
        self.create_service(CheckMission, "florence_bt/check_mission", self._on_check)
        self._action = SingleGoalServer(
            self,
            ExecuteMission,
            "florence_bt/execute_mission",
            on_goal=self._on_action_goal,
            on_cancel=self._on_action_cancel,
        )
        for name in self._missions.library.names():
            # The name of a file with errors may be no name for a service.
            if IDENTIFIER.fullmatch(name) and not self._missions.library.get(name).required_inputs():
                self.create_service(Trigger, f"florence_bt/missions/{name}", partial(self._on_trigger, name))

    def _tell_findings(self) -> None:
        """Say which missions cannot run; the others can."""
        library = self._missions.library
        findings = [*library.findings, *check(library, library, self._declarations)]
        for finding in findings:
            if finding.severity == ERROR:
                self.get_logger().error(report_text([finding]))

    def _on_run_mission(
        self, request: RunMission.Request, response: RunMission.Response
    ) -> RunMission.Response:
        accepted, run_id, message = self._start(
            request.mission,
            request.input_names,
            request.input_values,
            request.caller or "run_mission service",
            request.policy,
            request.priority,
        )
        response.accepted, response.run_id, response.message = accepted, run_id, message
        return response

    def _on_trigger(
        self, mission: str, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        accepted, run_id, message = self._start(mission, (), (), f"missions/{mission} service", "", 0)
        response.success = accepted
        response.message = f"{message} (run {run_id})" if accepted else message
        return response

    def _on_stop(self, request: StopMission.Request, response: StopMission.Response) -> StopMission.Response:
        run = self._missions.stop(request.reason or "stop asked by service", request.run_id or None)
        response.success = run is not None
        if run is not None:
            response.message = f"{run.run_id} stops"
        elif request.run_id:
            response.message = f"no run {request.run_id!r} is running or queued"
        else:
            response.message = "no mission is running"
        return response

    def _on_status(
        self, request: MissionStatus.Request, response: MissionStatus.Response
    ) -> MissionStatus.Response:
        run = self._missions.find(request.run_id or None)
        if run is None:
            return self._past_status(request.run_id, response)
        response.found = True
        response.run_id, response.mission = run.run_id, run.mission
        response.state, response.code, response.reason = run.status.value, run.code, run.reason
        tree = self._missions.render(run, colour=request.colour)
        response.tree = status_text(run, tree, self.timebase.now())
        return response

    def _past_status(self, run_id: str, response: MissionStatus.Response) -> MissionStatus.Response:
        """The status of a run that is neither running, waiting nor the last one: what its record says."""
        past = read_record(self._runs_folder, run_id)
        if past is not None:
            response.found = True
            response.run_id, response.mission = past.run_id, past.mission
            response.state, response.code, response.reason = past.status, past.code, past.reason
            response.tree = past.text
        elif run_id:
            response.tree = f"no run {run_id!r} is known here, nor recorded in {self._runs_folder}"
        else:
            response.tree = "no mission has run yet"
        return response

    def _on_list(
        self, request: ListMissions.Request, response: ListMissions.Response
    ) -> ListMissions.Response:
        library = self._missions.library
        response.names = library.names()
        response.descriptions = [library.get(name).description for name in response.names]
        return response

    def _on_check(
        self, request: CheckMission.Request, response: CheckMission.Response
    ) -> CheckMission.Response:
        try:
            mission = self._missions.library.get(request.mission)
        except ConfigError as error:
            response.report = str(error)
            return response
        findings = check(mission, self._missions.library, self._declarations)
        response.ok = not has_errors(findings)
        response.report = report_text(findings) if findings else f"{mission.name}: no problem found"
        return response

    # ---- the action -----------------------------------------------------------------------------------

    def _on_action_goal(self, goal: ExecuteMission.Goal) -> str | None:
        older = self._run_of_action
        if older is not None and goal.policy == Policy.QUEUE.value:
            return (
                f"this action has one goal at a time, now {older}; to queue more use the service run_mission"
            )
        accepted, run_id, message = self._start(
            goal.mission,
            goal.input_names,
            goal.input_values,
            "execute_mission action",
            goal.policy,
            goal.priority,
        )
        if not accepted:
            return message
        self._run_of_action = run_id
        if older is not None:
            # It may still wait in the queue; its client is told that it was replaced.
            self._missions.stop(f"replaced by {run_id}, a newer goal of the action", older)
        return None

    def _on_action_cancel(self) -> None:
        if self._run_of_action is not None:
            self._missions.stop("cancelled by the action client", self._run_of_action)

    def _finish_action(self, run: MissionRun) -> None:
        self._run_of_action = None
        result = ExecuteMission.Result(
            run_id=run.run_id, state=run.status.value, code=run.code, reason=run.reason, tree=run.tree
        )
        outcome = {
            RunStatus.SUCCEEDED: Outcome.SUCCEEDED,
            RunStatus.STOPPED: Outcome.CANCELLED,
        }.get(run.status, Outcome.FAILED)
        self._action.finish(result, outcome)

    # ---- inside ---------------------------------------------------------------------------------------

    def _start(
        self, mission: str, names: Any, values: Any, caller: str, policy: str, priority: int
    ) -> tuple[bool, str, str]:
        """Trigger a mission: (accepted, run id, message). Nothing that a caller sends raises from here."""
        try:
            request = Request(mission, _pair_inputs(names, values), caller, _policy(policy), priority)
            run = self._missions.trigger(request)
        except FlorenceError as error:
            self.get_logger().warning(f"{mission!r} asked by {caller} was refused: {error}")
            return False, "", str(error)
        self.get_logger().info(f"{run.run_id} {run.status.value.lower()}, asked by {caller}")
        word = "starts" if run.status is RunStatus.RUNNING else "waits for its turn"
        return True, run.run_id, f"{mission} {word}"

    def _on_event(self, run: MissionRun, event: Event) -> None:
        if self._missions.current not in (None, run):
            if event.kind in (EventKind.QUEUED, EventKind.ENDED):
                self._on_event_in_queue(run, event)
        elif event.kind is EventKind.STARTED:
            self._told_tree = ""
            self._publish_state(run)
        elif event.kind is EventKind.BROKEN:
            self.get_logger().error(f"{run.run_id} broke down:\n{event.data['detail']}")
        elif event.kind is EventKind.ENDED:
            self._publish_state(run)
            self._publish_text(status_text(run, run.tree, self.timebase.now()))
            self.get_logger().info(f"{run.run_id} {run.status.value}: {run.reason or 'ok'}")
            self._forget_transforms()
            if run.run_id == self._run_of_action:
                self._finish_action(run)

    def _on_event_in_queue(self, run: MissionRun, event: Event) -> None:
        """A run came into the queue or left it unserved; the last word stays with the current run."""
        self._publish_state(run)
        current = self._missions.current
        assert current is not None
        self._publish_state(current)
        if event.kind is EventKind.ENDED:
            self.get_logger().info(f"{run.run_id} {run.status.value} in the queue: {run.reason}")
            if run.run_id == self._run_of_action:
                self._finish_action(run)

    def _recorded(self, record: RunRecord) -> None:
        if self._on_recorded is not None:
            self._on_recorded(record)

    def _publish_state(self, run: MissionRun) -> None:
        self._state_topic.publish(
            RunState(
                run_id=run.run_id,
                mission=run.mission,
                state=RUN_STATES[run.status],
                code=run.code,
                reason=run.reason,
            )
        )

    def _on_tick(self, run: MissionRun) -> None:
        """After each tick: tell the tree if it reads differently now."""
        tree = self._missions.render(run)
        if tree == self._told_tree:
            return
        self._told_tree = tree
        self._publish_text(status_text(run, tree, self.timebase.now()))
        if run.run_id == self._run_of_action:
            tip = self._missions.tip()
            self._action.publish_feedback(ExecuteMission.Feedback(run_id=run.run_id, tip=tip, tree=tree))

    def _publish_text(self, text: str) -> None:
        self._tree_topic.publish(String(data=text))

    def _robot_pose(self) -> Pose2 | None:
        """Where the robot is, for the record. Transforms are listened to only while a mission runs."""
        if self._tf is None:
            self._tf = TransformListener(self)
        try:
            return self._tf.buffer.lookup_pose("map", self._settings.base_frame)
        except TransformUnavailable:
            return None

    def _forget_transforms(self) -> None:
        if self._tf is not None:
            self._tf.close()
            self._tf = None


def _pair_inputs(names: Any, values: Any) -> dict[str, str]:
    if len(names) != len(values):
        raise ConfigError(
            f"{len(names)} input names came with {len(values)} values", valid=["as many values as names"]
        )
    return dict(zip(names, values, strict=True))


def _policy(text: str) -> Policy:
    if not text:
        return Policy.REJECT
    try:
        return Policy(text)
    except ValueError:
        raise ConfigError(f"unknown policy {text!r}", valid=[policy.value for policy in Policy]) from None
