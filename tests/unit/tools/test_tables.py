"""Tables in a page with what they were made on, and the rows behind them."""

from __future__ import annotations

import enum
import gzip
import math
from dataclasses import dataclass
from pathlib import Path

import pytest

from tools import tables
from tools.made_tables import figures_of


class Colour(enum.Enum):
    RED = "red"


@dataclass(frozen=True)
class Place:
    x: float
    near: bool


@dataclass(frozen=True)
class Walk:
    name: str
    colour: Colour
    steps: int
    metres: float
    over: bool
    touched: tuple[str, ...]
    overlap: dict[str, float]
    error: float | None
    end: Place | None


WALKS = [
    Walk('a "long", walk\nin | two lines', Colour.RED, 3, 0.1 + 0.2, True, ("sofa", "a, b"), {"den": 0.5},
         None, Place(1.0, False)),
    Walk("", Colour.RED, -1, math.inf, False, (), {}, 0.0, None),
]  # fmt: skip


@pytest.mark.parametrize("name", ["walks.csv", "rows/walks.csv.gz"])
def test_rows_are_read_back_as_they_were(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    tables.write_rows(file, Walk, WALKS * 2)
    tables.write_rows(file, Walk, WALKS)
    assert tables.read_rows(file, Walk) == WALKS
    before = file.read_bytes()
    tables.write_rows(file, Walk, WALKS)
    assert file.read_bytes() == before, "the same rows are the same bytes"


def test_a_reader_finds_a_column_for_each_field(tmp_path: Path) -> None:
    tables.write_rows(tmp_path / "walks.csv.gz", Walk, WALKS)
    head, *_, last = gzip.decompress((tmp_path / "walks.csv.gz").read_bytes()).decode().splitlines()
    assert head == "name,colour,steps,metres,over,touched,overlap,error,end.x,end.near"
    assert last == ",red,-1,inf,no,[],{},0.0,,"


def test_rows_of_other_fields_are_refused(tmp_path: Path) -> None:
    tables.write_rows(tmp_path / "places.csv", Place, [Place(1.0, True)])
    with pytest.raises(ValueError, match="has the columns"):
        tables.read_rows(tmp_path / "places.csv", Walk)


def test_what_stands_outside_the_marks_stays(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- drives -->\nold and longer\n<!-- end of drives -->\nafter\n")
    tables.write_between_marks(page, "drives", "new")
    assert page.read_text() == "before\n<!-- drives -->\n\nnew\n\n<!-- end of drives -->\nafter\n"
    with pytest.raises(ValueError, match="<!-- walks -->"):
        tables.write_between_marks(page, "walks", "new")


def test_a_table_says_what_it_was_made_on(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- crossing -->\n<!-- end of crossing -->\n")
    kept = tables.RowTable("crossing", Place, lambda rows: tables.table(["places"], [[str(len(rows))]]))
    kept.publish([Place(1.0, True)] * 3, page, "python tools/crossing.py --minutes 1")
    text = tables.text_between_marks(page, "crossing") or ""
    assert tables.without_made_line(text) == "| places |\n| --- |\n| 3 |"
    made = tables.made_of(text)
    assert made is not None and made.noted
    assert made.command == "python tools/crossing.py --minutes 1"
    assert made.depends == figures_of("crossing").depends
    assert made.commit == tables.COMMIT and len(made.date) == len("2026-11-28")
    assert tables.read_rows(tmp_path / "rows" / "crossing.csv.gz", Place) == [Place(1.0, True)] * 3


def test_a_table_of_rows_of_another_commit_says_that_one(tmp_path: Path) -> None:
    page = tmp_path / "people.md"
    page.write_text("<!-- crossing -->\n<!-- end of crossing -->\n")
    tables.write_table(page, "crossing", "| a |", "python tools/crossing.py", "1d2ed82a")
    made = tables.made_of(tables.text_between_marks(page, "crossing") or "")
    assert made is not None and made.commit == "1d2ed82a" and not made.changed


def test_without_a_page_rows_go_to_build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "BUILD", tmp_path)
    tables.RowTable("lost robots", Place, lambda rows: "").publish([Place(1.0, True)], None, "")
    assert tables.read_rows(tmp_path / "lost_robots.csv", Place) == [Place(1.0, True)]


def test_a_table_of_before_says_that_nobody_noted_the_commit() -> None:
    line = "*Made before 2026-11-23, on a commit that was not noted (these lines came with 1d2ed82a); "
    text = f"| a |\n\n{line}depends on `tools`, `config`.*"
    made = tables.made_of(text)
    assert made == tables.Made("2026-11-23", "1d2ed82a", False, False, "", ("tools", "config"))
    assert tables.without_made_line(text) == "| a |"
    assert tables.made_of("| a |") is None
