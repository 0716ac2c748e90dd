"""What docs/manual/assurance.md shows of a run, typed: its breakpoint, its replay, and two runs compared."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tools.first_hour import Block, transcript

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "manual" / "assurance.md").read_text(encoding="utf-8")
ELSEWHERE = tuple(f"$ florence {verb}" for verb in ("check", "verify", "mutate", "test", "sweep"))
"""What the test of pages without a robot types, and a sweep, which takes a minute for each run."""


def is_typed(block: Block) -> bool:
    return not block.text.startswith(ELSEWHERE)


@pytest.mark.ros
@pytest.mark.slow
def test_a_run_is_stepped_run_again_and_compared_as_the_page_shows(ros_domain: int, tmp_path: Path) -> None:
    for name in ("examples", "hotspots"):
        (tmp_path / name).symlink_to(ROOT / name)
    environment = {
        **os.environ,
        "COLUMNS": "100",
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
        "ROS_DOMAIN_ID": str(ros_domain),
    }
    said = "\n".join(new for _, new in transcript(PAGE, tmp_path, environment, is_typed))
    assert "paused because: a breakpoint before" in said and said.count("goes on to its next leaf") == 2
    assert "my_round: STOPPED" in said
    assert "the same, in all of its" in said
    assert "label='kitchne' in A, label='kitchen' in B" in said and "ends, unknown_hotspot" in said
