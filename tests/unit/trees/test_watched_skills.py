"""Skills as conditions of composites without memory: they are asked again while a later node runs."""

import pytest
from py_trees.common import Status

from florence_bt.behaviours.ticking import Ticker
from florence_bt.core.outcome import failure, success
from florence_bt.core.skill import FinishedRun
from florence_bt.mission_testing.mocks.mocks import Step
from tests.unit.trees.language import BROKEN, ENDLESS, Play, measured, takes

AWAY = failure("away", "it is not")
GUARD = "tree: {sequence: [is_home: , work: ], memory: false}"
ASKED_AWAY = [takes(0.0)] * 10 + [takes(0.0, AWAY)]
"""Home when asked at 0 s, ..., 9 s; away from then on."""


class Door:
    """A condition that reports changes."""

    def __init__(self, open=True):
        self.open = open
        self.callbacks = []
        self.asked = 0

    def start(self, inputs):
        self.asked += 1
        return FinishedRun(success() if self.open else AWAY)

    def watch(self, inputs, callback):
        self.callbacks.append(callback)
        return lambda: self.callbacks.remove(callback)

    def turn(self, open):
        self.open = open
        for callback in tuple(self.callbacks):
            callback()


def asked(play):
    return [moment for moment, skill in play.started if skill == "is_home"]


def test_a_battery_that_runs_low_stops_a_long_drive_within_a_second(tmp_path):
    # 0: home, work begins; 1, ..., 9: asked again; 10: away, so that work is stopped
    play = Play(tmp_path, GUARD, is_home=ASKED_AWAY, work=[takes(100.0)])
    assert play.run() == "away"
    assert asked(play) == [float(second) for second in range(11)]
    assert play.started.count((0.0, "work")) == 1 and play.ended[-1] == (10.0, "work", "cancelled")
    assert play.clock.next_time() is None


def test_a_selector_that_has_ended_asks_no_more(tmp_path):
    play = Play(
        tmp_path,
        "tree: {selector: [is_home: , work: ], memory: false}",
        is_home=[takes(0.0, AWAY)],
        work=[takes(2.5)],
    )
    assert play.run() == "success"
    assert asked(play) == [0.0, 1.0, 2.0]
    assert play.clock.next_time() is None and not play.context.watching


@pytest.mark.parametrize(("every", "moments"), [("5 s", [0, 5, 10]), ("400 ms", [0, 0.4, 0.8]), ("1 h", [0])])
def test_a_mission_says_how_often_it_is_asked(tmp_path, every, moments):
    tree = f"tree: {{sequence: [{{is_home: , every: {every}}}, work: ], memory: false}}"
    play = Play(tmp_path, tree, work=[ENDLESS])
    play.at(moments[-1] + 0.1)
    assert asked(play) == pytest.approx(moments)


def test_a_question_that_takes_time_does_not_stop_the_later_node(tmp_path):
    # 0: asked; 0.3: home, work begins; 1.3: asked again; 1.6: still home; 2.6: asked again; 2.9: away
    answers = [takes(0.3), takes(0.3), takes(0.3, AWAY)]
    play = Play(tmp_path, GUARD, is_home=answers, work=[takes(100.0)])
    assert play.run() == "away"
    assert asked(play) == pytest.approx([0.0, 1.3, 2.6])
    assert [moment for moment, skill in play.started if skill == "work"] == [0.3]
    assert play.ended[-1] == (pytest.approx(2.9), "work", "cancelled")


@pytest.mark.parametrize(
    "tree",
    [
        "{selector: [{invert: {is_home: }}, work: ], memory: false}",
        "{if: {is_home: }, then: {work: }, else: {fail: no, code: away}, memory: false}",
        "{sequence: [{sequence: [{condition: 1 < 2}, is_home: ]}, work: ], memory: false}",
        "{sequence: [{parallel: [is_home: , {is_home: }]}, work: ], memory: false}",
        "{sequence: [{if: 1 < 2, then: {is_home: }}, work: ], memory: false}",
        "{sequence: [{timeout: 1 min, do: {is_home: }}, work: ], memory: false}",
        "{sequence: [{run: sub}, work: ], memory: false}",
        "{sequence: [is_home: , {sequence: [{condition: 1 < 2}, work: ], memory: false}], memory: false}",
        "{sequence: [{sequence: [is_home: , {condition: 1 < 2}], memory: false}, work: ], memory: false}",
    ],
)
@pytest.mark.parametrize("slow", [0.0, 0.2])
def test_conditions_are_watched_wherever_they_stand(tmp_path, tree, slow):
    answers = [takes(slow)] * 8 + [takes(slow, AWAY)]
    play = Play(
        tmp_path,
        f"tree: {tree}",
        others={"sub": "tree: {sequence: [is_home: , {condition: 1 < 2}]}"},
        is_home=answers,
        work=[takes(100.0)],
    )
    ticker = Ticker(play.root)
    play.root.tick_once = ticker.tick
    play.at(20.0)
    assert play.root.status in (Status.FAILURE, Status.SUCCESS)
    assert [each for each in play.started if each[1] == "work"] == [(pytest.approx(slow), "work")]
    assert [code for moment, skill, code in play.ended if skill == "work" and moment < 11.0] == ["cancelled"]
    assert play.clock.next_time() is None and not play.context.runs


def test_a_condition_that_reports_changes_is_asked_then_and_at_no_other_time(tmp_path):
    play = Play(tmp_path, GUARD, work=[ENDLESS])
    door = play.skills["is_home"] = Door()
    assert play.at(50.0) == "running"
    assert (door.asked, len(door.callbacks)) == (1, 1)
    door.turn(open=True)
    assert play.at(50.0) == "running" and door.asked == 2
    door.turn(open=False)
    assert play.context.wake.take() and play.at(50.0) == "away"
    assert not door.callbacks


def test_a_key_that_the_condition_takes_asks_it_at_once(tmp_path):
    keys = "keys: {by: {type: length, default: 0 m}}\n"
    tree = "tree: {sequence: [{move: {by: $by}, every: 1 min}, work: ], memory: false}"
    play = Play(tmp_path, keys + tree, work=[ENDLESS])
    play.at(5.0)
    play.keys.write("by", 1.0)
    assert play.context.wake.take()
    play.at(6.0)
    assert [call["by"] for call in play.skills["move"].calls] == [0.0, 1.0]
    play.root.stop(Status.INVALID)
    play.context.wake.take()
    play.keys.write("by", 2.0)
    assert not play.context.wake.take()


def test_outputs_of_a_new_answer_reach_the_conditions_that_use_them(tmp_path):
    # 0: far; 1: far; 2: near, so that work is stopped
    tree = """tree:
  sequence:
    - {measure: , out: {distance: d}, every: 1 s}
    - condition: $d > 1 m
    - work:
  memory: false
"""
    play = Play(tmp_path, tree, measure=[measured(3.0), measured(2.0), measured(0.5)], work=[ENDLESS])
    assert play.run() == "condition_false"
    assert (play.clock.now(), len(play.skills["work"].runs)) == (2.0, 1)


def test_a_called_mission_of_conditions_is_watched_with_its_keys(tmp_path):
    sub = "tree: {sequence: [{measure: , out: {distance: d}, every: 1 s}, {condition: $d > 1 m}]}"
    play = Play(
        tmp_path,
        "tree: {sequence: [{run: sub}, {condition: 1 < 2}, work: ], memory: false}",
        others={"sub": sub},
        measure=[measured(3.0), measured(2.0), measured(0.5)],
        work=[ENDLESS],
    )
    assert play.run() == "condition_false"
    assert play.clock.now() == 2.0


@pytest.mark.parametrize(
    "tree",
    [
        "{sequence: [is_home: , work: ]}",
        "{selector: [{invert: {is_home: }}, work: ]}",
        "{if: {is_home: }, then: {work: }}",
        "{sequence: [{sequence: [is_home: ], memory: false}, work: ]}",
        "{sequence: [{condition: 1 < 2}, {sequence: [is_home: , work: ]}], memory: false}",
    ],
)
def test_nothing_is_asked_again_where_nothing_watches(tmp_path, tree):
    play = Play(tmp_path, f"tree: {tree}", work=[takes(50.0)])
    play.at(1.0)
    deadline = 60.0
    assert play.clock.next_time() == 50.0  # the end of work, and no period before
    assert play.run() == "success" and len(asked(play)) == 1
    assert play.clock.next_time() in (None, deadline)


@pytest.mark.parametrize("at", [0.5, 1.2, 3.0])
def test_a_stop_leaves_no_timer_and_no_question(tmp_path, at):
    play = Play(tmp_path, GUARD, is_home=[takes(0.4)], work=[ENDLESS])
    play.at(at)
    play.root.stop(Status.INVALID)
    assert not play.context.runs and play.clock.next_time() is None
    assert not play.context.watching


def test_each_round_asks_anew(tmp_path):
    tree = f"tree: {{retry: 3, do: {GUARD.removeprefix('tree: ')}}}"
    play = Play(tmp_path, tree, is_home=[takes(0.0)], work=[takes(0.5, BROKEN)])
    assert play.run() == "broken"
    assert asked(play) == [0.0, 0.5, 1.0]


def test_a_retry_in_a_condition_gives_each_question_its_attempts(tmp_path):
    # 0: away, home; 1: home; 2: away, home; 3: away, away, away
    tree = "tree: {sequence: [{retry: 3, do: {is_home: }}, work: ], memory: false}"
    no, yes = takes(0.0, AWAY), takes(0.0)
    play = Play(tmp_path, tree, is_home=[no, yes, yes, no, yes, no, no, no], work=[ENDLESS])
    assert play.run() == "away"
    assert asked(play) == [0.0, 0.0, 1.0, 2.0, 2.0, 3.0, 3.0, 3.0]
    assert play.started.count((0.0, "work")) == 1 and len(play.skills["work"].runs) == 1


def test_a_question_that_is_never_answered_fails_the_condition(tmp_path):
    # 0: home; 1: asked again; 61: the deadline of the skill
    play = Play(tmp_path, GUARD, is_home=[takes(0.0), ENDLESS], work=[ENDLESS])
    play.at(59.0)
    assert play.status == "running"
    assert play.run() == "timed_out"


def test_a_pause_suspends_the_question_and_the_resume_asks_again(tmp_path):
    play = Play(tmp_path, GUARD, is_home=[takes(0.0)], work=[takes(20.0)])
    play.at(2.5)
    play.context.suspend()
    assert [run.suspended for run in play.context.runs] == [True]
    play.context.resume()
    play.tick()
    assert asked(play) == [0.0, 1.0, 2.0, 2.5]


def test_the_answer_of_before_is_shown_while_it_is_asked_again(tmp_path):
    tree = "tree: {selector: [is_home: , work: ], memory: false}"
    play = Play(tmp_path, tree, is_home=[Step(AWAY), Step(AWAY, after=0.5)], work=[ENDLESS])
    guard = play.root.children[0]
    play.at(1.2)
    assert (guard.status, guard.result, guard.feedback_message) == (Status.FAILURE, AWAY, AWAY.reason)
