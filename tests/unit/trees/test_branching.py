"""``if``, ``switch`` and ``condition``."""

import pytest
from py_trees.common import Status

from florence_bt.core.outcome import failure
from tests.unit.trees.language import BROKEN, ENDLESS, Play, measured, takes

NUMBER = "keys: {n: {type: integer, default: 0}}\n"
AWAY = failure("away", "it is not")


@pytest.mark.parametrize(
    ("tree", "status", "started"),
    [
        ("{if: $n == 0, then: {work: }, else: {other: }}", "success", ["work"]),
        ("{if: $n > 0, then: {work: }, else: {other: }}", "success", ["other"]),
        ("{if: $n > 0, then: {work: }}", "success", []),
        ("{if: {is_home: }, then: {work: }, else: {other: }}", "success", ["is_home", "work"]),
        ("{if: {invert: {is_home: }}, then: {work: }, else: {other: }}", "success", ["is_home", "other"]),
        ("{if: $n / 0 > 1, then: {work: }}", "bad_expression", []),
        ("{if: {condition: $n == 0}, then: {fail: so, code: so}}", "so", []),
    ],
)
def test_if(tmp_path, tree, status, started):
    play = Play(tmp_path, f"{NUMBER}tree: {tree}")
    assert (play.run(), [skill for _, skill in play.started]) == (status, started)


def test_the_failure_of_a_branch_is_explained_by_the_branch(tmp_path):
    play = Play(
        tmp_path,
        "tree: {if: {is_home: }, then: {work: }, else: {other: }}",
        is_home=[takes(0.0, AWAY)],
        other=[takes(0.0, BROKEN)],
    )
    assert play.run() == "broken"
    assert play.why.path == "m/other"


def test_a_question_that_takes_time_is_asked_once(tmp_path):
    # 0: measure; 2: yes, work; 3: done
    play = Play(
        tmp_path, "tree: {if: {measure: }, then: {work: }}", measure=[measured(1.0, 2.0)], work=[takes(1.0)]
    )
    assert play.run() == "success"
    assert play.started == [(0.0, "measure"), (2.0, "work")]


def test_with_memory_the_answer_stands(tmp_path):
    play = Play(
        tmp_path, f"{NUMBER}tree: {{if: $n == 0, then: {{work: }}, else: {{other: }}}}", work=[takes(2.0)]
    )
    assert play.at(1.0) == "running"
    play.keys.write("n", 1)
    assert not play.context.wake.take()
    assert (play.run(), play.started) == ("success", [(0.0, "work")])


def test_without_memory_the_branch_follows_the_key(tmp_path):
    # 0: work; 1: n is 1, work is stopped, other begins; 2: n is 0, other is stopped, work begins anew
    tree = "{if: $n == 0, then: {work: }, else: {other: }, memory: false}"
    play = Play(tmp_path, f"{NUMBER}tree: {tree}", work=[ENDLESS], other=[ENDLESS])
    play.at(1.0)
    for n in (1, 0):
        play.keys.write("n", n)
        assert play.context.wake.take()
        play.at(play.clock.now())
        play.at(play.clock.now() + 1.0)
    assert play.started == [(0.0, "work"), (1.0, "other"), (2.0, "work")]
    assert play.ended == [(1.0, "work", "cancelled"), (2.0, "other", "cancelled")]


def test_an_if_that_was_stopped_watches_nothing(tmp_path):
    play = Play(tmp_path, f"{NUMBER}tree: {{if: $n == 0, then: {{work: }}, memory: false}}", work=[ENDLESS])
    play.at(1.0)
    play.root.stop(Status.INVALID)
    play.context.wake.take()
    play.keys.write("n", 1)
    assert not play.context.wake.take()


def test_an_if_that_has_ended_asks_no_more(tmp_path):
    tree = "tree: {if: {is_home: }, then: {work: }, memory: false}"
    play = Play(tmp_path, tree, work=[takes(2.5)])
    assert play.run() == "success"
    assert [moment for moment, skill in play.started if skill == "is_home"] == [0.0, 1.0, 2.0]
    assert play.clock.next_time() is None and not play.context.watching


@pytest.mark.parametrize(
    ("condition", "says"),
    [("$n == 0", "holds (n is 0)"), ("$n > 0", "does not hold (n is 0)"), ("1 < 2", "holds")],
)
def test_an_if_says_what_it_found(tmp_path, condition, says):
    play = Play(tmp_path, f"{NUMBER}tree: {{if: {condition}, then: {{work: }}, else: {{other: }}}}")
    assert play.run() == "success"
    assert play.root.feedback_message == says


def test_without_memory_a_change_in_the_same_tick_counts(tmp_path):
    # The sibling writes the key after the if was ticked: the branch changes at the same moment.
    tree = """
  parallel:
    - {if: $n == 0, then: {work: }, else: {other: }, memory: false}
    - sequence: [{wait: 1 s}, {set: {n: 1}}]
"""
    play = Play(tmp_path, f"{NUMBER}tree: {tree}", work=[ENDLESS], other=[takes(1.0)])
    assert play.run() == "success"
    assert play.started == [(0.0, "work"), (1.0, "other")]


def test_a_key_that_does_not_change_the_answer_wakes_nobody(tmp_path):
    play = Play(tmp_path, f"{NUMBER}tree: {{if: $n < 5, then: {{work: }}, memory: false}}", work=[ENDLESS])
    play.at(0.0)
    play.keys.write("n", 4)
    assert not play.context.wake.take()


def test_without_memory_and_without_else_the_end_of_the_condition_is_success(tmp_path):
    play = Play(tmp_path, f"{NUMBER}tree: {{if: $n == 0, then: {{work: }}, memory: false}}", work=[ENDLESS])
    play.at(1.0)
    play.keys.write("n", 1)
    assert play.run() == "success"
    assert play.ended == [(1.0, "work", "cancelled")]


def test_without_memory_the_branch_goes_on_while_a_slow_question_is_asked_again(tmp_path):
    # 0: asks; 1: yes, work; 3: work has something to say, so it is asked again; 4: yes; 5: work is done
    play = Play(
        tmp_path,
        "tree: {if: {measure: }, then: {sequence: [work: , other: ]}, memory: false}",
        measure=[measured(1.0, 1.0)],
        work=[takes(2.0)],
        other=[takes(2.0)],
    )
    assert play.run() == "success"
    assert [skill for _, skill in play.started if skill != "measure"] == ["work", "other"]
    assert all(code == "ok" for _, skill, code in play.ended if skill in ("work", "other"))


def test_a_condition_that_loses_its_value_stops_the_branch(tmp_path):
    play = Play(
        tmp_path, f"{NUMBER}tree: {{if: 1 / ($n - 1) < 0, then: {{work: }}, memory: false}}", work=[ENDLESS]
    )
    play.at(1.0)
    play.keys.write("n", 1)
    assert play.run() == "bad_expression"
    assert play.ended == [(1.0, "work", "cancelled")]


def test_a_stopped_if_stops_its_branch_and_cleans_up(tmp_path):
    tree = "{if: true, then: {work: , finally: {clean: }}, memory: false}"
    play = Play(tmp_path, f"tree: {tree}", work=[ENDLESS])
    play.at(1.0)
    play.root.stop(Status.INVALID)
    assert play.ended[0] == (1.0, "work", "cancelled")
    assert play.started[-1] == (1.0, "clean")


MODES = "{switch: $mode, cases: {fast: {work: }, slow: {other: }}%s}"


@pytest.mark.parametrize(
    ("mode", "default", "status", "started"),
    [
        ("fast", "", "success", ["work"]),
        ("slow", "", "success", ["other"]),
        ("odd", ", default: {clean: }", "success", ["clean"]),
        ("odd", "", "no_case", []),
    ],
)
def test_switch(tmp_path, mode, default, status, started):
    play = Play(tmp_path, f"inputs: {{mode: {{type: text}}}}\ntree: {MODES % default}", {"mode": mode})
    assert (play.run(), [skill for _, skill in play.started]) == (status, started)
    if status == "no_case":
        assert play.why.reason == "the value is odd; there are cases for: fast, slow"


@pytest.mark.parametrize(
    ("kind", "value", "cases", "started"),
    [
        ("length", "0.7 m", "{50 cm: {work: }, 70 cm: {other: }}", "other"),
        ("integer", "2", "{1: {work: }, 2: {other: }}", "other"),
        ("boolean", "true", "{false: {work: }, true: {other: }}", "other"),
        ("text", "1", "{1: {work: }, 2: {other: }}", "work"),
        ("duration", "2 min", "{120 s: {work: }}", "work"),
    ],
)
def test_cases_are_read_as_values_of_the_kind(tmp_path, kind, value, cases, started):
    text = f"inputs: {{x: {{type: {kind}}}}}\ntree: {{switch: $x, cases: {cases}}}"
    play = Play(tmp_path, text, {"x": value})
    assert play.run() == "success"
    assert [skill for _, skill in play.started] == [started]


def test_a_switch_is_decided_once_each_time_it_starts(tmp_path):
    tree = """
  repeat: 2
  do:
    sequence:
      - {switch: "${$n + 1}", cases: {1: {work: }, 2: {other: }}}
      - {set: {n: 1}}
"""
    play = Play(tmp_path, f"{NUMBER}tree: {tree}")
    assert (play.run(), [skill for _, skill in play.started]) == ("success", ["work", "other"])


@pytest.mark.parametrize(
    "tree", ["{switch: $n, cases: {1: {work: }}, %s}", "{if: 1 / $n == 1, then: {work: }, %s}"]
)
def test_what_starts_again_forgets_why_it_failed(tmp_path, tree):
    # There is no case for 0, and no quotient; then n is 1, and the branch breaks.
    tree = f"{{retry: 2, do: {tree % 'finally: {set: {n: 1}}'}}}"
    play = Play(tmp_path, f"{NUMBER}tree: {tree}", work=[takes(0.0, BROKEN)])
    assert play.run() == "broken"
    assert play.why.reason == "2 of 2 attempts failed; last: it broke"


def test_condition(tmp_path):
    head = "inputs: {d: {type: length, default: 2.4 m}, room: {type: text, default: hall}}\n"
    play = Play(tmp_path, f'{head}tree: {{condition: $d < 1 m or $room == "kitchen"}}')
    assert play.run() == "condition_false"
    assert play.why.reason == '$d < 1 m or $room == "kitchen" does not hold (d is 2.4 m, room is hall)'
    assert Play(tmp_path, f"{head}tree: {{condition: $d > 1 m}}").run() == "success"


def test_a_condition_in_a_sequence_without_memory_is_watched(tmp_path):
    # The key that ends the condition is written in the same tick by a later sibling.
    tree = """
  parallel:
    - {sequence: [{condition: $n == 0}, work: ], memory: false}
    - sequence: [{wait: 1 s}, {set: {n: 1}}, {wait: 60 s}]
"""
    play = Play(tmp_path, f"{NUMBER}tree: {tree}", work=[ENDLESS])
    assert play.at(1.0) == "condition_false"
    assert (1.0, "work", "cancelled") in play.ended
