"""What tests have seen of a mission: nodes, outcomes, failure codes."""

import pytest

from florence_bt.mission_testing import MissionTester
from florence_bt.mission_testing.coverage import Coverage, Share, coverage_text, total_of
from florence_bt.mission_testing.record import FAILURE, SKIPPED, STOPPED, SUCCESS
from florence_bt.trees import kinds
from florence_bt.trees.checks.outcomes import possible_outcomes
from florence_bt.trees.language.loader import MissionLibrary

MISSION = """
mission: fetch
description: Drives, or says so.
tree:
  name: try it
  selector:
    - navigate_to: {goal: {x: 1 m, y: 2 m, yaw: 0 deg}}
      finally:
        stop_tracker:
    - wait: 1 s
"""


@pytest.fixture
def stage(tmp_path):
    stage = MissionTester(scratch=tmp_path)
    stage.load(MISSION)
    stage.defaults(navigate_to="running 3 s, then SUCCESS", stop_tracker="running 1 s, then SUCCESS")
    return stage


def missing(stage):
    """Title -> what was not seen of it."""
    coverage = Coverage()
    coverage.add_mission(stage.library.get("fetch"), stage.library)
    coverage.add_runs(stage.runs)
    (report,) = coverage.report(stage.declarations)
    return report, {node.title: node.missing for node in report.nodes}


def test_nothing_was_seen(stage):
    report, nodes = missing(stage)
    assert nodes == {
        "try it": (SUCCESS, STOPPED),  # a wait cannot fail, so neither can the whole
        "navigate to": (SUCCESS, FAILURE, STOPPED),
        "stop tracker": (SUCCESS, FAILURE, STOPPED),
        "wait 1 s": (SUCCESS, STOPPED),
    }
    assert (str(report.nodes_seen), str(report.outcomes_seen)) == ("0/4", "0/10")
    assert "fetch.yaml:7:7: navigate to: was never reached" in coverage_text([report])


def test_each_kind_of_run_adds_what_it_shows(stage):
    stage.run("fetch").assert_succeeded()
    report, nodes = missing(stage)
    assert nodes["navigate to"] == (FAILURE, STOPPED)
    assert str(report.nodes_seen) == "3/4"
    stage.mock("navigate_to", "running 1 s, then FAILURE no_path")
    stage.mock("stop_tracker", "FAILURE tracker_failed")
    stage.run("fetch").assert_succeeded()
    report, nodes = missing(stage)
    assert nodes == {
        "try it": (STOPPED,), "navigate to": (STOPPED,), "stop tracker": (STOPPED,), "wait 1 s": (STOPPED,),
    }  # fmt: skip
    assert "navigate to: was never stopped while running" in coverage_text([report])
    assert "never failed with goal_occupied" in coverage_text([report], codes=True)
    assert next(node for node in report.nodes if node.title == "stop tracker").missing_codes == ()


def test_a_stop_counts_for_every_node_that_was_running(stage):
    stage.start("fetch")
    stage.advance(1)
    stage.stop()
    stage.run_until_done()
    _, nodes = missing(stage)
    assert nodes["try it"] == (SUCCESS,)
    assert nodes["navigate to"] == (SUCCESS, FAILURE)
    assert nodes["stop tracker"] == (FAILURE, STOPPED), "the clean-up beside the tree counts"


def test_runs_of_a_mission_within_another_count_for_it():
    stage = MissionTester()
    stage.defaults(get_hotspot="SUCCESS (pose=(0 m, 0 m, 0 deg))", navigate_to="SUCCESS")
    stage.run("goto_room", room="x")
    coverage = Coverage()
    coverage.add_mission(stage.library.get("goto_pose"), stage.library)
    coverage.add_runs(stage.runs)
    (report,) = coverage.report(stage.declarations)
    assert (report.name, report.nodes_seen.seen) == ("goto_pose", 0)


GUARDED = """
mission: fetch
description: Waits when it should.
inputs:
  far: {type: length, default: 1 m}
tree:
  sequence:
    - wait: 1 s
      when: $far > 2 m
    - wait: 2 s
"""


def test_what_a_guard_skips_was_not_reached(tmp_path):
    stage = MissionTester(scratch=tmp_path)
    stage.load(GUARDED)
    stage.run("fetch").assert_succeeded().assert_duration(2)
    assert missing(stage)[1]["wait 1 s"] == (SUCCESS, STOPPED)
    stage.run("fetch", far="3 m").assert_succeeded().assert_duration(3)
    assert missing(stage)[1]["wait 1 s"] == (STOPPED,)
    stage = MissionTester(scratch=tmp_path)
    stage.load(GUARDED)
    stage.run("fetch", far="3 m")
    assert missing(stage)[1]["wait 1 s"] == (STOPPED, SKIPPED)


def test_shares_add_up():
    assert Share(1, 3) + Share(2, 3) == Share(3, 6)
    assert (Share(3, 6).percent, Share(0, 0).percent, str(Share(3, 6))) == (50.0, 100.0, "3/6")
    assert total_of([]).percent == 100.0


def test_a_fail_that_a_guard_skips_is_not_asked_to_succeed(tmp_path):
    file = tmp_path / "picky.yaml"
    file.write_text(
        "mission: picky\ninputs: {n: {type: integer}}\n"
        "tree:\n  sequence: [{fail: too many, when: $n > 2}, {wait: 1 s}]\n"
    )
    library = MissionLibrary.load([tmp_path])
    [fail] = [
        outcomes
        for node, outcomes in possible_outcomes(library.get("picky"), library, {})
        if isinstance(node, kinds.Fail)
    ]
    assert (fail.success, fail.failure, fail.skipped) == (False, True, True)
