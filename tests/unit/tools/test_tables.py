"""Totals in a page, and single runs in a file of their own."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from tools import tables


def test_single_runs_can_be_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "BUILD", tmp_path / "build")
    head, rows = ["seed", "reason"], [["1", "no way, said | once"], ["2", 'a "quoted"\nreason']]
    tables.write_runs("walks", head, [["9", "of an earlier call"]] * 3)
    file = tables.write_runs("walks", head, iter(rows))
    assert file == tmp_path / "build" / "walks.csv"
    with file.open(newline="", encoding="utf-8") as lines:
        assert list(csv.reader(lines)) == [head, *rows]


def test_what_stands_outside_the_marks_stays(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- drives -->\nold\n<!-- end of drives -->\nafter\n")
    tables.write_between_marks(page, "drives", "new")
    assert page.read_text() == "before\n<!-- drives -->\n\nnew\n\n<!-- end of drives -->\nafter\n"
    with pytest.raises(ValueError, match="<!-- walks -->"):
        tables.write_between_marks(page, "walks", "new")
