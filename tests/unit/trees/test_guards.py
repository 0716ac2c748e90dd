"""``when`` and ``while``: what is started, what is stopped, and what that counts as."""

import pytest
from py_trees.common import Status

from florence_bt.behaviours.why import explain
from florence_bt.core.outcome import failure
from tests.unit.trees.language import BROKEN, ENDLESS, Play, measured, takes

SKILL = "{work: {}, when: $n < 3}"


# Where the skipped node stands | what becomes of the mission | what was started
@pytest.mark.parametrize(
    ("tree", "status", "started"),
    [
        (SKILL, "success", []),
        (f"{{sequence: [{SKILL}, other: ]}}", "success", ["other"]),
        (f"{{selector: [{SKILL}, other: ]}}", "success", ["other"]),
        (f"{{selector: [{SKILL}]}}", "skipped", []),
        (f"{{parallel: [{SKILL}, other: ]}}", "success", ["other"]),
        (f"{{retry: 2, do: {SKILL}}}", "success", []),
        (f"{{selector: [{{timeout: 5 s, do: {SKILL}}}, other: ]}}", "success", ["other"]),
        (f"{{selector: [{{if: true, then: {SKILL}}}, other: ]}}", "success", ["other"]),
        (f"{{selector: [{{switch: 1, cases: {{1: {SKILL}}}}}, other: ]}}", "success", ["other"]),
        (f"{{selector: [{{sequence: [{SKILL}]}}, other: ]}}", "success", []),
        (f"{{invert: {SKILL}}}", "success", []),
        (f"{{selector: [{{invert: {SKILL}}}, other: ]}}", "success", ["other"]),
        (f"{{selector: [{{succeed: {SKILL}}}, other: ]}}", "success", []),
        (f"{{selector: [{{retry: 3, do: {SKILL}, between: {{clean: }}}}, other: ]}}", "success", ["other"]),
        (f"{{selector: [{{repeat: 3, do: {SKILL}}}, other: ]}}", "success", []),
        (f"{{selector: [{{for_each: [a], as: x, do: {SKILL}}}, other: ]}}", "success", []),
        (f"{{repeat: 2, do: {{sequence: [{SKILL}, other: ]}}}}", "success", ["other"] * 2),
        (f"{{for_each: [a, b], as: x, first_success: true, do: {SKILL}}}", "none_worked", []),
        (
            f"{{for_each: [a], as: x, first_success: true, do: {{timeout: 5 s, do: {SKILL}}}}}",
            "none_worked",
            [],
        ),
        (
            f"{{for_each: [a], as: x, first_success: true, go_on_over: [lost], do: {SKILL}}}",
            "none_worked",
            [],
        ),
        (
            "{for_each: [a, b], as: x, first_success: true, do: {work: , when: $x == 'b'}}",
            "success",
            ["work"],
        ),
        (
            "{sequence: [{set: {n: 1}}, {if: {is_home: , when: $n > 1}, then: {work: }, else: {other: }}]}",
            "success",
            ["other"],
        ),
        ("{wait: 3 s, until: {is_home: , when: $n < 3}, code: late}", "late", []),
        ("{wait: 3 s, until: {other: , when: $n < 3}, code: late}", "late", []),
        (f"{{timeout: 9 s, do: {SKILL}, until: {{other: , when: $n < 3}}}}", "success", []),
        ("{fail: no, code: odd, on_failure: {odd: {work: , when: $n < 3}}}", "odd", []),
        ("{fail: no, code: odd, on_failure: {odd: {work: , when: $n > 3}}}", "success", ["work"]),
        (
            f"{{selector: [{{timeout: 9 s, do: {SKILL}, on_failure: {{any: {{clean: }}}}}}, other: ]}}",
            "success",
            ["other"],
        ),
        (
            "{sequence: [{set: {n: 1}}, {repeat: 3, do: {sequence: [{set: {n: '${$n + 1}'}},"
            " {once: {work: , when: $n > 2}}]}}]}",
            "success",
            ["work"],
        ),
        ("{selector: [{work: , when: not $n == 5}, other: ]}", "success", ["other"]),
        ("{selector: [{work: , when: $n == 5 and not $n > 9}, other: ]}", "success", ["work"]),
        ("{selector: [{sequence: [work: ], when: $n < 3}, other: ]}", "success", ["other"]),
    ],
)
def test_what_a_skipped_node_counts_as(tmp_path, tree, status, started):
    play = Play(tmp_path, f"keys: {{n: {{type: integer, default: 5}}}}\ntree: {tree}")
    assert play.run() == status
    assert [skill for _, skill in play.started if skill != "is_home"] == started


def test_a_list_of_which_all_was_skipped_is_not_called_empty(tmp_path):
    tree = "{for_each: [a, b], as: x, first_success: true, do: {work: , when: $x == 'c'}}"
    play = Play(tmp_path, f"tree: {tree}")
    assert (play.run(), play.why.reason) == ("none_worked", "every item was skipped")


def test_a_called_mission_decides_for_itself(tmp_path):
    # The selector stands in the calling mission, so the skipped root of the called one is a success.
    play = Play(
        tmp_path,
        "tree: {selector: [run: called, other: ]}",
        others={"called": "inputs: {n: {type: integer, default: 5}}\ntree: {work: , when: $n < 3}"},
    )
    assert (play.run(), play.started) == ("success", [])


@pytest.mark.parametrize(
    ("guard", "reason"),
    [
        ("when: $n < 3", "skipped: $n < 3 does not hold (n is 5)"),
        ("when: $d < 1 m or $n != 5", "skipped: $d < 1 m or $n != 5 does not hold (d is 2.5 m, n is 5)"),
        ("when: false", "skipped: false does not hold"),
    ],
)
def test_the_reason_shows_the_values(tmp_path, guard, reason):
    head = "inputs: {n: {type: integer, default: 5}, d: {type: length, default: 2.5 m}}\n"
    play = Play(tmp_path, f"{head}tree: {{selector: [{{work: , {guard}}}]}}")
    assert (play.run(), play.why.reason) == ("skipped", reason)
    succeeding = Play(tmp_path, f"{head}tree: {{work: , {guard}}}")
    assert succeeding.run() == "success"
    assert succeeding.root.feedback_message == reason


def test_when_is_looked_at_only_before_the_start(tmp_path):
    play = Play(
        tmp_path,
        "keys: {go: {type: boolean, default: true}}\ntree: {work: , when: $go}",
        work=[takes(2.0)],
    )
    assert play.at(1.0) == "running"
    play.keys.write("go", False)
    assert play.run() == "success"


def test_every_start_looks_anew(tmp_path):
    # Three rounds: only in the second is n equal to 2.
    tree = "{repeat: 3, do: {sequence: [{set: {n: '${$n + 1}'}}, {work: , when: $n == 2}]}}"
    play = Play(tmp_path, f"keys: {{n: {{type: integer, default: 0}}}}\ntree: {tree}")
    assert (play.run(), len(play.started)) == ("success", 1)


def test_while_stops_the_node_at_the_moment_a_key_changes(tmp_path):
    # 0: work begins; 3: measure ends, found is written, work is stopped in the same tick or the next at once
    tree = """
  parallel:
    - work:
      while: not $found
    - sequence: [measure: , {set: {found: true}}, {wait: 60 s}]
"""
    head = "keys: {found: {type: boolean, default: false}}\n"
    play = Play(tmp_path, f"{head}tree: {tree}", work=[ENDLESS], measure=[measured(1.0, after=3.0)])
    assert play.at(2.9) == "running"
    assert play.at(3.0) == "guard_failed"
    assert play.why.reason == "not $found does not hold (found is true)"
    assert play.why.path == "m/while not $found"
    assert (3.0, "work", "cancelled") in play.ended


def test_a_write_from_outside_wakes_the_guard(tmp_path):
    play = Play(
        tmp_path, "keys: {n: {type: integer, default: 0}}\ntree: {work: , while: $n < 3}", work=[ENDLESS]
    )
    assert play.at(1.0) == "running"
    play.keys.write("n", 2)
    assert not play.context.wake.take()  # it still holds: nobody needs a tick
    play.keys.write("n", 3)
    assert play.context.wake.take()
    play.tick()
    assert play.status == "guard_failed"


def test_a_guard_that_has_ended_watches_no_more(tmp_path):
    play = Play(
        tmp_path,
        "keys: {n: {type: integer, default: 0}}\ntree: {sequence: [{work: , while: $n < 3}, other: ]}",
        other=[ENDLESS],
    )
    assert play.at(0.0) == "running"
    play.keys.write("n", 5)
    assert not play.context.wake.take()
    assert play.at(1.0) == "running"


def test_while_must_hold_at_the_start(tmp_path):
    play = Play(tmp_path, "tree: {selector: [{work: , while: 1 > 2}, other: ]}")
    assert play.run() == "success"
    assert [skill for _, skill in play.started] == ["other"]


def test_a_node_that_succeeds_with_the_step_that_ends_the_condition_has_succeeded(tmp_path):
    head = "keys: {n: {type: integer, default: 0}}\n"
    assert Play(tmp_path, f"{head}tree: {{set: {{n: 5}}, while: $n < 3}}").run() == "success"


def test_a_node_that_goes_on_after_it_has_ended_its_own_condition_fails_at_once(tmp_path):
    # The set is followed by work, which is started in the same tick and stopped in it.
    head = "keys: {n: {type: integer, default: 0}}\n"
    play = Play(
        tmp_path, f"{head}tree: {{sequence: [{{set: {{n: 5}}}}, work: ], while: $n < 3}}", work=[ENDLESS]
    )
    play.tick()
    assert play.status == "guard_failed"
    assert play.ended == [(0.0, "work", "cancelled")]


@pytest.mark.parametrize(
    ("guard", "work", "status", "cleaned"),
    [
        ("when: $n == 0", takes(1.0), "success", 1.0),
        ("when: $n == 0", takes(1.0, BROKEN), "broken", 1.0),
        ("when: $n == 1", takes(1.0), "success", None),
        ("when: not $n == 0", takes(1.0), "success", None),
        ("while: $n == 1", takes(1.0), "guard_failed", None),
        ("while: $n == 0", takes(1.0), "success", 1.0),
        ("while: $n == 0", ENDLESS, "guard_failed", 2.0),
    ],
)
def test_the_clean_up_follows_only_what_was_started(tmp_path, guard, work, status, cleaned):
    tree = f"""
  parallel:
    - work:
      {guard}
      finally: {{clean: {{}}}}
    - sequence: [{{wait: 2 s}}, {{set: {{n: 1}}}}, {{wait: 1 s}}]
"""
    play = Play(tmp_path, f"keys: {{n: {{type: integer, default: 0}}}}\ntree: {tree}", work=[work])
    assert play.run() == status
    assert [time for time, skill in play.started if skill == "clean"] == (
        [] if cleaned is None else [cleaned]
    )


def test_a_stop_cleans_up_behind_guards(tmp_path):
    play = Play(tmp_path, "tree: {work: , when: true, while: true, finally: {clean: {}}}", work=[ENDLESS])
    assert play.at(1.0) == "running"
    play.root.stop(Status.INVALID)
    assert (1.0, "clean") in play.started


def test_a_guard_whose_key_has_no_value_fails(tmp_path):
    for guard in ("when", "while"):
        tree = (
            f"{{sequence: [{{succeed: {{measure: , out: {{distance: d}}}}}}, {{work: , {guard}: $d > 1 m}}]}}"
        )
        play = Play(tmp_path, f"tree: {tree}", measure=[takes(0.0, failure("blind", "dark"))])
        assert play.run() == "missing_key"
        assert play.started == [(0.0, "measure")]


def test_a_guard_without_a_value_says_so(tmp_path):
    play = Play(tmp_path, "inputs: {n: {type: integer, default: 0}}\ntree: {work: , when: 1 / $n > 2}")
    assert play.run() == "bad_expression"
    assert play.why.reason == "1 / $n > 2 has no value: 1 is divided by zero"


def test_because_words_the_failure_of_a_guard(tmp_path):
    play = Play(tmp_path, "tree: {work: , while: false, because: {guard_failed: not now}}")
    assert (play.run(), play.why.reason) == ("guard_failed", "not now")


def test_a_guard_at_the_root_keeps_the_name_of_the_mission(tmp_path):
    play = Play(tmp_path, "tree: {name: my work, work: , when: true}", work=[takes(0.0, BROKEN)])
    assert play.run() == "broken"
    assert explain(play.root).path == "m/my work"
