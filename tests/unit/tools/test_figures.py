"""Which tables of figures are old, and that every table in the docs is one that can be told."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from tools import figures
from tools.figures import State, changes_since, chosen, make_all, tables
from tools.made_tables import FIGURES, Figures
from tools.tables import Made, text_between_marks

ROOT = Path(__file__).resolve().parents[3]
MOST_BYTES = 2_000_000


def commit(root: Path, file: str, text: str) -> str:
    (root / file).parent.mkdir(parents=True, exist_ok=True)
    (root / file).write_text(text)
    git = ["git", "-C", str(root), "-c", "user.name=x", "-c", "user.email=x@x"]
    subprocess.run([*git, "add", "."], check=True)
    subprocess.run(
        [*git, "commit", "-qm", f"{file}: {text}"],
        check=True,
        env={**os.environ, "GIT_COMMITTER_DATE": "2026-03-02T12:00:00Z"},
    )
    told = subprocess.run(
        [*git, "rev-parse", "--short=8", "HEAD"], check=True, capture_output=True, text=True
    )
    return told.stdout.strip()


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    commit(tmp_path, "used/a.py", "1")
    return tmp_path


def made(on: str, date: str = "2026-03-02") -> Made:
    return Made(date, on, noted=True, changed=False, command="", depends=())


def test_a_table_is_old_when_what_it_depends_on_has_changed(checkout: Path) -> None:
    begin = commit(checkout, "other.py", "1")
    assert changes_since(made(begin), ["used"], checkout) == ()
    commit(checkout, "other.py", "2")
    assert changes_since(made(begin), ["used"], checkout) == ()
    commit(checkout, "used/a.py", "2")
    last = commit(checkout, "used/b.py", "3")
    found = changes_since(made(begin), ["used"], checkout)
    assert len(found) == 2 and found[0].startswith(last[:7]) and found[0].endswith("used/b.py: 3")


def test_of_a_commit_that_a_clone_does_not_have_the_date_counts(checkout: Path) -> None:
    assert len(changes_since(made("12345678"), ["used"], checkout)) == 1
    assert changes_since(made("12345678", "2026-03-03"), ["used"], checkout) == ()


def write_page(root: Path, name: str, line: str) -> None:
    page = root / "docs" / figures.FIGURES[0].page
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text(f"<!-- {name} -->\n\n| a |\n\n{line}\n\n<!-- end of {name} -->\n")


def test_the_list_tells_old_from_new_and_what_was_never_made(
    checkout: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = Figures("notes/x.md", ("one", "two"), "tools/x.py", "", "", ("used",))
    monkeypatch.setattr(figures, "FIGURES", (mine,))
    on = commit(checkout, "other.py", "1")
    line = f"*Made 2026-11-28 on {on} by `python tools/x.py`; depends on `used`.*"
    write_page(checkout, "one", line)
    one, two = tables(checkout)
    assert (one.state, two.state) == (State.UP_TO_DATE, State.MISSING)
    assert chosen("one", [one, two]) == [] and chosen("x", [one, two]) == [mine]
    commit(checkout, "used/a.py", "2")
    one, _ = tables(checkout)
    assert one.state is State.OLD
    told = f"notes/x.md: one, made 2026-11-28 on {on}; 1 changes since, the last: {one.changes[0]}"
    assert one.told() == f"old            {told}"
    assert chosen("all", [one, two]) == [mine], "one command makes both"
    write_page(checkout, "one", line.replace(" by", " with changes by"))
    assert next(tables(checkout)).state is State.OLD
    with pytest.raises(ValueError, match="there are all, one, two, x"):
        chosen("three", [one, two])


def test_those_that_measure_times_are_made_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def of(name: str, *, alone: bool) -> Figures:
        return Figures("notes/x.md", (name,), name, "", "", (), alone=alone)

    running: list[str] = []
    seen: dict[str, tuple[str, ...]] = {}

    def fake(each: Figures) -> str:
        running.append(each.tool)
        seen[each.tool] = tuple(running)
        running.remove(each.tool)
        return "ended with 1" if each.tool == "b" else ""

    monkeypatch.setattr(figures, "make", fake)
    todo = [of("a", alone=True), of("b", alone=False), of("c", alone=True), of("d", alone=False)]
    assert make_all(todo) == ["ended with 1"]
    assert list(seen)[2:] == ["a", "c"] and seen["a"] == ("a",) and seen["c"] == ("c",)


def test_what_is_not_here_is_told_and_nothing_is_run() -> None:
    far = Figures("notes/x.md", ("x",), "tools/x.py", "--log ../nowhere/a.log", "", ())
    assert figures.make(far) == "not here: ../nowhere/a.log"


@pytest.mark.parametrize(("arguments", "code"), [([], 0), (["--only", "all"], 2)])
def test_without_a_repository_nothing_is_said_to_be_up_to_date(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int
) -> None:
    monkeypatch.setattr(figures, "COMMIT", "")
    assert figures.main(arguments) == code
    told = capsys.readouterr()
    assert told.out == "" and "cannot be told" in told.err


def test_every_table_in_the_docs_says_what_it_was_made_on_and_depends_on() -> None:
    found = list(tables())
    assert found
    for table in found:
        if table.made is None:
            text = text_between_marks(ROOT / "docs" / table.figures.page, table.name)
            assert text is not None and "|" not in text, f"{table.name} says not what it was made on"
            continue
        assert table.made.depends == table.figures.depends, f"{table.name}: change the line below it, too"
        if table.made.noted:
            assert table.made.command.startswith(f"python {table.figures.tool}"), table.name


@pytest.mark.parametrize("each", FIGURES, ids=lambda each: each.tables[0])
def test_what_a_table_depends_on_is_there(each: Figures) -> None:
    for path in each.depends:
        assert (ROOT / path).exists(), f"{each.tables[0]} depends on {path}"
    assert len({name for one in FIGURES for name in one.tables}) == sum(len(one.tables) for one in FIGURES)
