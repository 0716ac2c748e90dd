"""``florence verify`` takes names, files and folders, and says whether everything holds."""

from pathlib import Path

import pytest

from florence_bt.app.mission_files.verifying import VerifyOptions, verify_missions
from florence_bt.core.errors import ConfigError

GOOD = "mission: good\ndescription: Turn.\ntree:\n  turn: {angle: 90 deg}\n"
BAD = "mission: bad\ndescription: Turn.\ntree:\n  retry: forever\n  do: {turn: {angle: 90 deg}}\n"
WRONG = "mission: wrong\ndescription: Sing.\ntree:\n  sing:\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "good.yaml").write_text(GOOD)
    (tmp_path / "bad.yaml").write_text(BAD)
    return tmp_path


def test_a_shipped_mission_by_its_name():
    report, holds = verify_missions(["goto_pose"], VerifyOptions())
    assert holds
    assert report.startswith("goto_pose: holds")


def test_a_folder_holds_only_if_all_of_it_holds(folder: Path):
    report, holds = verify_missions([str(folder)], VerifyOptions())
    assert not holds
    assert "good: holds" in report
    assert "bad: BROKEN" in report
    assert verify_missions([str(folder / "good.yaml")], VerifyOptions())[1]


def test_the_way_is_shown_with_the_line_and_written_as_a_scenario(folder: Path):
    found = folder / "found"
    report, _ = verify_missions([str(folder / "bad.yaml")], VerifyOptions(scenarios=found))
    assert f"{folder / 'bad.yaml'}:4" in report
    assert "turn: FAILURE" in report
    [file] = found.iterdir()
    assert str(file) in report


def test_a_table_has_a_line_for_each_mission(folder: Path):
    report, _ = verify_missions([str(folder)], VerifyOptions(table=True))
    assert [line.split("|")[1].strip() for line in report.splitlines()[2:]] == ["`bad`", "`good`"]


def test_what_the_check_refuses_is_not_explored(folder: Path):
    (folder / "wrong.yaml").write_text(WRONG)
    with pytest.raises(ConfigError) as refused:
        verify_missions([str(folder / "wrong.yaml")], VerifyOptions())
    assert refused.value.line == 4


def test_a_file_that_cannot_be_read_is_told_and_not_what_is_only_a_warning(folder: Path):
    """Neither is it left out of its folder in silence."""
    file = folder / "goto_room.yaml"  # which shadows a shipped one
    file.write_text("mission: goto_room\ntree:\n  say: hello\n    text: hello\n")
    for given in (file, folder):
        with pytest.raises(ConfigError, match="not YAML") as refused:
            verify_missions([str(given)], VerifyOptions())
        assert (refused.value.file, refused.value.line) == (str(file), 4)


@pytest.mark.parametrize("name", ["nosuch", "nosuch.yaml", "empty"])
def test_there_is_no_such_mission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(ConfigError):
        verify_missions([name], VerifyOptions())
