"""``on_failure``: what is done about a failure, by its code."""

# ruff: noqa: E501  (missions on one line)

import pytest
from py_trees.common import Status

from florence_bt.core.outcome import failure
from tests.unit.trees.dumps import ascii_tree
from tests.unit.trees.language import BROKEN, ENDLESS, Play, takes

REJECTED = failure("rejected", "no")


# What is done about failures | how the work ends | what was started | what becomes of the mission
@pytest.mark.parametrize(
    ("handlers", "result", "started", "status"),
    [
        ("{broken: {other: }}", None, ["work"], "success"),
        ("{broken: {other: }}", BROKEN, ["work", "other"], "success"),
        ("{broken: {other: }}", REJECTED, ["work"], "rejected"),
        ("{any: {other: }}", REJECTED, ["work", "other"], "success"),
        ("{any: {clean: }, broken: {other: }}", BROKEN, ["work", "other"], "success"),
        ("{any: {clean: }, broken: {other: }}", REJECTED, ["work", "clean"], "success"),
        ("{broken: {fail: no, code: worse}}", BROKEN, ["work"], "worse"),
        ("{broken: {fail: no, code: rejected}, rejected: {other: }}", BROKEN, ["work"], "rejected"),
    ],
)
def test_the_node_for_the_code_runs_and_counts(tmp_path, handlers, result, started, status):
    play = Play(tmp_path, f"tree: {{work: , on_failure: {handlers}}}", work=[takes(1.0, result)])
    assert (play.run(), [skill for _, skill in play.started]) == (status, started)


def test_what_has_failed_can_be_read(tmp_path):
    text = """\
outputs: {said: {type: text}}
tree:
  work:
  on_failure: {any: {set: {said: "$failure_code: $failure_reason"}}}
"""
    play = Play(tmp_path, text, work=[takes(1.0, BROKEN)])
    assert (play.run(), play.keys.read("said")) == ("success", "broken: it broke")


def test_a_reason_names_both_failures(tmp_path):
    play = Play(
        tmp_path,
        "tree: {work: , on_failure: {any: {other: }}}",
        work=[takes(1.0, BROKEN)],
        other=[takes(0.0, REJECTED)],
    )
    assert play.run() == "rejected"
    assert (play.why.path, play.why.reason) == ("m/other", "no (before that, it broke)")


def test_a_reason_that_has_the_first_one_does_not_say_it_twice(tmp_path):
    text = 'tree: {work: , on_failure: {any: {fail: "this went wrong: $failure_reason"}}}'
    play = Play(tmp_path, text, work=[takes(1.0, BROKEN)])
    assert (play.run(), play.why.reason) == ("failed", "this went wrong: it broke")


def test_because_is_about_what_is_left_and_finally_comes_last(tmp_path):
    text = """\
tree:
  work:
  on_failure: {broken: {other: }}
  because: {rejected: the second failed too, broken: never said}
  finally: {clean: }
"""
    play = Play(tmp_path, text, work=[takes(1.0, BROKEN)], other=[takes(1.0, REJECTED)])
    assert (play.run(), play.why.reason) == ("rejected", "the second failed too")
    assert [skill for _, skill in play.started] == ["work", "other", "clean"]


@pytest.mark.parametrize("holds", [True, False])
def test_it_has_the_failure_of_a_while(tmp_path, holds):
    text = f"""\
keys: {{n: {{type: integer, default: {1 if holds else 2}}}}}
tree:
  parallel:
    - work:
      while: $n == 1
      code: changed
      on_failure: {{changed: {{other: }}}}
      finally: {{clean: }}
    - sequence: [{{wait: 2 s}}, {{set: {{n: 2}}}}]
"""
    play = Play(tmp_path, text, work=[ENDLESS])
    assert play.run() == "success"
    assert [skill for _, skill in play.started] == [*(["work"] if holds else []), "other", "clean"]


def test_a_node_that_is_skipped_has_not_failed(tmp_path):
    play = Play(
        tmp_path, "tree: {selector: [{work: , when: 1 > 2, on_failure: {any: {other: }}}, {clean: }]}"
    )
    assert (play.run(), [skill for _, skill in play.started]) == ("success", ["clean"])


def test_failures_in_it_are_caught_outside(tmp_path):
    text = """\
tree:
  sequence:
    - work:
      on_failure: {broken: {measure: , out: {distance: d}, on_failure: {blind: {fail: "$failure_code", code: dark}}}}
    - other:
  on_failure: {dark: {clean: }}
"""
    play = Play(tmp_path, text, work=[takes(1.0, BROKEN)], measure=[takes(0.0, failure("blind", "dark"))])
    assert (play.run(), [skill for _, skill in play.started]) == ("success", ["work", "measure", "clean"])


@pytest.mark.parametrize("moment", [0.0, 0.5, 1.0, 1.5, 2.5])
def test_it_can_be_stopped_at_every_moment(tmp_path, moment):
    text = "tree: {work: , on_failure: {any: {other: }}, finally: {clean: }}"
    play = Play(tmp_path, text, work=[takes(1.0, BROKEN)], other=[takes(1.0)])
    status = play.at(moment)
    play.root.stop(Status.INVALID)
    play.clock.advance(1.0)
    assert [skill for _, skill in play.started].count("clean") == 1, status
    assert play.context.runs == []


def test_each_round_begins_with_the_node_itself(tmp_path):
    text = "tree: {repeat: 3, do: {work: , on_failure: {any: {other: }}}}"
    play = Play(tmp_path, text, work=[takes(1.0, BROKEN), takes(1.0), takes(1.0, BROKEN)])
    assert play.run() == "success"
    assert [skill for _, skill in play.started] == ["work", "other", "work", "work", "other"]


def test_a_watched_condition_is_watched_through_it(tmp_path):
    text = """\
keys: {n: {type: integer, default: 0}, seen: {type: text, default: ""}}
tree:
  parallel:
    - sequence:
        - {condition: $n < 2, code: many, on_failure: {many: {condition: $n > 3}}}
        - {work: }
      memory: false
    - sequence: [{wait: 2 s}, {set: {n: 4}}, {wait: 2 s}, {set: {n: 3}}, {wait: 1 s}]
"""
    play = Play(tmp_path, text, work=[ENDLESS])
    assert play.at(3.0) == "running"
    assert play.at(4.0) == "condition_false"
    assert [skill for _, skill in play.started] == ["work"]


def test_the_dump_shows_what_was_done(tmp_path):
    play = Play(
        tmp_path, "tree: {sequence: [{work: , on_failure: {any: {other: }}}]}", work=[takes(0.0, BROKEN)]
    )
    play.run()
    assert ascii_tree(play.root).splitlines() == [
        "[+] m (sequence)",
        "    [+] work (on_failure) -- broken: it broke",
        "        [x] work -- it broke",
        "        [+] other",
    ]


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        ("{turn: {angle: 1 rad}, on_failure: {bloked: {wait: 1 s}}}", "error on_failure: 'turn' cannot fail with 'bloked' | blocked"),
        ("{turn: {angle: 1 rad}, on_failure: {not_found: {wait: 1 s}}}", "cannot fail with any code of the group 'not_found'"),
        ("{turn: {angle: 1 rad}, on_failure: {unreachable: {wait: 1 s}}}", ""),
        ("{turn: {angle: 1 rad}, on_failure: {any: {wait: 1 s}}}", ""),
        ("{wait: 1 s, on_failure: {any: {wait: 1 s}}}", "on_failure has no effect: 'wait 1 s' never fails"),
        ("{turn: {angle: 1 rad}, on_failure: {wait: 1 s}}", "'wait' is a kind of node, and the code is missing | any: {wait: ...}"),
        ("{turn: {angle: 1 rad}, on_failure: [{wait: 1 s}]}", "on_failure needs codes and nodes"),
        ("{sequence: [{turn: {angle: 1 rad}}, {on_failure: {any: {wait: 1 s}}}]}", "'on_failure' is not a node"),
        ("{retry: 2, on: [blocked], do: {turn: {angle: 1 rad}, on_failure: {blocked: {wait: 1 s}}}}", "cannot fail with 'blocked'"),
        ("{retry: 2, on: [odd], do: {turn: {angle: 1 rad}, on_failure: {blocked: {fail: x, code: odd}}}}", ""),
        ("{sequence: [{fail: $failure_reason}]}", "no node writes a key 'failure_reason'"),
        (
            "{sequence: [{turn: {angle: 1 rad}, on_failure: {any: {wait: 1 s}}}, {fail: $failure_code}]}",
            "the key 'failure_code' may have no value here",
        ),
        ("{try: {turn: {angle: 1 rad}}}", "| on_failure: {any: a node}"),
    ],
)  # fmt: skip
def test_what_the_check_says(workshop, tree, line):
    found = workshop.lines(f"description: d\ntree: {tree}\n")
    assert any(line in each for each in found) if line else found == [], found
