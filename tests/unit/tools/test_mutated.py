"""The table of small changes of missions is made mission by mission: the others keep their rows."""

from dataclasses import replace
from pathlib import Path

from tools.mutated import TABLE, Mutated, table_of, with_kept
from tools.tables import write_rows

ROOM = Mutated("goto_room", 4, 1, 2, 1, 0, 1, 0, 0, 1.0)
HOME = Mutated("go_home", 10, 0, 5, 0, 1, 2, 1, 1, 1.0)


def test_rows_of_other_missions_are_kept_in_the_order_of_the_missions(tmp_path: Path):
    file = TABLE.file_beside(tmp_path / "page.md")
    write_rows(file, Mutated, [HOME, ROOM])
    new = replace(HOME, tried=11)
    assert with_kept([new], file) == [new, ROOM]
    assert with_kept([new], tmp_path / "none.csv.gz") == [new]


def test_the_shares_are_of_what_is_not_equivalent():
    lines = table_of([HOME, ROOM]).splitlines()
    assert [each.strip() for each in lines[2].split("|")[-3:-1]] == ["75 %", "75 %"]
    assert [each.strip() for each in lines[3].split("|")[-3:-1]] == ["67 %", "100 %"]
    assert [each.strip() for each in lines[-1].split("|")[-3:-1]] == ["73 %", "82 %"]
