"""The tables of benchmarks: no row is lost when another benchmark fails."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.figures_page import Figures, merged
from tools.tables import made_of, text_between_marks, without_made_line

ROOT = Path(__file__).resolve().parents[3]
BEFORE = """| what | measured | remark |
| --- | --- | --- |
| a | 1 s | limit 2 s |
| of a broken one | 3 s |  |
| older | 4 s | of an earlier run, 2026-11-20 on 11111111 |
| `test_old` | **failed** | a mock |

*Made 2026-11-25 on c479dae6 by `python -m pytest benchmarks`; depends on `benchmarks`.*"""

PAGE = f"# Figures\n\n<!-- test_bench_check -->\n\n{BEFORE}\n\n<!-- end of test_bench_check -->\n"

BENCHMARKS = """
def test_good(benchmark, figures):
    benchmark.pedantic(lambda: None, rounds=1)
    figures.add("a", "2 s", "limit 2 s")

def test_missed(benchmark, figures):
    benchmark.pedantic(lambda: None, rounds=1)
    figures.add("b", "9 s")
    figures.limit(9.0, most=2.0)
"""
BROKEN = """
def test_broken(benchmark, figures):
    benchmark.pedantic(lambda: None, rounds=1)
    assert not "a mock | of before"
"""


def rows_of(text: str) -> list[tuple[str, ...]]:
    lines = without_made_line(text).splitlines()[2:]
    return [tuple(cell.strip() for cell in line[1:-1].split(" | ")) for line in lines]


def run(folder: Path, code: str, *options: str) -> tuple[int, str]:
    (folder / "test_bench_check.py").write_text(code)
    (page := folder / "page.md").write_text(PAGE)
    words = ["-p", "benchmarks.conftest", "-p", "no:cacheprovider", "--rootdir", str(folder), "--figures"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", str(folder), *words, str(page), *options],
        cwd=ROOT,
        check=False,
        capture_output=True,
        text=True,
    )
    assert done.returncode in (0, 1), done.stdout + done.stderr
    return done.returncode, text_between_marks(page, "test_bench_check") or ""


def test_one_that_fails_is_told_and_takes_no_row_away(tmp_path: Path) -> None:
    code, text = run(tmp_path, BENCHMARKS + BROKEN)
    assert code == 1
    now, missed, broken, kept, older = rows_of(text)
    assert now == ("a", "2 s", "limit 2 s")
    assert missed == ("b", "9 s (**missed**)", "")
    assert broken[:2] == ("`test_broken`", "**failed**") and "a mock / of before" in broken[2]
    assert kept == ("of a broken one", "3 s", "of an earlier run, 2026-11-25 on c479dae6")
    assert older == ("older", "4 s", "of an earlier run, 2026-11-20 on 11111111")
    made = made_of(text)
    assert made is not None and made.noted and made.commit != "c479dae6"


def test_a_whole_run_has_no_rows_of_before(tmp_path: Path) -> None:
    _, text = run(tmp_path, BENCHMARKS)
    assert [row[0] for row in rows_of(text)] == ["a", "b"]


def test_what_was_left_out_stays(tmp_path: Path) -> None:
    _, text = run(tmp_path, BENCHMARKS, "-k", "missed")
    assert [row[:2] for row in rows_of(text)] == [
        ("b", "9 s (**missed**)"), ("a", "1 s"), ("of a broken one", "3 s"), ("older", "4 s"),
    ]  # fmt: skip


def test_a_file_that_cannot_be_imported_is_told(tmp_path: Path) -> None:
    (tmp_path / "test_bench_check.py").write_text("")
    (tmp_path / "page.md").write_text(PAGE)
    words = ["-p", "benchmarks.conftest", "-p", "no:cacheprovider", "--rootdir", str(tmp_path)]
    (tmp_path / "test_bench_check.py").write_text("from tools.tables import write_runs\n")
    subprocess.run(
        [sys.executable, "-m", "pytest", str(tmp_path), *words, "--figures", str(tmp_path / "page.md")],
        cwd=ROOT,
        check=False,
        capture_output=True,
    )
    rows = rows_of(text_between_marks(tmp_path / "page.md", "test_bench_check") or "")
    assert rows[0][:2] == ("`test_bench_check.py`", "**failed**") and "write_runs" in rows[0][2]
    assert [row[0] for row in rows[1:]] == ["a", "of a broken one", "older"]


def test_a_small_run_measures_too_little_for_limits(tmp_path: Path) -> None:
    code, text = run(tmp_path, BENCHMARKS, "--small")
    assert code == 0 and "missed" not in text


def test_limits_hold_on_both_sides() -> None:
    Figures.limit(1.0, least=1.0, most=1.0)
    for sides in ({"least": 1.1}, {"most": 0.9}):
        with pytest.raises(pytest.fail.Exception, match="1 is"):
            Figures.limit(1.0, **sides)


def test_the_first_table_of_a_file_has_no_rows_of_before() -> None:
    figures = Figures()
    figures.add("a", "1 s")
    assert merged(figures, "").splitlines()[2:] == ["| a | 1 s |  |"]
