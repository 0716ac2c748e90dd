"""Every tool and benchmark that makes a table makes a small one: a rename breaks it here, at once.

Those that bring whole systems up are in ``tests/ros/test_small_runs_over_ros.py``.
"""

from __future__ import annotations

import re
import shlex
from itertools import pairwise
from pathlib import Path

import pytest

from florence_bt.core.geometry import Pose2
from tests.small_runs import BENCHMARKS, OVER_ROS, module_of, page_with_marks, run_small_benchmarks
from tools.code_figures import main as print_code_figures
from tools.generated_log import Conditions, drive, home
from tools.made_tables import FIGURES, Figures
from tools.tables import RowTable, made_of, read_rows, text_between_marks, without_made_line

ROOT = Path(__file__).resolve().parents[3]
MOST_BYTES = 2_000_000

NOT_HERE = {"colour": "test_colour_network.py"}
"""What cannot be made here, and the test beside this one that tries its parts."""
OF_TOOLS_THAT_ARE_GONE = ("trials", "late_trials", "drawn_trials", "new_trials", "new_trials_before")
"""Rows of tables that no command makes again."""
PAGES_OVER_ROS = ("notes/safety.md", "manual/safety.md", "notes/page.md")
"""Pages whose tables are made over ROS."""
MAKE_NO_TABLE = {
    "code_figures.py",  # prints one, below
    "colour_network",
    "editor_picture.py",
    "emulators",
    "figures.py",
    "first_hour.py",
    "page_pictures.py",
    "parameters_page.py",
    "person_network",
    "recovery_page.py",
    "drawn_people.py",
    "robot_picture.py",
    "setup.py",
    "skills_page.py",
    "terminal.py",
}

TOOLS = [each for each in FIGURES if each not in BENCHMARKS and each.page not in PAGES_OVER_ROS]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corrected log of CARMEN, of a drive through a generated home."""
    lines, stamp = [], 0.0
    records = drive(home(3), Conditions(), 60, seed=1)
    told = [records[0].reference]
    for one, two in pairwise(records):
        told.append(one.reference @ two.motion)
    for record, odom in zip(records, told, strict=True):
        ranges = " ".join(f"{min(each, 80.0):.2f}" for each in record.scan.ranges[30:210])
        pose = record.reference
        lines.append(f"ODOM {odom.x} {odom.y} {odom.yaw} 0 0 0 {stamp} host {stamp}")
        lines.append(f"FLASER 180 {ranges} {_text(pose)} {_text(pose)} {stamp} host {stamp}")
        lines.append("NEFF 10")
        stamp += 0.1
    file = tmp_path_factory.mktemp("log") / "small.log"
    file.write_text("\n".join(lines))
    return file


def _text(pose: Pose2) -> str:
    return f"{pose.x} {pose.y} {pose.yaw}"


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("figures", TOOLS, ids=lambda each: each.tables[0].replace(" ", "_"))
def test_a_tool_makes_its_tables(figures: Figures, tmp_path: Path, log: Path) -> None:
    if figures.tables[0] in NOT_HERE:
        assert Path(__file__).with_name(NOT_HERE[figures.tables[0]]).exists()
        return
    module, page = module_of(figures), page_with_marks(tmp_path, figures)
    small = [word.replace("LOG", str(log)) for word in shlex.split(figures.small)]
    assert module.main([*small, "--write", str(page)]) == 0
    kept = {each.name: each for each in vars(module).values() if isinstance(each, RowTable)}
    for name in figures.tables:
        text = text_between_marks(page, name) or ""
        assert text.startswith("| ") and made_of(text) is not None
        if name in kept:
            rows = read_rows(kept[name].file_beside(page), kept[name].row)
            assert rows and kept[name].text(rows) == without_made_line(text)


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_benchmarks_without_ros(tmp_path: Path) -> None:
    mine = [each for each in BENCHMARKS if not each.tables[0].endswith(OVER_ROS)]
    run_small_benchmarks(mine, tmp_path)


def test_the_code_in_figures_is_counted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["code_figures.py", str(ROOT / "florence_bt" / "core")])
    print_code_figures()
    assert re.search(r"\| all \| [1-9]\d+ \| [1-9]\d+ \|", capsys.readouterr().out)


def test_every_tool_and_benchmark_has_a_small_run() -> None:
    tools = {
        path.name
        for path in (ROOT / "tools").iterdir()
        if (path.suffix == ".py" and '__name__ == "__main__"' in path.read_text())
        or (path / "__main__.py").exists()
    }
    with_tables = {
        name if (ROOT / "tools" / name).is_dir() else f"{name.removesuffix('.py')}.py"
        for each in FIGURES
        if each not in BENCHMARKS
        for name in [re.split(r"tools[./]", each.tool)[1].split()[0]]
    }
    assert tools == with_tables | MAKE_NO_TABLE, "a tool that makes a table belongs to tools/made_tables.py"
    benchmarks = {path.stem for path in (ROOT / "benchmarks").glob("test_*.py")}
    assert benchmarks == {each.tables[0] for each in BENCHMARKS}


ROW_TABLES = [
    (figures, table)
    for figures in FIGURES
    if figures not in BENCHMARKS
    for table in vars(module_of(figures)).values()
    if isinstance(table, RowTable) and table.name in figures.tables
]


@pytest.mark.parametrize(("figures", "table"), ROW_TABLES, ids=[table.name for _, table in ROW_TABLES])
def test_a_table_follows_from_its_rows(figures: Figures, table: RowTable[object]) -> None:
    page = ROOT / "docs" / figures.page
    file = table.file_beside(page)
    made = made_of(text_between_marks(page, table.name) or "")
    if not file.exists():
        assert made is None or not made.noted, f"{table.name} was made with rows; there are none"
        return
    assert made is not None
    text = without_made_line(text_between_marks(page, table.name) or "")
    assert table.text(read_rows(file, table.row)) == text


def test_rows_are_kept_of_tables_only_and_are_small() -> None:
    files = list((ROOT / "docs").rglob("rows/*"))
    known = {table.file_beside(ROOT / "docs" / figures.page) for figures, table in ROW_TABLES}
    told = (ROOT / "docs" / "notes" / "figures.md").read_text()
    for file in set(files) - known:
        name = file.name.removesuffix(".csv.gz")
        assert name in OF_TOOLS_THAT_ARE_GONE and f"`{name}`" in told
    assert sum(file.stat().st_size for file in files) < MOST_BYTES
