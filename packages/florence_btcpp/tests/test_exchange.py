"""``florence import`` and ``florence export`` as a user types them."""

import json

import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import FAILED, OK, USAGE

TREE = """<root BTCPP_format="4">
<BehaviorTree ID="Fetch">
<Sequence><Open what="{door}"/>{more}</Sequence>
</BehaviorTree></root>
"""


@pytest.fixture
def florence():
    runner = CliRunner()
    return lambda *arguments: runner.invoke(app, [str(each) for each in arguments])


@pytest.fixture
def xml(tmp_path):
    def write(more="<Grab/>"):
        path = tmp_path / "fetch it.xml"
        path.write_text(TREE.replace("{more}", more))
        return path

    return write


def test_import_writes_missions_and_the_skills_that_are_lacking(florence, xml, tmp_path):
    folder = tmp_path / "new" / "missions"
    done = florence("import", xml(), "-o", folder)
    assert done.exit_code == OK
    assert done.stdout.splitlines() == [
        f"1 mission written to {folder}: fetch",
        "2 skills declared that this installation lacks",
        f"next: florence check {folder}",
    ]
    assert sorted(path.name for path in folder.iterdir()) == ["fetch.yaml", "fetch_it.skills.yaml"]
    checked = florence("check", folder)
    assert checked.exit_code == OK and checked.stdout.count("declared but not implemented") == 2
    one = florence("check", folder / "fetch.yaml")
    assert one.exit_code == OK and one.stdout.count("declared but not implemented") == 2
    assert florence("draw", folder / "fetch.yaml").exit_code == OK
    exported = florence("export", folder / "fetch.yaml")
    assert exported.exit_code == OK and '<Action ID="open" what="{door}"/>' in exported.stdout


def test_import_does_not_replace_files_unless_told(florence, xml, tmp_path):
    assert florence("import", xml(), "-o", tmp_path / "m").exit_code == OK
    (tmp_path / "m" / "fetch.yaml").write_text("mine")
    again = florence("import", xml(), "-o", tmp_path / "m")
    assert again.exit_code == USAGE and "--overwrite" in again.stderr
    assert (tmp_path / "m" / "fetch.yaml").read_text() == "mine"
    assert florence("import", xml(), "-o", tmp_path / "m", "--overwrite").exit_code == OK
    assert (tmp_path / "m" / "fetch.yaml").read_text() != "mine"


def test_what_is_lost_is_told_with_its_line_and_strict_writes_nothing(florence, xml, tmp_path):
    file, folder = xml('<UnsetBlackboard key="x"/>'), tmp_path / "m"
    strict = florence("import", file, "-o", folder, "--strict")
    assert strict.exit_code == FAILED and not folder.exists()
    assert f"{file}:3:32: warning: UnsetBlackboard: a key keeps its value" in strict.stderr
    assert "    3 | <Sequence><Open" in strict.stderr and "1 thing lost" in strict.stderr
    assert florence("import", file, "-o", folder).exit_code == OK
    told = florence("import", file, "-o", folder, "--overwrite", "--format", "json")
    severities = [finding["severity"] for finding in json.loads(told.stdout)]
    assert "warning" in severities and "1 mission written" in told.stderr
    assert (
        "::warning file="
        in florence("import", file, "-o", folder, "--overwrite", "--format", "github").stdout
    )


def test_import_of_what_cannot_be_imported(florence, xml, tmp_path):
    broken = florence("import", xml("<Inverter/>"), "-o", tmp_path / "m")
    assert broken.exit_code == FAILED and "must have exactly one node below it" in broken.stderr
    assert not (tmp_path / "m").exists()
    (tmp_path / "page.html").write_text("<html/>")
    for arguments, text in (
        (["import", tmp_path / "none.xml", "-o", tmp_path], "there is no such file"),
        (["import", tmp_path / "page.html", "-o", tmp_path], "the file begins with <html>"),
        (["import", xml(), "-o", xml()], "cannot be written"),
        (["import", xml(), "-o", tmp_path / "m", "--format", "pdf"], "there is no format 'pdf'"),
        (["import", xml(), "-o", tmp_path / "m", "--model", tmp_path / "none.xml"], "there is no such file"),
        (["export", "goto_usr"], "goto_user"),
        (["export", "goto_user", "-o", tmp_path / "none" / "a.xml"], "cannot be written"),
    ):
        done = florence(*arguments)
        assert done.exit_code == USAGE and text in done.stderr, (arguments, done.stderr)


def test_export_and_import_again(florence, tmp_path):
    done = florence("export", "goto_user", "-o", tmp_path / "g.xml")
    assert done.exit_code == OK
    assert "g.xml written with 10 trees: goto_user, go_near, detect_user, meet_user" in done.stdout
    assert "FlorenceRetry, which must be registered" in done.stderr
    back = florence("import", tmp_path / "g.xml", "-o", tmp_path / "m", "--strict")
    assert back.exit_code == OK and "the main one is goto_user" in back.stdout
    checked = florence("check", tmp_path / "m")
    assert checked.exit_code == OK and "error:" not in checked.stdout


def test_export_that_loses_something(florence, tmp_path):
    mission = tmp_path / "m.yaml"
    mission.write_text(
        "mission: m\ninputs: {room: {type: text}}\ntree: {get_hotspot: {label: 'the $room'}}\n"
    )
    done = florence("export", mission, "-o", tmp_path / "m.xml", "--strict")
    assert done.exit_code == FAILED and not (tmp_path / "m.xml").exists()
    assert f"{mission}:3:8: warning: label: BehaviorTree.CPP does not compute values of ports" in done.stderr
    assert florence("export", mission, "-o", tmp_path / "m.xml").exit_code == OK


def test_export_of_a_mission_with_errors_names_the_place(florence, tmp_path):
    mission = tmp_path / "m.yaml"
    for tree, text in (
        ("{turn: {angle: soon}}", "m.yaml:2:8: an angle is needed, not 'soon'"),
        ("{trun: {}}", "m.yaml:2:8: unknown skill 'trun' (would have worked: turn)"),
        ("{run: goto_rom}", "m.yaml:2:8: there is no mission 'goto_rom'"),
        ("{run: m}", "m.yaml:2:8: the mission 'm' calls itself: m -> m"),
    ):
        mission.write_text(f"mission: m\ntree: {tree}\n")
        done = florence("export", mission)
        assert done.exit_code == USAGE and text in done.stderr, done.stderr


def test_a_mission_file_finds_those_beside_it(florence, tmp_path):
    (tmp_path / "inner.yaml").write_text("mission: inner\ntree: {wait: 1 s}\n")
    (tmp_path / "outer.yaml").write_text("mission: outer\ntree: {run: inner}\n")
    done = florence("export", tmp_path / "outer.yaml")
    assert done.exit_code == OK and '<BehaviorTree ID="inner">' in done.stdout
    assert "wait 1 s" in florence("draw", tmp_path / "outer.yaml", "--expand").stdout


def test_export_replaces_an_export_and_nothing_else(florence, tmp_path):
    out = tmp_path / "tree.xml"
    for _ in range(2):
        assert florence("export", "goto_room", "-o", str(out)).exit_code == 0
    notes, link = tmp_path / "notes.txt", tmp_path / "link.xml"
    notes.write_text("mine\n")
    link.symlink_to(out)
    before = out.read_bytes()
    for refused in (notes, link, tmp_path):
        assert florence("export", "goto_room", "-o", str(refused)).exit_code == 2
    assert notes.read_text() == "mine\n" and link.is_symlink() and out.read_bytes() == before
