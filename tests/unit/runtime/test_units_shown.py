"""What people read of a run has units: its inputs, what its nodes wrote, what its skills were given."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.runtime.events import EventKind, seconds_text
from florence_bt.runtime.journal.rows import JournaledEvent
from florence_bt.runtime.journal.text import timeline
from florence_bt.runtime.status import details_line, status_text, values_text

MISSION = """\
inputs:
  patience: {type: duration, default: 10 min}
  angle: {type: angle, default: 45 deg}
  ways: {type: list of length, default: "1.5 m, 2 m"}
  times: {type: integer, default: 3}
  who: {type: text, default: Anna}
tree:
  sequence:
    - set: {far: 1.5 m, pause: $patience, number: $times}
    - switch: $far
      cases:
        2 m: {wait: 1 s}
"""


def test_inputs_and_keys_of_a_run(bench, tmp_path: Path) -> None:
    run = bench.run_text(MISSION)
    assert details_line(run) == ("inputs patience=10 min angle=45 deg ways=[1.5 m, 2 m] times=3 who='Anna'")
    text = status_text(run, run.tree, bench.clock.now())
    assert "far = 1.5 m, pause = 10 min, number = 3" in text
    assert "the value is 1.5 m; there are cases for: 2 m" in text


def test_the_start_of_a_run_says_what_its_inputs_are(bench) -> None:
    bench.run_text(MISSION)
    (start,) = [event for event in bench.events if event.kind is EventKind.STARTED]
    assert start.data["kinds"]["patience"] == "duration"


def test_skills_in_the_timeline() -> None:
    declaration = SkillDeclaration(
        "go", "", {"far": Port(Kind.LENGTH, "")}, {"took": Port(Kind.DURATION, "")}
    )
    begin = JournaledEvent(1, 0.0, 1, "skill_started", "m/go", "", "", "", "", "go", {"far": 1.5}, {}, {})
    end = JournaledEvent(
        2, 3.0, 1, "skill_ended", "m/go", "", "", "ok", "", "go", {}, {"took": 3.0}, {"outcome": "succeeded"}
    )
    (line,) = timeline([begin, end], {"go": declaration})
    assert line.strip() == "+0.0 s  go far=1.5 m at m/go: ok after 3.0 s -> took=3 s"
    (line,) = timeline([begin, end])
    assert "far=1.5 at" in line


def test_poses() -> None:
    pose = {"x": 1.0, "y": 2.5, "yaw": 1.5707963267948966}
    assert values_text({"goal": pose}, {"goal": Kind.POSE}) == " goal=(x 1 m, y 2.5 m, yaw 90 deg)"


@pytest.mark.parametrize(
    ("port", "value", "problem"),
    [
        (Port(Kind.DURATION, "", maximum=15.0), 60.0, "1 min is above the maximum of 15 s"),
        (Port(Kind.ANGLE, "", minimum=0.0), -1.5707963267948966, "-90 deg is below the minimum of 0 deg"),
        (Port(Kind.INTEGER, "", minimum=1), 0, "0 is below the minimum of 1"),
        (Port(Kind.DURATION, ""), 2e8, "2e+08 s is not between -1e+08 s and 1e+08 s"),
    ],
)
def test_limits(port: Port, value: float, problem: str) -> None:
    assert port.problem_with(value) == problem


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.04, "0.0 s"),
        (119.9, "119.9 s"),
        (120.0, "2 min 0 s"),
        (150.4, "2 min 30 s"),
        (179.7, "3 min 0 s"),
        (3_661.0, "61 min 1 s"),
    ],
)
def test_the_time_that_a_run_took(seconds, text):
    assert seconds_text(10.0, 10.0 + seconds) == text
    assert seconds_text(None, seconds) == seconds_text(seconds, None) == ""
