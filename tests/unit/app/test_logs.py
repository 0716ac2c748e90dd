"""``florence logs``: lines of several files, by time, of the last bring-up, also of one that crashed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from florence_bt.app.logs.entries import entries_in
from florence_bt.app.logs.logs import LogReader
from florence_bt.cli.application import app
from florence_bt.core.errors import ConfigError

BEGUN = 1_000.0
NAVIGATION = """\
[INFO] [900.000000000] [florence_up]: the process navigation starts
a line of the bring-up before
[INFO] [1001.000000000] [florence_up]: the process navigation starts
[WARN] [1002.500000000] [navigate]: no path
[ERROR] [1004.000000000] [navigate]: a callback failed:
Traceback (most recent call last):
  ZeroDivisionError
"""
HARDWARE = """\
[INFO] [1001.500000000] [robot1.turtlebot_node]: opened /dev/create
Traceback (most recent call last):
  KeyError
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a bring-up that began at :data:`BEGUN`."""
    logs = tmp_path / "logs"
    logs.mkdir()
    (logs / "navigation.log").write_text(NAVIGATION)
    (logs / "hardware.log").write_text(HARDWARE)
    (tmp_path / "options.json").write_text("{}")
    os.utime(tmp_path / "options.json", (BEGUN, BEGUN))
    return tmp_path


def read(folder: Path, *names: str, level: str = "info", whole: bool = False) -> list[tuple[float, str, str]]:
    reader = LogReader(folder / "logs", names, level, whole=whole)
    return [(entry.when, entry.process, entry.lines[0]) for entry in reader.new()]


def test_the_lines_of_all_processes_come_by_time_and_without_those_of_earlier_bring_ups(folder):
    starts = "the process navigation starts"
    now = [
        (1001.0, "navigation", starts),
        (1001.5, "hardware", "opened /dev/create"),
        (1002.5, "navigation", "no path"),
        (1004.0, "navigation", "a callback failed:"),
    ]
    assert read(folder) == now
    assert read(folder, whole=True) == [(900.0, "navigation", starts), *now]


def test_a_traceback_belongs_to_the_line_before_and_makes_it_an_error(folder):
    (entry,) = entries_in(HARDWARE.splitlines(), "hardware", 0.0)
    assert entry.level == "error" and entry.lines[-1] == "  KeyError"
    assert read(folder, level="error") == [
        (1001.5, "hardware", "opened /dev/create"),
        (1004.0, "navigation", "a callback failed:"),
    ]


def test_what_is_no_time_is_a_line_like_others(folder):
    with (folder / "logs" / "hardware.log").open("a") as log:
        log.write("[INFO] [1764328145000000000.5] [other]: nanoseconds\n")
    done = CliRunner().invoke(app, ["logs", "--out", str(folder)])
    assert done.exit_code == 0 and "nanoseconds" in done.output


def test_a_process_or_a_node_can_be_chosen(folder):
    assert {process for _, process, _ in read(folder, "hardware")} == {"hardware"}
    assert [text for _, _, text in read(folder, "navigate")] == ["no path", "a callback failed:"]
    with pytest.raises(ConfigError, match=r"'navgate'.*navigate"):
        read(folder, "navgate")
    with pytest.raises(ConfigError, match=r"'warning'.*warn"):
        read(folder, level="warning")


def test_what_comes_later_is_read_once_and_a_half_line_not_before_it_is_whole(folder):
    reader = LogReader(folder / "logs", (), "info", whole=False)
    assert len(reader.new()) == 4 and reader.new() == []
    with (folder / "logs" / "people.log").open("w") as people:
        people.write("[INFO] [1005.000000000] [florenceLocator]: hel")
        people.flush()
        assert reader.new() == []
        people.write("lo\n")
    assert [entry.lines for entry in reader.new()] == [("hello",)]


def test_the_command_shows_them_and_finds_the_folder_of_a_robot(folder, tmp_path):
    result = CliRunner().invoke(app, ["logs", "--out", str(folder), "-n", "2"], catch_exceptions=False)
    assert result.exit_code == 0
    first, *rest = result.output.splitlines()
    assert "navigation" in first and "no path" in first and "ZeroDivisionError" in rest[-1]
    robot = tmp_path / "robot"
    (robot / "runs").mkdir(parents=True)
    (folder / "logs").rename(robot / "runs" / "logs")
    assert CliRunner().invoke(app, ["logs", "--out", str(robot)]).output.count("navigation") >= 3
    nowhere = CliRunner().invoke(app, ["logs", "--out", str(tmp_path / "nowhere")])
    assert nowhere.exit_code == 2 and "no logs" in nowhere.output
