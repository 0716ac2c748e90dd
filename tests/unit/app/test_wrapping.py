"""What is printed is broken at blanks, and nothing of it is lost."""

from __future__ import annotations

import pytest

from florence_bt.app.runs.where import Fact, as_text
from florence_bt.app.wrapping import hanging, in_columns

WHY = "no_path: no way leads to the kitchen: the door between the hall and the living_room is closed"
ROWS = [
    ("accepted (UTC)", "state", "took", "run", "why, or outputs"),
    ("2026-11-29 01:02:03", "FAILED", "104.5 s", "20261129T010203Z-001-goto_user", WHY),
    ("2026-11-29 01:00:00", "SUCCEEDED", "3.5 s", "20261129T010000Z-001-goto_room", ""),
]


@pytest.mark.parametrize("columns", [20, 40, 60, 80, 100, 132])
def test_no_word_is_broken_and_none_is_lost(columns: int) -> None:
    lines = "\n".join(in_columns(ROWS, columns)).splitlines()
    words = [word for row in ROWS for cell in row for word in cell.split()]
    assert [word for line in lines for word in line.split()] == words
    longest = max(map(len, words)) + 4
    assert all(len(line) <= max(columns, longest) for line in lines), lines


def test_a_wide_terminal_and_a_pipe_have_a_line_for_each_run() -> None:
    assert in_columns(ROWS, None) == in_columns(ROWS, 200) and len(in_columns(ROWS, None)) == len(ROWS)
    assert len({line.index("goto") for line in in_columns(ROWS, None)[1:]}) == 1, "in columns"


def test_what_one_asks_where_about_stays_in_its_column() -> None:
    facts = {"robot": Fact("in the kitchen, at (1.00 m, 2.00 m)"), "certainty": Fact(" ".join(["word"] * 30))}
    lines = as_text(facts, 60).splitlines()
    assert all(len(line) <= 60 for line in lines) and all(line.startswith(" " * 11) for line in lines[2:])
    assert as_text(facts).count("\n") == 1


def test_a_long_word_is_left_whole() -> None:
    assert hanging("see /a/very/long/path/that/one/copies now", 12).splitlines()[1].strip() == (
        "/a/very/long/path/that/one/copies"
    )


@pytest.mark.parametrize("columns", [60, 80])
def test_a_text_stays_in_its_column(columns: int) -> None:
    text = "night_check      " + " ".join(["Drive quietly to where the user is believed to be."] * 4)
    first, *rest = hanging(text, columns).splitlines()
    assert first.startswith("night_check      Drive") and rest
    assert all(line.startswith(" " * 17) and line[17] != " " and len(line) <= columns for line in rest)
