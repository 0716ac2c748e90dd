"""Files of declared skills: what they say comes back, and what is wrong with them is told."""

from types import SimpleNamespace

import pytest

from florence_bt.core.declaration import CodeGroup
from florence_bt.core.errors import ConfigError
from florence_bt.core.outcome import Outcome
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
    assert library.names() == ["m"]
    # A skill of Florence itself stays what it is.
    assert [(f.severity, f.line) for f in library.findings] == [("warning", 1)]
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


SHARED = """\
failures:
  no_path: {meaning: no way leads there, when: $error_code == 208}
  stuck: it does not move
groups:
  hopeless: {meaning: nothing helps, codes: [stuck, no_path]}
  unreachable: [no_path]
skills:
  go_there:
    inputs: {place: {type: text, names: room}}
    outputs: {seen: {type: text, default: nobody, names: hotspot, from: error_msg}}
    failures: [no_path, stuck]
    groups: [unreachable, hopeless]
    action: go
    type: nav2_msgs/action/NavigateToPose
    send: {behavior_tree: $place}
  go_on:
    failures: {stuck: it hangs, no_path: }
    groups: {unreachable: [no_path, stuck], hopeless: }
    reports_changes: true
"""


def test_a_file_says_once_what_codes_and_groups_of_several_skills_mean(written):
    read = read_skills_file(written(SHARED))
    assert read.findings == ()
    there, on = read.declarations.values()
    assert list(there.failures.items()) == [("no_path", "no way leads there"), ("stuck", "it does not move")]
    assert list(on.failures.items()) == [("stuck", "it hangs"), ("no_path", "no way leads there")]
    hopeless = CodeGroup("hopeless", frozenset({"stuck", "no_path"}), "nothing helps")
    assert there.groups == (CodeGroup("unreachable", frozenset({"no_path"})), hopeless)
    assert on.groups == (CodeGroup("unreachable", frozenset({"no_path", "stuck"})), hopeless)
    assert on.reports_changes and not there.reports_changes
    mapping = read.mappings["go_there"]
    answers = [SimpleNamespace(error_code=number, error_msg="") for number in (208, 100)]
    assert [mapping.result(answer, Outcome.FAILED).code for answer in answers] == ["no_path", "stuck"]
    assert (there.inputs["place"].names, there.outputs["seen"].names) == ("room", "hotspot")
    assert there.outputs["seen"].default == "nobody"


@pytest.mark.parametrize(
    ("before", "after", "says"),
    [
        (
            "[no_path, stuck]",
            "[no_path, stuk]",
            "11:25 what 'stuk' means is said neither here nor under failures",
        ),
        ("no_path: }", "jammed: }", "17:33 what 'jammed' means is said neither here nor under failures"),
        ("[unreachable, hopeless]", "[hopeles]", "12:14 what 'hopeles' means is said neither here nor"),
        ("[no_path, stuck]", "[no path]", "11:16 an item of failures must be a name of lower-case"),
        ("codes: [stuck, no_path]", "code: [stuck]", "5:38 unknown key of the group 'hopeless' 'code'"),
        ("codes: [stuck, no_path]", "codes: []", "5:13 the group 'hopeless' needs its codes"),
        ("names: room", "names: rom", "9:41 names cannot be 'rom'"),
        (
            "{type: text, names: room}",
            "{type: pose, names: room}",
            "9:41 only a text names a room or hotspot",
        ),
        ("it does not move", "[]", "3:10 failure stuck must be text"),
    ],
)
def test_what_is_wrong_with_what_skills_share(written, before, after, says):
    findings = read_skills_file(written(SHARED.replace(before, after, 1))).findings
    told = [f"{f.line}:{f.column} {f.message}" for f in findings]
    assert any(each.startswith(says) for each in told), told
    assert len(told) == len(set(told)), "each mistake is told once"


def test_labels_are_held_against_the_rooms_of_the_home(written, tmp_path):
    written(SHARED)
    written("mission: m\ntree: {go_there: {place: kitchn}}\n", "m.yaml")
    library = MissionLibrary.load([tmp_path], built_in=False)
    found = check(library.missions(), library, {}, ["kitchen", "hall"])
    assert [(f.line, f.valid) for f in found if "kitchn" in f.message] == [(2, ("kitchen",))]
