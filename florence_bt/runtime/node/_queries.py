"""Services that answer questions: the status of runs, which missions there are, what is wrong with one."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from florence_interfaces.srv import CheckMission, ListMissions, MissionStatus

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.skill import MissingSkill, Skill
from florence_bt.ros.late_nodes import LateNodes
from florence_bt.ros.node import FlorenceNode
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.journal import JournalReader
from florence_bt.runtime.journal.text import tree_from_events
from florence_bt.runtime.node._convert import mission_to_ros, run_tree_to_ros
from florence_bt.runtime.node._robot_goals import RobotGoals
from florence_bt.runtime.requests import checked_text
from florence_bt.runtime.run import MissionRun
from florence_bt.runtime.status import run_tree
from florence_bt.runtime.viewers.run_tree import RunTree
from florence_bt.trees.checks.report import report_text
from florence_bt.trees.drawings.ascii import draw_rows
from florence_bt.trees.drawings.folding import fold_calls
from florence_bt.trees.language.findings import ERROR, has_errors
from florence_bt.trees.language.model import Mission


class Queries:
    """Serves ``florence_bt/status``, ``whole_status``, ``list_missions`` and ``check_mission``.

    Args:
        node: The node that serves them.
        missions: What runs the missions.
        declarations: What the skills say about themselves.
        skills: The skills by name; those that are missing are listed with the missions.
        runs_folder: Where the records of earlier runs are.
        goals: The open goals that use the robot.
    """

    def __init__(
        self,
        node: FlorenceNode,
        missions: Executor,
        declarations: Mapping[str, SkillDeclaration],
        skills: Mapping[str, Skill],
        runs_folder: Path,
        goals: RobotGoals,
    ) -> None:
        self._node = node
        self._missions = missions
        self._declarations = declarations
        self._skills = skills
        self._runs_folder = runs_folder
        self._goals = goals
        self._late = LateNodes(node)
        node.create_service(MissionStatus, "florence_bt/status", partial(self._on_status, whole=False))
        node.create_service(MissionStatus, "florence_bt/whole_status", partial(self._on_status, whole=True))
        node.create_service(ListMissions, "florence_bt/list_missions", self._on_list)
        node.create_service(CheckMission, "florence_bt/check_mission", self._on_check)

    def log_findings(self) -> None:
        """Say in the log which missions cannot run, what shadows what, and which packages are broken."""
        log = self._node.get_logger()
        for finding in (*self._missions.library.findings, *getattr(self._declarations, "findings", ())):
            (log.error if finding.severity == ERROR else log.warning)(report_text([finding]))
        for mission in self._missions.library.missions():
            problem = self._problem(mission)
            if problem:
                self._node.get_logger().error(problem)

    def _on_status(
        self, request: MissionStatus.Request, response: MissionStatus.Response, *, whole: bool
    ) -> MissionStatus.Response:
        response.blocked_by = self._missions.blocked_by or ""
        response.waiting = [run.run_id for run in self._missions.waiting]
        response.unowned_goals = [str(goal) for goal in self._goals.unowned()]
        try:
            run_id = checked_text("the run's id", request.run_id)
        except ConfigError as error:
            response.tree = str(error)
            return response
        run = self._missions.find(run_id or None)
        if run is None:
            return self._past_status(run_id, response)
        nodes = self._missions.nodes_of(run)
        text = "" if nodes else run.tree
        shown = run_tree(run, self._node.timebase.now(), self.warnings(), nodes=nodes, text=text)
        tree = draw_rows(
            nodes if whole else fold_calls(nodes),
            colour=request.colour,
            visited_only=request.visited_only,
            durations=request.durations,
        )
        return _filled(response, run, shown, tree or text)

    def warnings(self) -> list[str]:
        """Return what people should know beside any run."""
        return [*self._missions.warnings(), *self._late.sentences()]

    def _past_status(self, run_id: str, response: MissionStatus.Response) -> MissionStatus.Response:
        """Return the status of a run that is neither running, waiting nor the last one, from the journal."""
        if not run_id:
            shown = run_tree(None, 0.0, self.warnings())
            response.tree, response.run_tree = shown.text_with(""), run_tree_to_ros(shown)
            return response
        try:
            with JournalReader(self._runs_folder) as journal:
                past = journal.run(run_id)
                events = journal.events(run_id) if past is not None and not past.tree else []
        except ConfigError as error:
            response.tree = f"no run {run_id!r} is known here: {error}"
            return response
        if past is None:
            response.tree = f"no run {run_id!r} is known here, nor in the journal of {self._runs_folder}"
            return response
        run = past.as_run()
        tree = past.tree or tree_from_events(events)
        now = run.ended or run.started or 0.0
        return _filled(response, run, run_tree(run, now, text=tree, accepted=past.accepted), tree)

    def _on_list(
        self, request: ListMissions.Request, response: ListMissions.Response
    ) -> ListMissions.Response:
        library = self._missions.library
        missions = sorted(library.missions(), key=lambda mission: mission.name)
        response.names = [mission.name for mission in missions]
        response.descriptions = [mission.description for mission in missions]
        response.missions = [mission_to_ros(mission, self._problem(mission)) for mission in missions]
        findings = [*library.findings, *getattr(self._declarations, "findings", ())]
        response.findings = [report_text([finding]) for finding in findings]
        # Of a skill that comes with Florence the mission that wants it tells it.
        stock = {name for name, mapping in library.mappings.items() if mapping.stock}
        response.findings += [
            f"the skill {name!r} is missing: {skill.reason}"
            for name, skill in self._skills.items()
            if isinstance(skill, MissingSkill) and name not in stock
        ]
        response.findings += self._missions.warnings()
        if self._missions.blocked_by:
            response.findings.append(f"no mission starts: {self._missions.blocked_by}")
        return response

    def _problem(self, mission: Mission) -> str:
        """Tell why a mission cannot run, as the check says it."""
        errors = [one for one in self._missions.findings_of(mission) if one.severity == ERROR]
        return report_text(errors) if errors else ""

    def _on_check(
        self, request: CheckMission.Request, response: CheckMission.Response
    ) -> CheckMission.Response:
        try:
            name = checked_text("the name of the mission", request.mission)
            mission = self._missions.library.get(name)
        except ConfigError as error:
            response.report = str(error)
            return response
        findings = self._missions.findings_of(mission)
        response.ok = not has_errors(findings)
        response.report = report_text(findings) if findings else f"{mission.name}: no problem found"
        return response


def _filled(
    response: MissionStatus.Response, run: MissionRun, shown: RunTree, tree: str
) -> MissionStatus.Response:
    response.found = True
    response.run_id, response.mission = run.run_id, run.mission
    response.state, response.code = run.status.value, run.code
    response.reason = run.reason or run.paused
    response.cause = run.why.path if run.why else ""
    response.caller = run.request.caller
    response.tree, response.run_tree = shown.text_with(tree), run_tree_to_ros(shown)
    return response
