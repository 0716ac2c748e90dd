"""Small missions are explored in every way, and what does not hold is found with the way to it."""

import math

import pytest

from florence_bt.assurance.explorer import Limits

DRIVE = "  run: goto_room\n  with: {room: kitchen}"


def kinds(verdict, severity="broken"):
    return [each.kind for each in verdict.problems if each.severity == severity]


def test_a_drive_holds_and_has_the_codes_of_its_skills(verify):
    verdict = verify(DRIVE)
    assert verdict.holds
    assert {"no_path", "battery", "unknown_hotspot", "timed_out"} <= verdict.codes
    assert verdict.longest_s == pytest.approx(180.0)


def test_a_code_that_is_caught_does_not_occur(verify):
    verdict = verify(f"{DRIVE}\n  on_failure:\n    unreachable: {{wait: 1 s}}")
    assert verdict.holds
    assert "no_path" not in verdict.codes
    assert "battery" in verdict.codes


def test_a_key_that_one_way_does_not_set(verify):
    verdict = verify(
        "  sequence:\n"
        "    - look_for_user: {}\n"
        "      out: {user: place}\n"
        "      on_failure:\n"
        "        any: {wait: 1 s}\n"
        "    - run: approach_user\n"
        "      with: {user: $place}\n"
    )
    [problem] = verdict.broken
    assert problem.kind == "missing_key"
    assert any(
        each.result is not None and not each.result.succeeded for e in problem.path for each in e.happened
    )


def test_both_answers_of_a_comparison_are_explored(verify):
    verdict = verify(
        "  sequence:\n"
        "    - look_for_user: {}\n"
        "      out: {distance: far}\n"
        "    - if: $far > 1 m\n"
        "      then: {fail: far away, code: far}\n"
        "      else: {fail: near, code: near}\n"
    )
    assert {"far", "near"} <= verdict.codes
    assert verdict.holds


def test_what_was_decided_stays_so_and_limits_follow(verify):
    verdict = verify(
        "  sequence:\n"
        "    - look_for_user: {}\n"
        "      out: {distance: far}\n"
        "    - condition: $far > 2 m\n"
        "    - if: $far < 1 m\n"
        "      then: {fail: it cannot be, code: impossible}\n"
        "    - if: $far <= 2 m\n"
        "      then: {fail: it cannot be either, code: impossible}\n"
    )
    assert "impossible" not in verdict.codes
    assert kinds(verdict, "warning") == ["unreachable", "unreachable"]


def test_a_retry_that_nothing_ends(verify):
    endless = "  retry: forever\n  do: {turn: {angle: 90 deg}}\n"
    assert kinds(verify(endless)) == ["endless_retry"]
    assert verify(endless.replace("forever", "3")).holds
    within = "  timeout: 1 min\n  do:\n    retry: forever\n    do: {turn: {angle: 90 deg}}\n"
    assert verify(within).holds


def test_a_repeat_that_swallows_every_failure(verify):
    swallowing = (
        "  repeat: forever\n  do:\n    turn: {angle: 90 deg}\n    on_failure:\n      any: {wait: 1 s}\n"
    )
    assert kinds(verify(swallowing)) == ["endless_retry"]
    looking = "  repeat: forever\n  do:\n    sequence:\n      - get_robot_pose:\n      - succeed:\n"
    assert verify(f"{looking}          turn: {{angle: 90 deg}}\n").holds


def test_a_look_up_that_is_tried_again_without_a_pause(verify):
    spins = "  retry: forever\n  do: {get_robot_pose: }\n"
    assert kinds(verify(spins)) == ["spinning"]
    assert verify(f"{spins}  between: {{wait: 1 s}}\n").holds


def test_who_waits_for_people_may_wait_for_ever(verify):
    verdict = verify("  retry: forever\n  on: [no_answer]\n  do: {wait_for_answer: {time_limit: 1 min}}\n")
    assert verdict.holds
    assert math.isinf(verdict.longest_s)


def test_a_circle_that_only_time_goes_round(verify):
    assert kinds(verify("  repeat: forever\n  do: {wait: 1 s}\n")) == ["endless"]


def test_a_tracker_that_is_left_on(verify):
    tree = "  sequence:\n    - start_tracker:\n    - look_for_user: {}\n"
    verdict = verify(tree)
    assert kinds(verdict) == ["left_on"]
    assert verify(f"{tree}  finally:\n    stop_tracker:\n").holds


def test_a_tracker_that_is_left_on_where_its_start_is_not_answered(verify):
    verdict = verify(
        "  sequence:\n    - start_tracker:\n    - look_for_user: {}\n      finally:\n        stop_tracker:\n"
    )
    assert kinds(verdict) == ["left_on"]
    happened = [each for edge in verdict.broken[0].path for each in edge.happened]
    assert [each.skill for each in happened if each.what == "start"] == ["start_tracker"]


def test_a_step_of_a_clean_up_that_fails_before_the_next(verify):
    verdict = verify(
        "  start_tracker:\n  finally:\n    sequence:\n      - turn: {angle: 90 deg}\n      - stop_tracker:\n"
    )
    assert "cleanup" in kinds(verdict)


def test_an_output_that_a_success_leaves_open(verify):
    verdict = verify(
        "  look_for_user: {}\n  out: {user: user}\n  on_failure:\n    no_user_seen: {wait: 1 s}\n",
        "outputs:\n  user: {type: pose}",
    )
    assert "no_output" in kinds(verdict)


def test_a_code_that_never_comes_is_a_warning_with_its_line(verify):
    verdict = verify(
        "  retry: 2\n  on: [no_user_seen]\n  do:\n    run: inner\n",
        inner="tree:\n  turn: {angle: 90 deg}\n  on_failure:\n    any: {fail: it, code: blocked}\n",
    )
    assert verdict.holds
    assert kinds(verdict, "warning") == ["unreachable_code"]
    assert verdict.problems[0].position.line == 5


def test_a_called_mission_counts_by_how_it_is_called(verify):
    inner = (
        "inputs:\n  far: {type: boolean, default: false}\n"
        "tree:\n  if: $far\n  then: {fail: far, code: too_far}\n  else: {wait: 1 s}\n"
    )
    assert "too_far" not in verify("  run: inner\n  with: {far: false}\n", inner=inner).codes
    assert "too_far" in verify("  run: inner\n  with: {far: true}\n", inner=inner).codes


def test_a_called_mission_that_is_broken_is_no_proof(verify):
    verdict = verify("  run: inner\n", inner="tree:\n  repeat: forever\n  do: {wait: 1 s}\n")
    assert not verdict.holds


def test_an_input_that_is_needed_as_it_stands_is_said(verify):
    tree = "  retry: $tries\n  do: {turn: {angle: $angle}}\n"
    head = "inputs:\n  tries: {type: integer, default: 3}\n  angle: {type: angle, default: 90 deg}"
    assert verify(tree, head).assumed == ("tries is 3",)


def test_what_is_assumed_of_a_called_mission_is_said_of_its_caller(verify):
    inner = "tree:\n  sequence:\n    - get_rooms: {}\n      out: {rooms: rooms}\n"
    loops = "    - for_each: $rooms\n      as: room\n      do: {wait: 1 s}\n"
    assert not verify("  run: inner\n", inner=inner).assumed
    assert verify("  run: inner\n", inner=inner + loops).assumed


def test_an_exploration_that_was_ended_is_no_proof(verify):
    verdict = verify(DRIVE, limits=Limits(steps=3))
    assert not verdict.complete
    assert not verdict.holds


def test_time_outs_that_end_together(verify):
    """The time-out is due before the skill's own limit; the other way round it is not."""
    drive = "  do: {navigate_to: {goal: {x: 1 m, y: 0 m, yaw: 0 deg}}}\n"
    assert verify(f"  timeout: 20 s\n{drive}").longest_s == pytest.approx(20.0)
    assert verify(f"  timeout: 1 h\n{drive}").longest_s == pytest.approx(180.0)


def test_a_race_in_one_tick(verify):
    """What is under `until` comes first when the body ends at the same moment."""
    verdict = verify("  turn: {angle: 90 deg}\n  until:\n    look_for_user: {}\n  code: turned_first\n")
    assert verdict.holds
    assert "turned_first" in verdict.codes
    ends = {edge.event.ends[:2] for edges in verdict.explored.graph.edges for edge in edges}
    assert any(len(each) == 2 for each in ends)
