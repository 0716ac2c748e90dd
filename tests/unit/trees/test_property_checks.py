"""What must hold of a mission is checked with the mission, before anybody proves it."""

from pathlib import Path

import pytest

from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.loader import MissionLibrary

MISSION = """\
mission: tried
tree:
  sequence:
    - look_for_user: {}
      out: {distance: far}
    - turn: {angle: 90 deg}
"""
WRONG = {
    "never: sing": "the mission does not use 'sing'",
    "never: turn while $fat < 1 m": "the mission has no key 'fat'",
    "never: turn while $far < 1 s": "is a length",
    "never: it fails with no_pat": "nothing fails with 'no_pat'",
    "nevr: turn": "a property begins with one of its words",
}


def findings_of(folder: Path, mission: str = MISSION) -> list[Finding]:
    (folder / "tried.yaml").write_text(mission)
    library = MissionLibrary.load([folder])
    return check(library.get("tried"), library, collect_declarations())


def beside(folder: Path, text: str) -> Path:
    file = folder / "tried.properties.yml"
    file.write_text(text)
    return file


@pytest.mark.parametrize("text", WRONG)
def test_the_file_of_properties_is_checked_with_its_mission(tmp_path: Path, text: str):
    file = beside(tmp_path, f"properties:\n  - never: turn while $far < 1 m\n  - {text}\n")
    [finding] = findings_of(tmp_path)
    assert WRONG[text] in finding.message
    assert (finding.file, finding.line, finding.severity) == (str(file), 3, "error")


def test_a_key_that_a_property_reads_is_read(tmp_path: Path):
    [unread] = findings_of(tmp_path)
    assert "nothing reads" in unread.message
    beside(tmp_path, "properties:\n  - never: turn while $far < 1 m\n")
    assert not findings_of(tmp_path)


@pytest.mark.parametrize("text", WRONG)
def test_the_section_of_the_mission_is_checked_in_the_same_way(tmp_path: Path, text: str):
    section = f"properties:\n  - never: turn while $far < 1 m\n  - {text}\n"
    [finding] = findings_of(tmp_path, MISSION + section)
    assert WRONG[text] in finding.message
    assert (Path(finding.file).name, finding.line, finding.severity) == ("tried.yaml", 9, "error")


def test_properties_in_two_places_are_told(tmp_path: Path):
    """Who opens the mission would believe that these are all."""
    section = "properties:\n  - never: turn while $far < 1 m\n"
    beside(tmp_path, section)
    [finding] = findings_of(tmp_path, MISSION + section)
    assert "here and in tried.properties.yml" in finding.message
    assert (Path(finding.file).name, finding.line, finding.severity) == ("tried.yaml", 8, "error")


@pytest.mark.parametrize("text", ["properties: {never: turn}\n", "never: turn\n", "a: *b\n"])
def test_a_file_without_a_list_is_told(tmp_path: Path, text: str):
    file = beside(tmp_path, text)
    assert str(file) in {each.file for each in findings_of(tmp_path)}
