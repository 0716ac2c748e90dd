"""A problem is shown by the way to it, and by a scenario that goes this way and fails there."""

from pathlib import Path

import pytest

from florence_bt.assurance.replay import replay
from florence_bt.assurance.report import text_of
from florence_bt.assurance.scenario import write_scenario
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios

LOOK = "look_for_user: {}\n      out: {user: user, distance: far, posture: posture}\n"
BROKEN = {
    "missing_key": f"  sequence:\n    - {LOOK}      on_failure:\n        any: {{wait: 1 s}}\n"
    "    - run: approach_user\n      with: {user: $user}\n",
    "behind_a_comparison": f"  sequence:\n    - {LOOK}    - if: $far > 2 m and $far < 3 m\n"
    "      then: {set: {x: $unset}}\n",
    "behind_a_text": f'  sequence:\n    - {LOOK}    - if: $posture == "lying"\n'
    "      then: {set: {x: $unset}}\n",
    "late": "  timeout: 20 s\n  do: {navigate_to: {goal: {x: 1 m, y: 0 m, yaw: 0 deg}}}\n"
    "  on_failure:\n    timed_out: {set: {x: $unset}}\n",
    "endless_retry": "  retry: forever\n  do: {turn: {angle: 90 deg}}\n",
    "left_on": "  sequence:\n    - start_tracker:\n    - look_for_user: {}\n",
    "left_on_by_a_stop": "  sequence:\n    - start_tracker:\n    - wait: 1 min\n    - stop_tracker:\n",
    "called": "  run: goto_room\n  with: {room: kitchen}\n"
    "  on_failure:\n    unknown_hotspot: {set: {x: $unset}}\n",
}


@pytest.mark.parametrize("name", BROKEN)
def test_the_scenario_fails_for_the_same_reason(verify, tmp_path: Path, name: str):
    verdict = verify(BROKEN[name])
    problem = verdict.broken[0]
    file = tmp_path / "scenarios" / "it.yaml"
    assert write_scenario(verdict.explored, problem, file), text_of(verdict)
    read = read_scenarios(file, Libraries())
    assert not read.findings
    [scenario] = read.scenarios
    result = run_scenario(scenario)
    assert not result.passed
    started = [call.skill for call in replay(verdict.explored, problem.path).calls if call.skill != "finally"]
    assert result.runs[0].order[: len(started)] == started


def test_nothing_is_written_for_what_no_scenario_shows(verify, tmp_path: Path):
    """That a mission which is called leaves something on cannot be seen where it is mocked whole."""
    verdict = verify(
        "  run: inner\n", inner="tree:\n  sequence:\n    - start_tracker:\n    - look_for_user: {}\n"
    )
    [problem] = verdict.broken
    file = tmp_path / "it.yaml"
    assert not write_scenario(verdict.explored, problem, file)
    assert not file.exists()


def test_the_longest_run_takes_the_longest_time(verify):
    verdict = verify(
        "  sequence:\n    - turn: {angle: 90 deg}\n    - wait: 10 s\n    - turn: {angle: 90 deg}\n"
    )
    assert verdict.longest_s == pytest.approx(70.0)
    assert "70" in text_of(verdict, details=True).splitlines()[-1]
