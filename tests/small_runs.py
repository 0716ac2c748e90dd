"""The small runs of what makes tables: shared by the tests that need ROS and those that do not."""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from tools.made_tables import FIGURES, Figures
from tools.tables import made_of, text_between_marks

ROOT = Path(__file__).resolve().parents[1]
OVER_ROS = ("drivers", "recording", "ros", "stack", "start")
"""Benchmarks that start ROS nodes."""
BENCHMARKS = [each for each in FIGURES if each.write == "--figures"]


def module_of(figures: Figures) -> ModuleType:
    """Return the module of a tool."""
    tool = figures.tool.split()[0] if not figures.tool.startswith("-m ") else figures.tool.split()[1]
    name = tool.removesuffix(".py").replace("/", ".")
    return importlib.import_module(
        name if (ROOT / f"{name.replace('.', '/')}.py").exists() else f"{name}.__main__"
    )


def page_with_marks(folder: Path, figures: Figures) -> Path:
    page = folder / Path(figures.page).name
    page.write_text("\n".join(f"<!-- {name} -->\n<!-- end of {name} -->" for name in figures.tables))
    return page


def run_small_benchmarks(mine: Sequence[Figures], folder: Path, *options: str) -> None:
    """Run benchmarks as they are run for the page, only small: each writes its table."""
    (page := folder / "benchmarks.md").write_text("# Figures\n")
    files = [each.tool.split()[-1] for each in mine]
    words = ["-m", "pytest", *files, "--benchmark-only", "--small", "--figures", str(page), "-q", *options]
    # pytest-benchmark measures nothing in a worker of xdist, which the process would take itself for.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_XDIST")}
    done = subprocess.run(
        [sys.executable, *words], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=900
    )
    assert done.returncode == 0, done.stdout + done.stderr
    for each in mine:
        text = text_between_marks(page, each.tables[0])
        assert text is not None and made_of(text) is not None, f"{each.tables[0]}: {done.stdout}"
        assert "failed" not in text, text
