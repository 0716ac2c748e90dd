"""Files of declared skills: what they say comes back, and what is wrong with them is told."""

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.declared_skills import is_skills_file, read_skills_file
from florence_bt.trees.language.loader import MissionLibrary


@pytest.fixture
def written(tmp_path):
    def write(text, name="mine.skills.yaml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_what_is_wrong_is_told(written):
    path = written(
        "skils: 1\nskills:\n  Grab: {}\n  wait: {}\n  grab:\n    sumary: x\n    deadline: soon\n"
        "    instant: maybe\n    inputs: {a: {type: lenght}}\n  wave: {deadline: 0 s}\n"
    )
    assert [f"{f.line}:{f.column} {f.message}" for f in read_skills_file(path).findings] == [
        "1:1 unknown key of a file of skills 'skils'",
        "3:3 a skill must be a name of lower-case letters, digits and underscores, not 'Grab'",
        "4:3 a skill cannot be called 'wait': that is a word of the language",
        "6:5 unknown key of the skill 'grab' 'sumary'",
        "9:24 the type of 'a' cannot be 'lenght'",
        "7:15 deadline: a duration is needed, not 'soon'",
        "8:14 instant cannot be 'maybe'",
        "10:20 the deadline must be above zero",
    ]
    assert set(read_skills_file(path).declarations) == {"grab", "wave"}
    for text in ("[]", "skills: []", "mission: x"):
        assert read_skills_file(written(text)).findings
    with pytest.raises(ConfigError, match="not YAML"):
        read_skills_file(written("skills: {"))


def test_the_library_reads_them_and_the_check_says_which_are_lacking(written, tmp_path):
    written("skills: {grab: {inputs: {what: {type: text}}}, turn: {}}")
    written(
        "mission: m\ntree: {sequence: [{grab: {what: cup}}, {grab: {what: jar}}, {turn: {angle: 1 rad}}]}\n",
        "m.yaml",
    )
    assert is_skills_file(tmp_path / "mine.skills.yaml") and not is_skills_file(tmp_path / "skills.yaml")
    library = MissionLibrary.load([tmp_path], built_in=False)
    assert library.names() == ["m"] and library.findings == []
    found = check(library.missions(), library, collect_declarations())
    assert [(f.severity, f.line, f.message) for f in found] == [
        ("warning", 2, "the skill 'grab' is declared but not implemented on this robot (no_skill)")
    ]
    alone = MissionLibrary()
    alone.add_file(tmp_path / "m.yaml")
    assert set(alone.declarations) == {"grab", "turn"}


def test_a_broken_file_of_skills_does_not_take_the_missions_away(written, tmp_path):
    written("skills: {")
    written("mission: m\ntree: {wait: 1 s}\n", "m.yaml")
    library = MissionLibrary.load([tmp_path], built_in=False)
    assert library.names() == ["m"]
    assert [f.file for f in library.findings] == [str(tmp_path / "mine.skills.yaml")]
