"""Benchmarks and tools that bring whole systems up make small tables, too."""

from __future__ import annotations

import shutil
from contextlib import nullcontext
from pathlib import Path

import pytest

from tests.small_runs import BENCHMARKS, OVER_ROS, ROOT, module_of, page_with_marks, run_small_benchmarks
from tools.made_tables import FIGURES
from tools.tables import made_of, text_between_marks

# Three minutes of a processor: with the sweeps, for make test-all.
pytestmark = [pytest.mark.ros, pytest.mark.slow, pytest.mark.sweep, pytest.mark.timeout(1800)]

TRIED_IN = {"restarts": "tests/ros/test_restarts.py", "busy": "tests/unit/tools/test_busy.py"}
"""Attacks that need many processes of their own, and where they are tried."""


def test_benchmarks_over_ros(tmp_path: Path, ros_domain: int) -> None:
    mine = [each for each in BENCHMARKS if each.tables[0].endswith(OVER_ROS)]
    assert len(mine) == len(OVER_ROS)
    run_small_benchmarks(mine, tmp_path, "--domain", str(ros_domain))


def test_the_attacks_of_the_safety_campaign(tmp_path: Path, ros_domain: int) -> None:
    from tools.safety_campaign.running_system import RunningSystem

    attacks = [each for each in FIGURES if each.page == "notes/safety.md"]
    assert all((ROOT / file).exists() for file in TRIED_IN.values())
    with RunningSystem(1) as system:
        for figures in attacks:
            name = figures.tables[0]
            if name in TRIED_IN:
                continue
            page = page_with_marks(tmp_path, figures)
            words = [name, *figures.small.split(), "--write", str(page)]
            assert module_of(figures).main(words, lambda _seed: nullcontext(system)) == 0
            text = text_between_marks(page, name) or ""
            assert text.startswith("| ") and made_of(text) is not None


@pytest.mark.skipif(shutil.which("chromium") is None, reason="there is no browser: apt install chromium")
def test_presses_on_the_page(tmp_path: Path, ros_domain: int) -> None:
    (figures,) = (each for each in FIGURES if each.tables == ("presses",))
    page = page_with_marks(tmp_path, figures)
    words = ["presses", *figures.small.split(), "--write", str(page)]
    assert module_of(figures).main(words) == 0
    lines = (text_between_marks(page, "presses") or "").splitlines()
    (stops,) = (line for line in lines if line.startswith("| all |"))
    assert stops.startswith("| all | 1 | 0 | 0 |"), "one stop, not lost, every word true"


def test_the_figures_of_the_page(tmp_path: Path, ros_domain: int) -> None:
    (figures,) = (each for each in FIGURES if each.page == "notes/page.md")
    page = page_with_marks(tmp_path, figures)
    assert module_of(figures).main([*figures.small.split(), "--write", str(page)]) == 0
    text = text_between_marks(page, "figures") or ""
    assert "0 of 12 requests were served" in text and made_of(text) is not None
