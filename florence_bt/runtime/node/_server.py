"""The mission server: builds the executor over the skills of this robot and everything that talks to it."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.limits import CheckedParameters, Limits
from florence_bt.core.message_skills import AnswerWait
from florence_bt.core.skill import Skill
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.ros.lifecycle import ACTIVATE, CONFIGURE, DEACTIVATE, SHUTDOWN, Done, Lifecycle
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.open_goals import OpenGoals
from florence_bt.ros.tf import TransformListener
from florence_bt.runtime.events import EventKind, RunEvent
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import Journal, JournalParameters
from florence_bt.runtime.missions import MissionFolders, ReloadReport
from florence_bt.runtime.node._controls import Controls
from florence_bt.runtime.node._queries import Queries
from florence_bt.runtime.node._robot_goals import RobotGoals, exclusive_actions
from florence_bt.runtime.node._servers import SkillServers
from florence_bt.runtime.node._topics import RunTopics
from florence_bt.runtime.node._triggers import Triggers
from florence_bt.runtime.node._watching import Watching
from florence_bt.runtime.recorder import RunRecord, RunRecorder
from florence_bt.runtime.recovery.recovery import FRESH_S, Recovery, Safety
from florence_bt.runtime.run import MissionRun, RunIds, utc_stamp


@dataclass(frozen=True, slots=True)
class MissionNodeParameters(CheckedParameters):
    """Parameters of the mission server.

    Attributes:
        runs_folder: Where the folders of the runs go.
        mission_folders: Folders of missions beside the built-in ones; later ones shadow earlier ones.
        base_frame: The robot's frame whose path is recorded.
        keep_runs: How many runs that ended are kept in the journal, with their folders.
        recovery_limit: Seconds since the last entry of the journal within which runs that a dead process left
            are resumed, restarted and queued again.
        autostart: Whether the node configures and activates itself; otherwise a lifecycle manager does.
    """

    runs_folder: str = "runs"
    mission_folders: tuple[str, ...] = ()
    base_frame: str = "base_footprint"
    keep_runs: Annotated[int, Limits(0)] = 1000
    recovery_limit: Annotated[float, Limits(0.0)] = FRESH_S
    autostart: bool = True


STOP_LIMIT_S = 30.0
"""Limit for a run to end when the node is deactivated, clean-ups included; steady time."""
STOP_LOOK_S = 0.05
"""Period of looking whether it has. Chosen."""
INACTIVE = "lifecycle"
"""Name of the block of triggers while the node is not active."""


class MissionNode(FlorenceNode):
    """Serves the missions. A managed node: missions start while it is active (docs/reference/ros_api.md).

    Its services are there in every state: the executor of rclpy 7.1 may die of a service that is taken away
    while somebody calls it. Triggers are refused with the state as the reason.

    Args:
        make_skills: Builds the skills by name over this node.
        declarations: What the skills say about themselves.
        make_safety: Builds what stops the robot after a crash, over this node and the goals that may use it.
        on_recorded: Called when the files of a run are written.
        other_actions: Actions that use the robot and that no skill asks: their goals end with ``stop``, too.
        own_skills: Skills whose servers come up together with the node: it is not ready before they are
            there. Those of others may come and go; which are missing is told (:class:`SkillServers`).
        only_used: Whether nobody misses a server that no mission of the folders uses.
        parameters: Overrides of the node's parameters.
    """

    parameter_classes = (MissionNodeParameters,)

    def __init__(
        self,
        make_skills: Callable[[FlorenceNode], Mapping[str, Skill]],
        declarations: Mapping[str, SkillDeclaration],
        *,
        make_safety: Callable[[FlorenceNode, OpenGoals], Safety] | None = None,
        on_recorded: Callable[[RunRecord], None] | None = None,
        other_actions: Collection[str] = (),
        own_skills: Collection[str] = (),
        only_used: bool = False,
        parameters: Mapping[str, Any] | None = None,
    ) -> None:
        super().__init__("florence_bt", parameters=parameters)
        self._settings = self.read_parameters(MissionNodeParameters)
        self._declarations = declarations
        self._on_recorded = on_recorded
        self._tf: TransformListener | None = None
        self._skills = make_skills(self)
        actions = exclusive_actions(self._skills, declarations)
        goals = OpenGoals(self, {*(skill.action for skill in actions), *other_actions})
        safety = make_safety(self, goals) if make_safety is not None else None
        self._robot_goals = RobotGoals(goals, actions)
        self._build_executor()
        self._servers = SkillServers(
            self,
            self._missions,
            self._skills,
            own=own_skills,
            folders=map(Path, self._settings.mission_folders),
            only_used=only_used,
        )
        stop = self._on_stop
        work = {CONFIGURE: self._on_configure, DEACTIVATE: stop, SHUTDOWN: stop}
        self._lifecycle = Lifecycle(self, work, self._follow_state)
        self._follow_state()
        self._serve()
        self._recover(safety)
        if self._settings.autostart:
            self._lifecycle.change(CONFIGURE)
            self._lifecycle.change(ACTIVATE)
        else:
            self.get_logger().info(f"no mission starts: {self._missions.blocked_by}")

    def _build_executor(self) -> None:
        """Build what runs missions and keeps a record of them."""
        runs_folder = Path(self._settings.runs_folder)
        self._journal = Journal(
            runs_folder,
            JournalParameters(keep_runs=self._settings.keep_runs),
            background=True,
            on_trouble=self.get_logger().error,
        )
        self.on_close(self._journal.close)
        folders = [Path(folder) for folder in self._settings.mission_folders]
        missions = MissionFolders.of(folders, self._declarations)
        self._missions = Executor(
            missions,
            self._skills,
            self._declarations,
            self.timebase,
            RunIds(utc_stamp),
            call_soon=self.call_soon,
            log=self._journal,
            yield_cpu=os.sched_yield,
            on_tick=self._after_tick,
        )
        recorder = RunRecorder(
            self._missions,
            runs_folder,
            self.timebase,
            self._robot_pose,
            self._recorded,
            on_trouble=self.get_logger().error,
        )
        self.on_close(recorder.close)

    def _serve(self) -> None:
        """Open the services, the action and the topics."""
        runs_folder = Path(self._settings.runs_folder)
        self._triggers = Triggers(self, self._missions, runs_folder)
        self._queries = Queries(
            self, self._missions, self._declarations, self._skills, runs_folder, self._robot_goals
        )
        self._topics = RunTopics(
            self, self._missions, self._triggers.publish_feedback, self._queries.warnings
        )
        self._watching = Watching(self, lambda: self._missions.tree)
        answers = next((skill for skill in self._skills.values() if isinstance(skill, AnswerWait)), None)
        self._controls = Controls(self, self._missions, self._reload, self._robot_goals, answers)
        self._missions.add_listener(self._on_event)
        self._queries.log_findings()

    def _recover(self, safety: Safety | None) -> None:
        """Take up what a dead process left."""
        self._recovery = Recovery(
            self._missions,
            self._journal,
            self._declarations,
            self.timebase,
            self.get_logger().warning,
            steady=self.steady,
            fresh_s=self._settings.recovery_limit,
        )
        if safety is None:
            self._recovery.begin()
        else:
            self._recovery.begin(safety.make_safe, self._still_booting, lambda: self._controls.last_override)

    def missing(self) -> list[str]:
        """Return what is missing, for people: servers of the robot's skills, and safety after a crash."""
        unseen = self._servers.missing_own()
        return [*unseen, "what a crash left"] if self._recovery.going_on else unseen

    def _still_booting(self) -> list[str]:
        """Return what a mission that goes on after a crash needs; the odometry is part of the pose."""
        servers = self._servers.missing_for(self._recovery.missions)
        missing = [*servers, *self._controls.missing_override()]
        if not self._lifecycle.active:
            missing.append("the activation of the mission server")
        return missing if self._robot_pose() is not None else [*missing, "the robot's pose"]

    def _follow_state(self) -> None:
        """Refuse triggers while the node is not active, and say in which state it is."""
        state = self._lifecycle.state
        ways = {"unconfigured": "configure and activate it", "inactive": "activate it"}
        way = ways.get(state, "wait, or start it again")
        reason = None if self._lifecycle.active else f"the mission server is {state} (lifecycle): {way}"
        self._missions.block(INACTIVE, reason)

    def _on_configure(self, done: Done) -> None:
        """Load the missions anew."""
        self._reload()
        done(True)

    def _on_stop(self, done: Done) -> None:
        """Stop every run; the transition is done when the last has ended, with its skills and clean-ups."""
        self._missions.stop_all(f"the mission server is {self._lifecycle.state}")
        give_up_at = self.steady.now() + STOP_LIMIT_S

        def look() -> None:
            run = self._missions.current
            if run is None:
                done(True)
            elif self.steady.now() < give_up_at:
                self.steady.call_at(self.steady.now() + STOP_LOOK_S, look)
            else:
                self.get_logger().error(f"{run.run_id} has not ended within {STOP_LIMIT_S:g} s")
                done(False)

        look()

    def close(self) -> None:
        """Stop what runs; the skills' cancels go out, and their answers are waited for only for a moment."""
        self._on_recorded = None
        reason = "the mission server is shutting down"
        self._missions.block("shutdown", reason)
        self._missions.abandon(reason)

    def on_failure(self, reason: str) -> None:
        """Stop the robot, and the run that may not go on as it should; those that wait are not touched."""
        try:
            self._robot_goals.cancel_all()
        finally:
            self._missions.stop(reason)

    def _after_tick(self, run: MissionRun) -> None:
        self._watching.after_tick(run)
        self._topics.after_tick(run)

    def _on_event(self, run: MissionRun, event: RunEvent) -> None:
        if event.kind is EventKind.NODE:
            return
        self._topics.on_event(run, event)
        self._watching.on_event(run, event)
        if event.kind is EventKind.BROKEN:
            self.get_logger().error(f"{run.run_id} broke down:\n{event.data['detail']}")
        elif event.kind is EventKind.ENDED:
            self.get_logger().info(f"{run.run_id} {run.status.value}: {run.reason or 'ok'}")
            if self._missions.current is None:
                self._forget_transforms()
            self._triggers.on_end(run)

    def _reload(self) -> ReloadReport:
        """Load what was edited in the mission files; the triggers by name follow."""
        report = self._missions.reload()
        self._triggers.sync()
        return report

    def _recorded(self, record: RunRecord) -> None:
        if self._on_recorded is not None:
            self._on_recorded(record)

    def _robot_pose(self) -> Pose2 | None:
        """Return where the robot is, for the record. Transforms are listened to only while a mission runs."""
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
