"""Checks missions before they run, and reports everything at once."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.trees._facts import Facts
from florence_bt.trees._lint_keys import KeyChecks
from florence_bt.trees._lint_names import NameChecks
from florence_bt.trees._lint_structure import check_structure
from florence_bt.trees._notes import Notes
from florence_bt.trees.findings import Finding, finding_from_error, has_errors, sort_findings
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.model import Mission
from florence_bt.trees.parse import read_mission


def check(
    missions: Mission | Iterable[Mission],
    library: MissionLibrary,
    declarations: Mapping[str, SkillDeclaration],
    hotspots: Collection[str] | None = None,
) -> list[Finding]:
    """Check missions.

    Args:
        missions: What to check; the missions that they call are looked at but not reported on.
        library: Where called missions are found.
        declarations: The skills by name.
        hotspots: The labels of all hotspots, None when they are not known.

    Returns:
        Everything that was found, by file and place; empty when all is well.
    """
    facts = Facts(library, declarations)
    findings: list[Finding] = []
    for mission in [missions] if isinstance(missions, Mission) else missions:
        notes = Notes(mission)
        NameChecks(mission, facts, hotspots, notes).check()
        check_structure(mission, facts, notes)
        # A node that could not be read may be the one that writes a key.
        if not has_errors(mission.findings):
            KeyChecks(mission, facts, notes).check()
        findings += [*mission.findings, *notes.findings]
    return sort_findings(findings)


def check_files(
    files: Iterable[Path],
    library: MissionLibrary,
    declarations: Mapping[str, SkillDeclaration],
    hotspots: Collection[str] | None = None,
) -> list[Finding]:
    """Check mission files, which join the library first so that they can call each other.

    Args:
        files: The files.
        library: Where called missions are found; the files' missions shadow those of the same name.
        declarations: The skills by name.
        hotspots: The labels of all hotspots, None when they are not known.

    Returns:
        Everything that was found, by file and place; files that are no YAML included.
    """
    findings: list[Finding] = []
    missions: list[Mission] = []
    for file in files:
        try:
            missions.append(read_mission(file))
        except ConfigError as error:
            findings.append(finding_from_error(error))
        library.add_file(file)
    return sort_findings([*findings, *check(missions, library, declarations, hotspots)])
