"""``florence import`` and ``florence export``: trees of BehaviorTree.CPP, without a running system."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.mission_files.mission_list import mission_name
from florence_bt.app.mission_files.output import write_output, write_outputs
from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.report import FORMATS, Excerpts, report_full
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.findings import ERROR, WARNING, Finding, has_errors
from florence_bt.trees.language.loader import MissionLibrary
from florence_btcpp.exporter import export_mission
from florence_btcpp.importer import import_trees
from florence_btcpp.notes import losses


@dataclass(frozen=True)
class Exchanged:
    """The end of an import or export.

    Attributes:
        done: What was written, for people; empty when nothing was.
        report: The findings as a text.
        good: Whether it was done.
    """

    done: str
    report: str
    good: bool


def export_file(
    mission: str, out: Path | None, folders: Sequence[Path], form: str = "text", *, strict: bool = False
) -> Exchanged:
    """Export a mission.

    Args:
        mission: The name of a mission, or a mission file.
        out: The XML file; None gives the XML as what was done.
        folders: More mission folders.
        form: ``text``, ``json`` or ``github``: the form of the report.
        strict: Whether nothing is written when something is lost.

    Raises:
        ConfigError: There is no such mission, it has errors, or the file cannot be written.
    """
    library = MissionLibrary.load(folders)
    name = mission_name(mission, library)
    exported = export_mission(name, library, library.with_declared(collect_declarations()))
    report = _report(exported.findings, form)
    if strict and losses(exported.findings):
        return Exchanged("", report, False)
    if out is None:
        return Exchanged(exported.xml, report, True)
    write_output(out, exported.xml, mark=b"BTCPP_format")
    trees = f"{len(exported.trees)} tree{'s' * (len(exported.trees) != 1)}: {', '.join(exported.trees)}"
    return Exchanged(f"{out} written with {trees}", report, True)


def import_file(
    file: Path,
    folder: Path,
    models: Sequence[Path] = (),
    form: str = "text",
    *,
    strict: bool = False,
    overwrite: bool = False,
) -> Exchanged:
    """Import the trees of an XML file.

    Args:
        file: The XML file.
        folder: Where the missions are written; it is made when it is not there.
        models: XML files whose ``TreeNodesModel`` describes the nodes.
        form: ``text``, ``json`` or ``github``: the form of the report.
        strict: Whether nothing is written when something is lost.
        overwrite: Whether files that are there may be replaced.

    Raises:
        ConfigError: A file cannot be read or written, or is there already.
    """
    imported = import_trees(file, collect_declarations(), models)
    report = _report(imported.findings, form)
    if has_errors(imported.findings) or (strict and losses(imported.findings)):
        return Exchanged("", report, False)
    there = [name for name in imported.files if (folder / name).exists()]
    if there and not overwrite:
        raise ConfigError(f"{folder / there[0]} exists already", valid=["--overwrite", "another folder"])
    write_outputs({folder / name: text.encode() for name, text in imported.files.items()})
    return Exchanged(_summary(folder, imported.missions, imported.main, imported.skills), report, True)


def _summary(folder: Path, missions: Sequence[str], main: str | None, skills: Sequence[str]) -> str:
    count = len(missions)
    lines = [f"{count} mission{'s' * (count != 1)} written to {folder}: {', '.join(missions)}"]
    if main is not None and count > 1:
        lines.append(f"the main one is {main}")
    if skills:
        lines.append(f"{len(skills)} skill{'s' * (len(skills) != 1)} declared that this installation lacks")
    lines.append(f"next: florence check {folder}")
    return "\n".join(lines)


def _report(findings: Sequence[Finding], form: str) -> str:
    if form not in FORMATS:
        raise ConfigError(f"there is no format {form!r}", valid=FORMATS)
    if form != "text":
        return FORMATS[form](findings, Excerpts())
    if not findings:
        return ""
    counts = [(sum(f.severity == ERROR for f in findings), "error")]
    counts.append((sum(f.severity == WARNING for f in findings), "thing lost"))
    words = [f"{n} {word.replace('thing', 'things') if n != 1 else word}" for n, word in counts if n]
    text = report_full(findings, Excerpts())
    return f"{text}\n{', '.join(words)}".strip() if words else text
