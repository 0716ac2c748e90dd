"""A newcomer's way from nothing to a mission of their own: docs/manual/first_hour.md, word for word.

The set-up is not repeated: the environment of the tests stands for what ``make setup`` makes, and the page
says how long that takes. Nor is the demonstration, which test_system runs: a robot finds its person once.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

from tools.first_hour import Block, transcript

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "manual" / "first_hour.md").read_text(encoding="utf-8")
WAY = PAGE[: PAGE.index("The robot stands in the kitchen.")]
SETUP_S, DEMO_S = 180.0, 60.0
"""What the page says that the set-up and the demonstration take."""


def is_typed(block: Block) -> bool:
    return not block.text.startswith(("$ make setup", "$ florence demo"))


@pytest.mark.ros
@pytest.mark.slow
def test_a_newcomer_has_a_mission_that_runs_in_fifteen_minutes(ros_domain: int, tmp_path: Path) -> None:
    for name in ("examples", "hotspots", ".venv"):
        (tmp_path / name).symlink_to((ROOT / name).resolve())
    environment = {
        **os.environ,
        "COLUMNS": "100",
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "ROS_DOMAIN_ID": str(ros_domain),
    }
    started = time.monotonic()
    typed = {block.text: new for block, new in transcript(WAY, tmp_path, environment, is_typed)}
    assert SETUP_S + DEMO_S + time.monotonic() - started < 15 * 60

    said = "\n".join(typed.values())
    assert "$ florence check my_missions\n1 mission checked: no problem found\n" in said
    assert "evening_round: SUCCEEDED" in said
    assert "the robot says: Good night." in said and "robot      in kitchen" in said
    offline = [text for text in typed if text.startswith(("$ florence check", "$ florence test"))]
    assert offline and all(typed[text] == text for text in offline), "it does not say what the page shows"
