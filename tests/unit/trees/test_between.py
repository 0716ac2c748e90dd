"""``between``: what is done before each further attempt of a ``retry``."""

# ruff: noqa: E501  (missions on one line)

import pytest

from florence_bt.core.outcome import failure
from tests.unit.trees.language import BROKEN, ENDLESS, Play, takes

TREE = "tree: {retry: 3, do: {work: }, between: {other: }}"
WATCHED = """\
keys: {n: {type: integer, default: 0}}
tree:
  parallel:
    - sequence:
        - {retry: 3, do: {condition: $n > 0}, between: {clean: }}
        - {other: }
      memory: false
    - sequence: [{wait: 3 s}, {set: {n: 1}}, {wait: 30 s}]
  policy: any
"""


# How long and how each attempt ends | what is started when | what becomes of it
@pytest.mark.parametrize(
    ("attempts", "started", "status"),
    [
        ([takes(1.0)], [(0.0, "work")], "success"),
        ([takes(1.0, BROKEN), takes(1.0)], [(0.0, "work"), (1.0, "other"), (3.0, "work")], "success"),
        (
            [takes(1.0, BROKEN)],
            [(0.0, "work"), (1.0, "other"), (3.0, "work"), (4.0, "other"), (6.0, "work")],
            "broken",
        ),
    ],
)
def test_it_runs_before_each_further_attempt(tmp_path, attempts, started, status):
    play = Play(tmp_path, TREE, work=attempts, other=[takes(2.0)])
    assert (play.run(), play.started) == (status, started)


def test_a_failure_that_is_worth_no_attempt_does_not_come_to_it(tmp_path):
    text = "tree: {retry: 3, on: [timed_out], do: {work: }, between: {other: }}"
    play = Play(tmp_path, text, work=[takes(1.0, BROKEN)])
    assert (play.run(), play.started) == ("broken", [(0.0, "work")])


def test_when_it_fails_the_whole_fails_and_the_reason_has_both(tmp_path):
    play = Play(tmp_path, TREE, work=[takes(1.0, BROKEN)], other=[takes(1.0, failure("rejected", "it jams"))])
    assert play.run() == "rejected"
    assert play.why.reason == "it jams (before that, attempt 1 of 3: it broke)"
    assert play.why.path == "m/other"


@pytest.mark.parametrize("moment", [0.5, 1.0, 1.5, 2.0, 2.5])
def test_it_can_be_stopped_at_every_moment(tmp_path, moment):
    text = f"{TREE[:-1]}, finally: {{clean: }}}}"
    play = Play(tmp_path, text, work=[takes(1.0, BROKEN), ENDLESS], other=[takes(1.0)])
    play.at(moment)
    play.root.stop()
    play.clock.advance(1.0)
    assert [skill for _, skill in play.started].count("clean") == 1
    assert all(run.end_reported or run.left for run in play.context.runs) or not play.context.runs


def test_the_next_time_begins_with_the_first_attempt(tmp_path):
    text = "tree: {repeat: 2, do: {retry: 2, attempt: n, do: {work: }, between: {other: }}}"
    play = Play(tmp_path, text, work=[takes(0.0, BROKEN), takes(1.0), takes(1.0)])
    assert play.run() == "success"
    assert [skill for _, skill in play.started] == ["work", "other", "work", "work"]
    assert play.keys.read("n") == 1


def test_in_a_condition_each_question_has_all_attempts(tmp_path):
    play = Play(tmp_path, WATCHED, other=[ENDLESS])
    assert play.at(2.0) == "running"
    # The condition fails for good, with two pauses between three questions.
    assert [skill for _, skill in play.started] == ["clean", "clean"]


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        ("{repeat: 3, do: {stop_tracker: }, between: {wait: 1 s}}", "'between' does not belong to 'repeat'"),
        ("{retry: 3, do: {stop_tracker: }, between: {fail: x}}", "there is never a second attempt: 'fail'"),
        ("{retry: 9000, do: {condition: $n < 3}}", "more than the 5000"),
        ("{retry: 9000, do: {condition: $n < 3}, between: {wait: 1 s}}", ""),
        ("{sequence: [{between: {wait: 1 s}}, {condition: $n < 3}]}", "'between' is not a node"),
        ("{retry: 3, do: {condition: $n < 3}, between: {wait: $d}}", "no node writes a key 'd'"),
        (
            "{sequence: [{retry: 3, do: {look_for_user: }, between: {set: {t: 1 s}}}, {wait: $t, when: $n < 3}]}",
            "the key 't' may have no value here",
        ),
    ],
)
def test_what_the_check_says(workshop, tree, line):
    found = workshop.lines(f"inputs: {{n: {{type: integer}}}}\ntree: {tree}\n")
    assert any(line in each for each in found) if line else found == [], found
