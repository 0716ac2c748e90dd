from pathlib import Path

import pytest

import florence_bt.skills
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.declared_skills import read_skills_file
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary


def test_the_built_in_missions():
    library = MissionLibrary.load()
    assert {"approach_user", "detect_user", "goto_pose", "goto_room", "goto_user"} <= set(library.names())
    assert all(mission.description for mission in library)
    assert library.get("goto_user").file == BUILT_IN / "goto_user.yaml"


def test_later_folders_shadow_earlier_ones(tmp_path):
    for folder, text in (("a", "one"), ("b", "two")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "m.yaml").write_text(f"mission: m\ndescription: {text}\ntree: {{fail: x}}\n")
    library = MissionLibrary.load([tmp_path / "a", tmp_path / "b"], built_in=False)
    assert [mission.description for mission in library.missions()] == ["two"]


def test_unknown_missions_and_folders(tmp_path):
    with pytest.raises(ConfigError) as error:
        MissionLibrary.load().get("goto_usr")
    assert "goto_user" in error.value.valid
    with pytest.raises(ConfigError, match="no folder of missions"):
        MissionLibrary.load([tmp_path / "gone"])


def test_one_broken_file_does_not_take_the_others_away(tmp_path):
    (tmp_path / "bad.yaml").write_text("a: [\n")
    (tmp_path / "good.yaml").write_text("mission: good\ntree: {fail: x}\n")
    library = MissionLibrary.load([tmp_path], built_in=False)
    assert library.names() == ["good"]
    assert [finding.file for finding in library.findings] == [str(tmp_path / "bad.yaml")]
    with pytest.raises(ConfigError, match="not YAML"):
        library.get("bad")
    (tmp_path / "bad.yaml").write_text("mission: bad\ntree: {fail: x}\n")
    assert library.add_file(tmp_path / "bad.yaml") is library.get("bad")


def test_a_file_is_parsed_again_only_when_it_has_changed(tmp_path):
    file = tmp_path / "m.yaml"
    file.write_text("mission: m\ndescription: one\ntree: {fail: x}\n")
    first = MissionLibrary.load([tmp_path]).get("m")
    again = MissionLibrary.load([tmp_path])
    assert again.get("m") is first, "the same mission"
    file.write_text("mission: m\ndescription: two\ntree: {fail: x}\n")
    assert again.add_file(file).description == "two"
    assert first.description == "one"
    (tmp_path / "elsewhere").mkdir()
    copy = file.rename(tmp_path / "elsewhere" / "m.yaml")
    assert MissionLibrary.load([copy.parent]).get("m").file == copy, "another file with the same text"


def test_a_mission_may_call_those_that_lie_beside_its_file_and_so_may_they(tmp_path):
    calls = {"first": ["known", "second", "nowhere"], "second": ["first", "third"], "third": ["known"]}
    for name, called in calls.items():
        runs = ", ".join(f"{{run: {one}}}" for one in called)
        (tmp_path / f"{name}.yaml").write_text(f"mission: {name}\ntree: {{sequence: [{runs}]}}\n")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "known.yaml").write_text("mission: known\ntree: {wait: 1 s}\n")
    library = MissionLibrary.load([tmp_path / "elsewhere"], built_in=False)
    library.add_neighbours([library.add_file(tmp_path / "first.yaml")])
    assert sorted(library.names()) == ["first", "known", "second", "third"]


def test_our_own_skills_are_declared_once_and_without_mistakes():
    files = list(Path(florence_bt.skills.__file__).parent.rglob("*.skills.yaml"))
    declared = own_declarations()
    assert {"navigate_to", "turn", "look_for_user"} <= declared.keys() and not declared.findings
    assert sum(len(read_skills_file(file).declarations) for file in files) == len(declared)
    assert own_declarations() is declared, "read once"
