"""Runs of the rig that are run again: real skills, a pause, and a person who takes the robot."""

from __future__ import annotations

import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.app.runs.check_run import check_run
from florence_bt.app.runs.run_to_scenario import run_to_scenario
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.runtime.run import MissionRequest
from tests.sweeps import sweep

pytestmark = pytest.mark.slow

RUNS = [
    ("goto_room", {"room": "kitchen"}, [(4.0, "pause"), (2.0, "resume"), (3.0, "stop")]),
    ("goto_user", {}, []),
    ("goto_user", {}, [(12.0, "pause"), (3.0, "resume"), (9.0, "override")]),
    ("patrol", {"rooms": "[kitchen]"}, [(40.0, "stop")]),
    ("night_check", {}, [(15.0, "pause"), (5.0, "resume")]),
    ("remind", {"text": "drink something"}, [(20.0, "stop")]),
]
"""Mission, inputs, and what people do after how many seconds."""


@pytest.mark.parametrize(("mission", "inputs", "acts"), sweep(RUNS, every=5))
def test_a_run_of_the_rig_is_run_again_and_is_a_scenario(tmp_path, mission, inputs, acts):
    rig = make_rig(seed=2, runs_folder=tmp_path)
    run = rig.executor.trigger(MissionRequest(mission, inputs, "rig"))
    for seconds, act in acts:
        rig.clock.advance(seconds)
        assert not run.status.final, "it would show nothing"
        getattr(rig.executor, act)(*(() if act == "resume" else ("a visitor",)))
    while not run.status.final:
        rig.clock.run_next()
    same, text = check_run(tmp_path, run.run_id)
    assert same, text
    run_to_scenario(tmp_path, run.run_id, tmp_path / "rig_scenarios.yaml")
    read = read_scenarios(tmp_path / "rig_scenarios.yaml", Libraries())
    assert [run_scenario(scenario).passed for scenario in read.scenarios] == [True]
