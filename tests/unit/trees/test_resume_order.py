"""After a pause the conditions are asked and answered before what was suspended below them starts again."""

import pytest
from py_trees.common import Status

from florence_bt.core.outcome import failure
from tests.unit.trees.language import ENDLESS, Play, takes

AWAY = failure("away", "it is not")
TREES = {
    "sequence": "{sequence: [is_home: , work: ], memory: false}",
    "selector": "{selector: [{invert: {is_home: }}, work: ], memory: false}",
    "if": "{if: {is_home: }, then: {work: }, memory: false}",
    "deep": "{sequence: [is_home: , {sequence: [other: , {timeout: 100 s, do: {retry: 2, do: {work: }}}]}], "
    "memory: false}",
    "two levels": "{sequence: [{sequence: [is_home: ]}, {selector: [{if: '$n > 5', then: {other: }, "
    "else: {fail: no}, memory: false}, work: ], memory: false}], memory: false}",
}
HEAD = "inputs: {n: {type: integer, default: 5}}\ntree: "
START = 2.5


def resumed(tmp_path, tree, *answers, **scripts):
    """A mission that was paused at 2.5 s and goes on then."""
    play = Play(
        tmp_path, f"{HEAD}{tree}", is_home=[takes(0.0)] * 3 + list(answers), work=[ENDLESS], **scripts
    )
    play.at(START)
    count = len(play.started)
    play.context.suspend()
    play.context.resume()
    play.tick()
    return play, lambda: play.started[count:]


@pytest.mark.parametrize("name", TREES)
def test_nothing_starts_again_when_the_condition_does_not_hold_any_more(tmp_path, name):
    play, started = resumed(tmp_path, TREES[name], takes(0.0, AWAY))
    assert started() == [(START, "is_home")]
    assert play.status == ("success" if name in ("selector", "if") else "away")
    assert play.context.runs == []


@pytest.mark.parametrize("name", TREES)
def test_a_condition_that_holds_comes_first(tmp_path, name):
    _, started = resumed(tmp_path, TREES[name], takes(0.0))
    assert started() == [(START, "is_home"), (START, "work")]


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("holds", [True, False])
def test_an_answer_that_takes_time_is_waited_for(tmp_path, name, holds):
    play, started = resumed(tmp_path, TREES[name], takes(1.0) if holds else takes(1.0, AWAY), takes(0.0))
    assert started() == [(START, "is_home")] and play.status == "running"
    play.at(START + 0.9)
    assert started() == [(START, "is_home")] and play.status == "running"
    play.at(START + 1.5)
    assert started() == [(START, "is_home")] + [(START + 1.0, "work")] * holds


def test_a_pause_while_the_condition_is_asked_again(tmp_path):
    play, started = resumed(tmp_path, TREES["sequence"], takes(1.0), takes(1.0), takes(0.0))
    play.at(START + 0.5)
    play.context.suspend()
    play.context.resume()
    play.tick()
    assert started() == [(START, "is_home"), (START + 0.5, "is_home")]
    play.at(START + 1.6)
    assert started()[2:] == [(START + 1.5, "work")]


def test_a_stop_while_the_condition_is_asked_again_leaves_nothing(tmp_path):
    play, started = resumed(tmp_path, TREES["sequence"], takes(1.0))
    play.root.stop(Status.INVALID)
    assert play.context.runs == [] and [skill for _, skill in started()] == ["is_home"]


def test_a_question_that_was_suspended_is_asked_once(tmp_path):
    # 0, 1 and 2: home; 2: it takes a second, and is suspended at 2.5.
    play = Play(
        tmp_path, f"{HEAD}{TREES['sequence']}", is_home=[takes(0.0)] * 2 + [takes(1.0)], work=[ENDLESS]
    )
    play.at(START)
    play.context.suspend()
    play.context.resume()
    play.tick()
    play.at(START + 1.5)
    assert play.started[-2:] == [(START, "is_home"), (START + 1.0, "work")]


def test_a_key_that_changed_during_the_pause_counts_first(tmp_path):
    play = Play(
        tmp_path, "keys: {n: {type: integer, default: 1}}\ntree: {work: , while: $n < 3}", work=[ENDLESS]
    )
    play.at(1.0)
    play.context.suspend()
    play.keys.write("n", 3)
    play.context.resume()
    play.tick()
    assert (play.status, play.started) == ("guard_failed", [(0.0, "work")])
    assert play.context.runs == []


def test_what_has_no_condition_above_starts_at_once(tmp_path):
    play = Play(tmp_path, "tree: {sequence: [work: ]}", work=[ENDLESS])
    play.at(1.0)
    play.context.suspend()
    play.context.resume()
    assert play.started == [(0.0, "work"), (1.0, "work")]
