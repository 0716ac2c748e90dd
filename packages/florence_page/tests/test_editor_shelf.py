"""Where the editor reads and keeps missions: names, old versions, drafts, and somebody else's changes."""

from __future__ import annotations

from datetime import datetime, timedelta

import pytest
from florence_page.editor.shelf import DRAFTS, MOST_MISSION_VERSIONS, VERSIONS, ChangedMeanwhile, Shelf

from florence_bt.core.errors import ConfigError

TEXT = "mission: tea\ntree:\n  wait: 1 s\n"


class Days:
    """A date that goes on with each question."""

    def __init__(self):
        self.now = datetime(2026, 11, 27, 12, 0)

    def __call__(self):
        self.now += timedelta(minutes=1)
        return self.now


@pytest.fixture
def shelf(tmp_path):
    return Shelf(tmp_path / "missions", date=Days())


@pytest.mark.parametrize(
    "name", ["../tea", "tea/..", "/etc/passwd", "Tea", "", ".tea", "tea.yaml", "t" * 61, "tea\n"]
)
def test_only_names_of_missions_are_taken(shelf, tmp_path, name):
    for act in (shelf.open, shelf.versions, lambda each: shelf.save(each, TEXT, ""), shelf.scenarios_of):
        with pytest.raises(ConfigError):
            act(name)
    with pytest.raises(ConfigError):
        shelf.save_draft(name, TEXT)
    assert list(tmp_path.iterdir()) == []


def test_a_save_keeps_what_stood_there(shelf):
    first = shelf.save("tea", TEXT, "")
    assert first.before is None and first.file.read_text() == TEXT
    second = shelf.save("tea", TEXT.replace("1 s", "2 s"), first.print)
    assert second.before.read_text() == TEXT and second.before.parent == shelf.own / VERSIONS / "tea"
    (date,) = shelf.versions("tea")
    assert shelf.version("tea", date) == TEXT
    assert shelf.save("tea", TEXT.replace("1 s", "2 s"), second.print).before is None
    with pytest.raises(ConfigError):
        shelf.version("tea", "../../tea")


def test_only_so_many_versions_are_kept_and_the_latest_are(shelf):
    known = ""
    for number in range(MOST_MISSION_VERSIONS + 3):
        known = shelf.save("tea", TEXT.replace("1 s", f"{number} s"), known).print
    dates = shelf.versions("tea")
    assert len(dates) == MOST_MISSION_VERSIONS
    assert f"wait: {MOST_MISSION_VERSIONS + 1} s" in shelf.version("tea", dates[0])


def test_what_somebody_else_has_written_meanwhile_stays(shelf):
    shelf.save("tea", TEXT, "")
    opened = shelf.open("tea")
    (shelf.own / "tea.yaml").write_text("mission: tea\ntree:\n  wait: 9 s\n")
    with pytest.raises(ChangedMeanwhile):
        shelf.save("tea", TEXT.replace("1 s", "2 s"), opened.print)
    assert "9 s" in (shelf.own / "tea.yaml").read_text()


def test_a_draft_is_no_mission_until_it_is_saved(shelf):
    draft = shelf.save_draft("tea", "mission: tea\ntree:\n  wat")
    assert draft.parent == shelf.own / DRAFTS and not list(shelf.own.glob("*.yaml"))
    assert shelf.drafts() == ["tea"]
    assert shelf.open("tea").draft.startswith("mission: tea")
    shelf.save("tea", TEXT, "")
    assert shelf.drafts() == [] and shelf.open("tea").draft is None


def test_a_draft_that_another_text_takes_the_place_of_is_kept(shelf):
    drafts = ["mission: tea\ntree:\n  mine\n", "mission: tea\ntree:\n  yours\n"]
    shelf.save_draft("tea", drafts[0])
    shelf.save_draft("tea", drafts[0])
    assert shelf.versions("tea") == [], "it is the same text"
    shelf.save_draft("tea", drafts[1])
    shelf.save("tea", TEXT, "")
    assert [shelf.version("tea", date) for date in shelf.versions("tea")] == drafts[::-1]


def test_a_shipped_mission_is_read_and_never_written(shelf):
    opened = shelf.open("goto_user")
    assert not opened.own and "mission: goto_user" in opened.text
    saved = shelf.save("goto_user", opened.text, "")
    assert saved.file == shelf.own / "goto_user.yaml" and opened.file.read_text() == opened.text
    assert shelf.open("goto_user").own


def test_a_link_is_not_written_through(shelf, tmp_path):
    other = tmp_path / "other.yaml"
    other.write_text(TEXT)
    shelf.own.mkdir()
    (shelf.own / "tea.yaml").symlink_to(other)
    with pytest.raises(ConfigError):
        shelf.save("tea", TEXT.replace("1 s", "2 s"), shelf.open("tea").print)
    assert other.read_text() == TEXT


def test_a_text_that_is_too_long_or_no_text_is_refused(shelf):
    for text in ("# " + "x" * 100_000, TEXT + "\0", TEXT + "\ud800" + "\x1b"):
        with pytest.raises(ConfigError):
            shelf.save("tea", text, "")
    assert not list(shelf.own.glob("*.yaml")) if shelf.own.exists() else True


def test_a_scenario_takes_the_place_of_no_other(shelf):
    files = [shelf.save_scenario("tea", "left_on", f"number: {number}\n") for number in range(3)]
    assert [file.name for file in files] == ["tea.yaml", "tea_left_on.yaml", "tea_left_on_2.yaml"]
    assert [file.read_text() for file in files] == [f"number: {number}\n" for number in range(3)]
    assert shelf.scenarios_of("tea") == files[0]
    for name, kind in (("../tea", "left_on"), ("tea", "left/on")):
        with pytest.raises(ConfigError):
            shelf.save_scenario(name, kind, "x: 1\n")


def test_no_scenario_is_written_through_a_link(shelf, tmp_path):
    (tmp_path / "outside").mkdir()
    shelf.own.mkdir()
    shelf.scenarios.symlink_to(tmp_path / "outside")
    with pytest.raises(ConfigError, match="link"):
        shelf.save_scenario("tea", "left_on", "x: 1\n")


@pytest.mark.parametrize("name", [DRAFTS, VERSIONS, f"{VERSIONS}/tea"])
def test_a_folder_that_is_a_link_is_not_written_into(shelf, tmp_path, name):
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "tea.yaml").write_text("theirs\n")
    known = shelf.save("tea", TEXT, "").print
    (shelf.own / name).parent.mkdir(exist_ok=True)
    (shelf.own / name).symlink_to(outside)
    with pytest.raises(ConfigError, match="link"):
        shelf.save_draft("tea", TEXT.replace("1 s", "2 s"))
        shelf.save_draft("tea", TEXT.replace("1 s", "3 s"))
    with pytest.raises(ConfigError, match="link"):
        shelf.save("tea", TEXT.replace("1 s", "4 s"), known)
    assert shelf.open("tea").text == TEXT
    assert {file.name: file.read_text() for file in outside.iterdir()} == {"tea.yaml": "theirs\n"}
