"""Bugs that were planted in copies of shipped and example missions are found; the originals have none."""

import shutil
from functools import cache
from pathlib import Path

import pytest

from florence_bt.assurance.report import verdict_on
from florence_bt.assurance.verifier import Verifier
from florence_bt.mission_testing.paths import all_declarations
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.findings import ERROR
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from florence_bt.trees.language.model import Mission
from tests.sweeps import sweep
from tests.unit.assurance.planted_bugs import PLANTED, Planted

EXAMPLES = Path(__file__).parents[3] / "examples" / "missions"
FOLDERS = (EXAMPLES, EXAMPLES / "first_steps")
NAMES = sorted(
    file.stem for folder in (BUILT_IN, *FOLDERS) for file in folder.glob("*.yaml") if "." not in file.stem
)
MISSED: frozenset[tuple[str, str]] = frozenset()
"""Kind and mission of what is not found, each with its reason in docs/notes/verify.md."""


@cache
def originals() -> Verifier:
    return Verifier(MissionLibrary.load(list(FOLDERS)), all_declarations())


def messages(mission: Mission, library: MissionLibrary) -> set[str]:
    """What the check says of a mission; of some examples, that this robot has not their skills."""
    return {each.message for each in check(mission, library, all_declarations())}


def is_found(folder: Path, bug: Planted) -> bool:
    """Tell whether the check or the verifier finds a bug."""
    library = MissionLibrary.load(list(FOLDERS))
    file = library.get(bug.mission).file
    text = file.read_text(encoding="utf-8")
    assert text.count(bug.old) == 1, bug
    for beside in file.parent.glob(f"{bug.mission}.properties.yml"):
        shutil.copy(beside, folder)
    copy = folder / file.name
    copy.write_text(text.replace(bug.old, bug.new), encoding="utf-8")
    mission = library.add_file(copy)
    assert mission is not None
    if messages(mission, library) - messages(originals().library.get(bug.mission), originals().library):
        return True
    verdict = verdict_on(bug.mission, originals().with_changed(library, [bug.mission]))
    return not verdict.holds or bool(verdict.problems)


@pytest.mark.parametrize("number", sweep(range(len(PLANTED)), every=9))
def test_a_planted_bug_is_found(tmp_path: Path, number: int):
    bug = PLANTED[number]
    assert is_found(tmp_path, bug) is ((bug.kind, bug.mission) not in MISSED), bug


def test_there_are_60_of_ten_kinds_and_nearly_all_are_found():
    assert len(PLANTED) >= 60
    assert len({each.kind for each in PLANTED}) == 10
    assert len(MISSED) <= 3


@pytest.mark.parametrize("name", sweep(NAMES, every=6))
def test_nothing_is_found_in_the_originals(name: str):
    mission = originals().library.get(name)
    assert all(each.severity != ERROR for each in check(mission, originals().library, all_declarations()))
    verdict = verdict_on(name, originals())
    assert verdict.holds
    assert not verdict.problems
