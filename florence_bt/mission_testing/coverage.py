"""Coverage of missions by tests: nodes, their outcomes, and the failure codes of their skills."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.plain_yaml import Position
from florence_bt.mission_testing.mocks.board import SkillCall
from florence_bt.mission_testing.paths import NodeRef
from florence_bt.mission_testing.record import FAILURE, SKIPPED, STOPPED, SUCCESS
from florence_bt.mission_testing.test_run import TestRun
from florence_bt.trees import kinds
from florence_bt.trees.checks.outcomes import Outcomes, possible_outcomes
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission, Node

_NEVER = {
    SUCCESS: "never succeeded",
    FAILURE: "never failed",
    STOPPED: "was never stopped while running",
    SKIPPED: "was never skipped",
}

Key = tuple[Path, Position]
"""A node: its file and its place there."""


@dataclass(frozen=True, slots=True)
class NodeCoverage:
    """The coverage of a node.

    Attributes:
        title: Its name.
        position: Where it stands.
        possible: The outcomes that it can have.
        missing: Those that no test has seen.
        codes: The failure codes that its skill declares.
        missing_codes: Those that no test has seen.
        seen: Whether it was reached at all.
    """

    title: str
    position: Position
    possible: tuple[str, ...]
    missing: tuple[str, ...]
    codes: tuple[str, ...]
    missing_codes: tuple[str, ...]
    seen: bool


@dataclass(frozen=True, slots=True)
class MissionCoverage:
    """The coverage of a mission.

    Attributes:
        name: Its name.
        file: Its file.
        nodes: Its nodes in the order of the file.
    """

    name: str
    file: Path
    nodes: tuple[NodeCoverage, ...]

    @property
    def nodes_seen(self) -> Share:
        """Nodes that were reached, of all."""
        return Share(sum(node.seen for node in self.nodes), len(self.nodes))

    @property
    def outcomes_seen(self) -> Share:
        """Outcomes of nodes that were seen, of all that are possible."""
        total = sum(len(node.possible) for node in self.nodes)
        return Share(total - sum(len(node.missing) for node in self.nodes), total)

    @property
    def codes_seen(self) -> Share:
        """Declared failure codes that were seen, of all skills in the mission."""
        total = sum(len(node.codes) for node in self.nodes)
        return Share(total - sum(len(node.missing_codes) for node in self.nodes), total)


@dataclass(frozen=True, slots=True)
class Share:
    """A count out of a total.

    Attributes:
        seen: How many.
        total: Of how many.
    """

    seen: int
    total: int

    @property
    def percent(self) -> float:
        """The share in per cent; all of nothing is 100."""
        return 100.0 * self.seen / self.total if self.total else 100.0

    def __add__(self, other: Share) -> Share:
        """Add two shares."""
        return Share(self.seen + other.seen, self.total + other.total)

    def __str__(self) -> str:
        """Write the share, such as ``23/24``."""
        return f"{self.seen}/{self.total}"


@dataclass(slots=True)
class Coverage:
    """Gathers what runs have shown.

    Attributes:
        outcomes: The outcomes that were seen, by node.
        codes: The failure codes that were seen, by node.
        missions: The missions that are tested, by file, each with the library that it came from.
    """

    outcomes: dict[Key, set[str]] = field(default_factory=dict)
    codes: dict[Key, set[str]] = field(default_factory=dict)
    missions: dict[Path, tuple[Mission, MissionLibrary]] = field(default_factory=dict)

    def add_mission(self, mission: Mission, library: MissionLibrary) -> None:
        """Report on a mission, also when no run of it follows."""
        self.missions.setdefault(mission.file, (mission, library))

    def add_runs(self, runs: Iterable[TestRun]) -> None:
        """Count what runs have shown."""
        for run in runs:
            for path, outcome in run.record.outcomes:
                self._add(run.mission_map.find(path), outcome)
            for call in run.calls():
                self._add_call(call, run.record.outcomes)

    def report(self, declarations: Mapping[str, SkillDeclaration]) -> list[MissionCoverage]:
        """Report what was seen of each tested mission, by name."""
        reports = [
            MissionCoverage(
                mission.name,
                mission.file,
                tuple(
                    self._node(mission, node, possible, known)
                    for node, possible in possible_outcomes(mission, library, known)
                ),
            )
            for mission, library in self.missions.values()
            for known in (library.with_declared(declarations),)
        ]
        return sorted(reports, key=lambda report: (report.name, str(report.file)))

    def _add(self, ref: NodeRef, outcome: str) -> None:
        if ref.origin is not None:
            self.outcomes.setdefault(_key(ref.origin.mission, ref.origin.node), set()).add(outcome)

    def _add_call(self, call: SkillCall, outcomes: set[tuple[str, str]]) -> None:
        if call.node.call is None or call.result is None:
            return
        key = _key(call.node.call.mission, call.node.call.node)
        if not call.result.succeeded:
            self.codes.setdefault(key, set()).add(call.result.code)
        if any((call.node.path, outcome) in outcomes for outcome in (SUCCESS, FAILURE, STOPPED)):
            return
        # A clean-up beside the tree: no event has the statuses of its nodes.
        ended = SUCCESS if call.result.succeeded else STOPPED if call.cancelled else FAILURE
        self._add(call.node, ended)

    def _node(
        self,
        mission: Mission,
        node: Node,
        possible: Outcomes,
        declarations: Mapping[str, SkillDeclaration],
    ) -> NodeCoverage:
        key = _key(mission, node)
        seen, codes_seen = self.outcomes.get(key, set()), self.codes.get(key, set())
        can = {
            SUCCESS: possible.success,
            FAILURE: possible.failure,
            STOPPED: possible.stopped,
            SKIPPED: possible.skipped,
        }
        wanted = tuple(outcome for outcome, yes in can.items() if yes)
        declaration = declarations.get(node.skill) if isinstance(node, kinds.RunSkill) else None
        codes = tuple(declaration.failures) if declaration is not None else ()
        return NodeCoverage(
            title=node.title,
            position=node.position,
            possible=wanted,
            missing=tuple(outcome for outcome in wanted if outcome not in seen),
            codes=codes,
            missing_codes=tuple(code for code in codes if code not in codes_seen),
            seen=bool(seen),
        )


def total_of(reports: Iterable[MissionCoverage]) -> Share:
    """Add up the nodes and outcomes of several missions, to be held against a minimum."""
    total = Share(0, 0)
    for report in reports:
        total = total + report.outcomes_seen
    return total


def coverage_text(reports: Iterable[MissionCoverage], *, codes: bool = False) -> str:
    """Write the coverage for people: a table, then what no test has seen.

    Args:
        reports: The missions.
        codes: Whether to list each failure code that was not seen.
    """
    reports = list(reports)
    width = max([len(report.name) for report in reports] + [len("mission")])
    lines = [f"{'mission':<{width}}  {'nodes':>8}  {'outcomes':>9}  {'failure codes':>14}"]
    for report in reports:
        figures = f"{report.nodes_seen!s:>8}  {report.outcomes_seen!s:>9}  {report.codes_seen!s:>14}"
        lines.append(f"{report.name:<{width}}  {figures}")
    lines.append(f"{total_of(reports).percent:.1f} % of the outcomes of all nodes were seen")
    for report in reports:
        for node in report.nodes:
            lines += _missing(report, node, codes)
    return "\n".join(lines)


def _missing(report: MissionCoverage, node: NodeCoverage, codes: bool) -> list[str]:
    place = f"{report.file}:{node.position.line}:{node.position.column}: {node.title}:"
    lines = []
    if not node.seen and node.possible:
        lines.append(f"{place} was never reached")
    elif node.missing:
        lines.append(f"{place} {', '.join(_NEVER[outcome] for outcome in node.missing)}")
    if codes and node.missing_codes:
        lines.append(f"{place} never failed with {', '.join(node.missing_codes)}")
    return lines


def _key(mission: Mission, node: Node) -> Key:
    return mission.file, node.position
