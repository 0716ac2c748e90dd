"""Checks missions before they run, and reports everything at once."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.interfaces import load_interface
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.checks.keys import KeyChecks
from florence_bt.trees.checks.names import NameChecks
from florence_bt.trees.checks.places import KnownPlaces, check_places, labels_in
from florence_bt.trees.checks.properties import properties_of
from florence_bt.trees.checks.races import check_races
from florence_bt.trees.checks.reach import ReachChecks
from florence_bt.trees.checks.structure import check_structure
from florence_bt.trees.checks.waits import WaitChecks
from florence_bt.trees.checks.watches import WatchChecks
from florence_bt.trees.kinds import RunSkill
from florence_bt.trees.language.analysis import Analysis, callers_among, reachable
from florence_bt.trees.language.findings import (
    ERROR,
    WARNING,
    Finding,
    FindingList,
    has_errors,
    limit_findings,
    sort_findings,
)
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission

__all__ = ["KnownPlaces", "check", "errors_of_called", "read_files", "written_labels"]


def check(
    missions: Mission | Iterable[Mission],
    library: MissionLibrary,
    declarations: Mapping[str, SkillDeclaration],
    hotspots: Collection[str] | KnownPlaces | None = None,
) -> list[Finding]:
    """Check missions.

    Args:
        missions: What to check; the missions that they call are looked at but not reported on.
        library: Where called missions are found.
        declarations: The skills by name.
        hotspots: The labels of all hotspots, or all that is known of the flat; None when nothing is known.

    Returns:
        Everything that was found, by file and place; empty when all is well.
    """
    analysis = Analysis(library, dict(library.with_declared(declarations)))
    places = (
        hotspots if isinstance(hotspots, KnownPlaces) or hotspots is None else KnownPlaces(tuple(hotspots))
    )
    findings: list[Finding] = []
    for mission in [missions] if isinstance(missions, Mission) else missions:
        findings += [
            *_check_mission(mission, analysis, places),
            *_lacking_skills(mission, declarations, library),
            *_unread_refusals(mission, library),
        ]
    return limit_findings(findings)


def read_files(files: Iterable[Path], library: MissionLibrary) -> tuple[list[Mission], list[Finding]]:
    """Read mission files into a library: the missions, and what is wrong with files that are not YAML."""
    paths = list(files)
    missions = [mission for path in paths if (mission := library.add_file(path)) is not None]
    given = {str(path) for path in paths}
    return missions, [finding for finding in library.findings if finding.file in given]


def errors_of_called(
    missions: Collection[Mission], library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> list[Finding]:
    """Report an error at each call of a mission that cannot run, itself or through what it calls.

    Args:
        missions: What is checked; what is wrong with these is reported at their own places.
        library: Where called missions are found.
        declarations: The skills by name.
    """
    analysis = Analysis(library, dict(library.with_declared(declarations)))
    checked = set(missions)
    called = dict.fromkeys(name for mission in missions for name in analysis.callees(mission))
    reached = [*called, *(name for name in reachable(called, analysis.callees_of) if name not in called)]
    errors: dict[str, Finding] = {}
    for name in reached:
        mission = library.find(name)
        if mission is not None and mission not in checked:
            found = sort_findings(_check_mission(mission, analysis, None))
            if has_errors(found):
                errors[name] = next(finding for finding in found if finding.severity == ERROR)
    callers = callers_among(reached, analysis.callees_of)
    leads_to = {**reachable(errors, lambda name: callers.get(name, ())), **{name: name for name in errors}}

    def first_error(name: str) -> tuple[str, Finding]:
        while leads_to[name] != name:
            name = leads_to[name]
        return name, errors[name]

    findings: list[Finding] = []
    for mission in missions:
        cycle = analysis.cycle_of(mission)
        for call in analysis.calls(mission):
            if call.mission.text not in leads_to or call.mission.text in cycle:
                continue  # recursion is reported at its own place
            name, error = first_error(call.mission.text)
            place = call.mission.position
            message = f"the mission {name!r} has errors; the first one: {error.as_error()}"
            findings.append(Finding(str(mission.file), place.line, place.column, ERROR, message))
    return findings


def written_labels(
    mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> list[tuple[str, Position]]:
    """Return the labels of hotspots that are written in a mission, each with its place."""
    return [(text, position) for text, position, _ in labels_in(mission, Analysis(library, declarations))]


def _check_mission(mission: Mission, analysis: Analysis, places: KnownPlaces | None) -> list[Finding]:
    notes = FindingList(mission.file, imported=bool(mission.imported_from))
    NameChecks(mission, analysis, notes).check()
    if places is not None:
        check_places(mission, analysis, places, notes)
    check_structure(mission, analysis, notes)
    properties, wrong = properties_of(mission, analysis)
    keys = KeyChecks(mission, analysis, notes, properties)
    if has_errors(mission.findings):
        # A part that could not be read may be the one that writes a key first, or that can fail.
        keys.check_names()
    else:
        ReachChecks(mission, analysis, notes).check()
        WatchChecks(mission, analysis, notes).check()
        check_races(mission, analysis, notes)
        WaitChecks(mission, analysis, notes).check()
        keys.check()
    return [*mission.findings, *notes.findings, *wrong]


def _lacking_skills(mission: Mission, skills: Collection[str], library: MissionLibrary) -> Iterator[Finding]:
    """Yield a warning for each skill that is declared but not there, at its first use.

    Args:
        mission: The mission.
        skills: The skills of this installation.
        library: What the files beside the missions declare.
    """
    seen: set[str] = set()
    for node in mission.nodes():
        if not isinstance(node, RunSkill) or node.skill in seen or node.skill in skills:
            continue
        seen.add(node.skill)
        place, mapping = node.position, library.mappings.get(node.skill)
        message, valid = "", tuple[str, ...]()
        if mapping is None and node.skill in library.declarations:
            message = f"the skill {node.skill!r} is declared but not implemented on this robot (no_skill)"
        elif mapping is not None and mapping.stock:  # of others the file's own findings tell it
            try:
                load_interface(mapping.interface)
            except ConfigError as error:
                message = f"the skill {node.skill!r} needs {mapping.interface}: {error.problem}"
                valid = (f"florence interfaces add {mapping.interface.partition('/')[0]}",)
        if message:
            yield Finding(str(mission.file), place.line, place.column, WARNING, message, valid)


def _unread_refusals(mission: Mission, library: MissionLibrary) -> Iterator[Finding]:
    """Yield a warning at each node whose skill may be refused without anybody noticing."""
    for node in mission.nodes():
        mapping = library.mappings.get(node.skill) if isinstance(node, RunSkill) else None
        if not isinstance(node, RunSkill) or mapping is None or mapping.unread is None:
            continue
        output, refusal = mapping.unread
        if output not in {taken.text for taken, _ in node.outputs}:
            place = node.position
            message = f"nothing reads {output!r} of {node.skill!r}: a refusal counts as success"
            remedy = f"failures: {{refused: {{when: {refusal}}}}}, in the file of skills"
            valid = (remedy, f"out: {{{output}: {output}}}")
            yield Finding(str(mission.file), place.line, place.column, WARNING, message, valid)
