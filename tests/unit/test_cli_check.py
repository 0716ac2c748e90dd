"""``florence check`` and ``florence schema`` as they are typed."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import FAILED, OK, USAGE

GOOD = "mission: {name}\ndescription: A test.\ntree:\n  wait: 1 s\n"
WARNS = "mission: {name}\ntree:\n  set: {{seen: true}}\n"


@pytest.fixture
def florence():
    def call(*arguments, stdin=None):
        words = [str(argument) for argument in arguments]
        return CliRunner().invoke(app, words, input=stdin, catch_exceptions=False)

    return call


@pytest.fixture
def mission(tmp_path):
    def write(name, text=GOOD):
        file = tmp_path / f"{name}.yaml"
        file.write_text(text.format(name=name))
        return file

    return write


def test_warnings_count_only_when_asked(florence, mission):
    file = mission("warns", WARNS)
    done = florence("check", file)
    assert done.exit_code == OK and "0 errors, 1 warning" in done.stdout
    assert florence("check", file, "--strict").exit_code == FAILED
    assert florence("check", mission("fine"), "--strict").exit_code == OK


def test_the_offending_line_is_shown(florence, mission):
    file = mission("wrong", "mission: {name}\ntree:\n  wate: 1 s\n")
    done = florence("check", file)
    assert done.stdout == (
        f"{file}:3:3: error: there is no skill and no kind of node 'wate'\n"
        "    3 |   wate: 1 s\n"
        "      |   ^^^^\n"
        "      = would have worked: wait\n"
        "1 mission checked: 1 error, 0 warnings\n"
    )
    (finding,) = json.loads(florence("check", file, "--format", "json").stdout)
    assert finding["text"] == "wate" and finding["valid"] == ["wait"]


def test_the_standard_input(florence, tmp_path):
    done = florence("check", "-", stdin=GOOD.format(name="any"))
    assert done.exit_code == OK and "1 mission checked: no problem found" in done.stdout
    done = florence("check", "-", stdin="mission: any\ntree:\n  wate: 1 s\n")
    assert done.exit_code == FAILED
    assert "<stdin>:3:3: error" in done.stdout and "    3 |   wate: 1 s" in done.stdout
    for text in ("", "a: [", "mission: [a]\n", "tree: {wait: 1 s}\n"):
        done = florence("check", "-", stdin=text)
        assert done.exit_code == FAILED and "<stdin>:1:" in done.stdout, done.stdout
    assert "byte 0xff is not UTF-8" in florence("check", "-", stdin=b"a: \xff").stdout


def test_the_standard_input_with_the_name_of_its_file(florence, mission, tmp_path):
    mission("helper")
    file = tmp_path / "mine.yaml"
    done = florence("check", "-", "--stdin-name", file, stdin="mission: other\ntree: {run: helper}\n")
    assert done.exit_code == FAILED
    assert f"{file}:1:10: error: the mission is called 'other' but its file is mine.yaml" in done.stdout
    assert "helper" not in done.stdout


def test_the_line_shown_is_of_the_standard_input_and_not_of_the_file_on_the_disk(florence, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("mission: mine\ndescription: of the disk\n")
    data = "mission: mine\ndescription: für mich\n".encode("latin-1")
    done = florence("check", "-", "--stdin-name", file, stdin=data)
    assert done.exit_code == FAILED
    assert "    2 | description: f\ufffdr mich\n      |               ^\n" in done.stdout
    assert "of the disk" not in done.stdout


def test_missions_beside_the_file_and_of_other_folders_may_be_called(florence, mission, tmp_path):
    mission("second")
    caller = mission("caller", "mission: {name}\ntree: {{sequence: [{{run: first}}, {{run: far}}]}}\n")
    mission("first", "mission: {name}\ntree: {{run: second}}\n")
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "far.yaml").write_text(GOOD.format(name="far"))
    assert "there is no mission 'far'" in florence("check", caller).stdout
    assert florence("check", caller, "--missions", tmp_path / "more").exit_code == OK
    mission("first", "mission: [")
    done = florence("check", caller, "--missions", tmp_path / "more")
    assert done.exit_code == FAILED and "the mission 'first' cannot be read" in done.stdout


def test_labels_of_an_unknown_flat_are_warned_of_and_of_a_known_one_refused(florence, mission, tmp_path):
    file = mission("go", "mission: {name}\ntree: {{run: goto_room, with: {{room: attic}}}}\n")
    done = florence("check", file)
    assert done.exit_code == OK and "warning: there is no hotspot 'attic'" in done.stdout
    assert "give --hotspots FILE" in done.stdout
    spots = tmp_path / "spots" / "mine.yaml"
    spots.parent.mkdir()
    spots.write_text("hotspots:\n- {label: kitchen, x: 1, y: 2}\n")
    done = florence("check", file, "--hotspots", spots)
    assert done.exit_code == FAILED and f"there is no hotspot 'attic' in {spots}" in done.stdout
    spots.write_text("hotspots:\n- {label: attic, x: 1, y: 2}\n")
    assert florence("check", file, "--hotspots", spots).exit_code == OK


def test_hotspots_and_poses_must_be_where_the_map_is_free(florence, mission, tmp_path):
    numpy = pytest.importorskip("numpy")
    from florence_bt.core.geometry import Pose2
    from florence_bt.core.sensing import OccupancyGrid
    from florence_bt.skills.navigation.map_server.map_writer import save_map

    folder = tmp_path / "flat"
    folder.mkdir()
    save_map(OccupancyGrid(0.1, Pose2(), numpy.zeros((50, 50), numpy.int8)), folder / "map.yaml")
    (folder / "spots.yaml").write_text("hotspots:\n- {label: a, x: 1, y: 2}\n- {label: b, x: 9, y: 2}\n")
    options = ("--map", folder / "map.yaml", "--hotspots", folder / "spots.yaml")
    done = florence("check", mission("fine"), *options)
    assert done.exit_code == FAILED
    assert f"{folder / 'spots.yaml'}:3:3: error: the hotspot 'b' is outside the map" in done.stdout
    assert "    3 | - {label: b, x: 9, y: 2}" in done.stdout
    go = mission("go", "mission: {name}\ntree: {{navigate_to: {{goal: {{x: 9 m, y: 0, yaw: 0}}}}}}\n")
    done = florence("check", go, "--map", folder / "map.yaml")
    assert done.exit_code == FAILED and "this pose is outside the map map.yaml" in done.stdout
    assert florence("check", go, "--map", folder / "none.yaml").exit_code == USAGE


def test_the_schema_is_printed_or_written(florence, mission, tmp_path):
    mission("mine")
    (tmp_path / "mine.skills.yaml").write_text("skills: {ring_bell: {summary: Ring.}}\n")
    printed = json.loads(florence("schema", "--missions", tmp_path).stdout)
    assert {"turn", "dock_robot", "ring_bell"} <= printed["definitions"]["node"]["properties"].keys()
    out = tmp_path / "mission.schema.json"
    done = florence("schema", "-o", out, "--missions", tmp_path)
    assert done.exit_code == OK and done.stdout == f"{out} written\n"
    assert json.loads(out.read_text()) == printed
    assert "mine" in printed["definitions"]["node"]["properties"]["run"]["anyOf"][0]["enum"]
    assert florence("schema", "-o", tmp_path / "no" / "s.json").exit_code == USAGE
    assert florence("schema", "--hotspots", tmp_path / "none.yaml").exit_code == USAGE


def test_a_called_mission_that_cannot_run_is_told_at_its_call(florence, tmp_path):
    (tmp_path / "broken.yaml").write_text("mission: broken\ntree: {wait: 5}\n")
    (tmp_path / "between.yaml").write_text("mission: between\ntree: {run: broken}\n")
    file = tmp_path / "outer.yaml"
    file.write_text("mission: outer\ntree: {sequence: [{wait: 1 s}, {run: between}]}\n")
    done = florence("check", file)
    assert done.exit_code == FAILED
    assert f"{file}:2:38: error: the mission 'broken' has errors; the first one: " in done.stdout
    assert "broken.yaml:2:14: wait: a duration needs a unit: '5'" in done.stdout
    # Checked together each error is told once, in its own place.
    done = florence("check", tmp_path)
    assert done.exit_code == FAILED and "has errors" not in done.stdout
    assert done.stdout.endswith("3 missions checked: 1 error, 0 warnings\n")
