"""``interrupted_by``: something comes first, and then the node goes on with what was interrupted."""

# ruff: noqa: E501  (missions on one line)

import pytest
from py_trees.common import Status

from florence_bt.core.outcome import failure
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.loader import MissionLibrary
from tests.ticking import drain
from tests.unit.trees.interpreted import by_the_engine
from tests.unit.trees.interpreter import World
from tests.unit.trees.language import BROKEN, DECLARATIONS, ENDLESS, Play, takes

KEYS = "keys: {low: {type: boolean, default: false}, l: {type: list of integer, default: []}}\n"
CHARGE = "interrupted_by: {if: $low, do: {sequence: [{clean: }, {set: {low: false}}]}}"
AFTER = "{{sequence: [{{wait: {} s}}, {{set: {{low: true}}}}]}}"


def play(folder, node, *, low_after=(1.5,), **scripts):
    """Play a node while the key ``low`` is set at some moments."""
    gaps = [b - a for a, b in zip((0.0, *low_after), low_after, strict=False)]
    changes = ", ".join(AFTER.format(gap) for gap in gaps) or "{wait: 0 s}"
    text = f"{KEYS}tree: {{parallel: [{node}, {{sequence: [{changes}]}}]}}"
    known = {"work": [takes(1.0)], "other": [takes(1.0)], "clean": [takes(3.0)]}
    return Play(folder, text, **{**known, **scripts})


@pytest.mark.parametrize(
    ("node", "skills"),
    [
        # The step, item or round begins again, and what was done before stays done.
        ("{sequence: [{work: }, {other: }]", ["work", "other", "clean", "other"]),
        ("{selector: [{invert: {work: }}, {other: }]", ["work", "other", "clean", "other"]),
        ("{for_each: [1, 2], as: x, do: {work: }", ["work", "work", "clean", "work"]),
        ("{repeat: 2, do: {work: }", ["work", "work", "clean", "work"]),
        ("{retry: 2, do: {invert: {work: }}", ["work", "work", "clean", "work"]),
        ("{retry: 2, do: {invert: {work: }}, between: {other: }", ["work", "other", "clean", "other", "work"]),
        # Everything else begins again as a whole.
        ("{timeout: 9 s, do: {sequence: [{work: }, {other: }]}", ["work", "other", "clean", "work", "other"]),
        ("{if: 1 < 2, then: {sequence: [{work: }, {other: }]}", ["work", "other", "clean", "work", "other"]),
        ("{sequence: [{condition: 1 < 2}, {sequence: [{work: }, {other: }]}], memory: false", ["work", "other", "clean", "work", "other"]),
    ],
)  # fmt: skip
def test_what_begins_again(tmp_path, node, skills):
    run = play(tmp_path, f"{node}, {CHARGE}}}")
    run.run()
    assert [skill for _, skill in run.started] == skills
    assert run.ended[1] == (1.5, skills[1], "cancelled")


def test_items_follow_the_one_that_was_interrupted(tmp_path):
    do = "{sequence: [{work: }, {append: {l: $x}}]}"
    run = play(tmp_path, f"{{for_each: [1, 2, 3], as: x, do: {do}, {CHARGE}}}", low_after=(0.5, 1.5, 8.0))
    assert run.run() == "success"
    assert run.keys.read("l") == (1, 2, 3)


def test_it_is_asked_before_the_node_begins(tmp_path):
    node = f"{{sequence: [{{set: {{low: true}}}}, {{work: , {CHARGE}}}]}}"
    run = play(tmp_path, node, low_after=())
    assert (run.run(), run.started) == ("success", [(0.0, "clean"), (3.0, "work")])


def test_it_comes_again_as_long_as_the_answer_is_yes(tmp_path):
    node = "{work: , interrupted_by: {if: $low, do: {other: }}}"
    run = play(tmp_path, f"{{timeout: 4 s, do: {node}}}", low_after=(0.5,))
    assert run.run() == "timed_out"
    assert [skill for _, skill in run.started] == ["work", "other", "other", "other", "other"]


def test_what_ends_in_that_step_has_ended(tmp_path):
    run = play(tmp_path, f"{{sequence: [{{work: }}, {{set: {{low: true}}}}], {CHARGE}}}", low_after=())
    assert (run.run(), [skill for _, skill in run.started]) == ("success", ["work"])


@pytest.mark.parametrize(
    ("node", "begins"),
    [({"task": {"name": "body"}}, ["body"]), ({"repeat": 2, "do": {"task": {"name": "body"}}}, ["body", "first", "body"])],
)  # fmt: skip
def test_what_ends_at_the_moment_of_the_event_has_ended(tmp_path, node, begins):
    tasks = World(
        {"body": [(1.0, None, 0)], "calls": [(1.0, None, 0), (9.0, None, 0)], "first": [(1.0, None, 0)]}
    )
    interrupted_by = {"if": {"task": {"name": "calls"}}, "do": {"task": {"name": "first"}}}
    tree = {**node, "interrupted_by": interrupted_by}
    result, _, log, _ = by_the_engine(tmp_path, tree, tasks)
    began = [name for _, name, what in log if what == "begins" and name != "calls"]
    assert (result, began) == ("ok", begins)


@pytest.mark.parametrize(
    ("more", "end"),
    [
        ("", "broken"),
        (", on_failure: {broken: {other: }}", "success"),
        (", while: not $low", "guard_failed"),
        (", until: $low", "success"),
    ],
)
def test_an_interruption_that_fails_or_is_stopped(tmp_path, more, end):
    node = f"{{work: , interrupted_by: {{if: $low, do: {{other: }}}}{more}}}"
    run = play(tmp_path, node, low_after=(0.5,), other=[takes(1.0, BROKEN), takes(1.0)])
    assert run.run() == end
    assert run.started[0] == (0.0, "work")
    assert ((0.5, "other") in run.started) == ("low" not in more)


def test_a_mistake_in_the_question_ends_it(tmp_path):
    question = [takes(0.5, failure("bad_input", "no such place"))]
    run = play(tmp_path, "{work: , interrupted_by: {if: {other: }, do: {clean: }}}", other=question)
    assert run.run() == "bad_input"
    assert run.ended[-1] == (0.5, "work", "cancelled")


def test_an_event_interrupts_each_time_that_it_comes(tmp_path):
    run = play(
        tmp_path,
        "{sequence: [{work: }, {work: }], interrupted_by: {if: {other: }, do: {clean: }}}",
        low_after=(),
        other=[takes(0.5), takes(0.5, BROKEN), takes(0.2), ENDLESS],
    )
    assert run.run() == "success"
    works = [at for at, skill in run.started if skill == "work"]
    assert works == [0.0, 3.5, 4.5, 7.7]


def test_a_stop_stops_the_interruption_with_its_clean_up(tmp_path):
    do = "{work: , finally: {clean: }}"
    run = play(
        tmp_path, f"{{other: , interrupted_by: {{if: $low, do: {do}}}}}", low_after=(0.5,), work=[ENDLESS]
    )
    run.at(2.0)
    run.root.stop(Status.INVALID)
    drain(run.clock, run.context)
    assert [skill for _, skill in run.started if skill in DECLARATIONS] == ["other", "work", "clean"]


@pytest.mark.parametrize(
    ("node", "message"),
    [
        ("{work: , interrupted_by: {clean: }}", "needs what is asked"),
        ("{work: , interrupted_by: $low}", "needs what is asked"),
        ("{work: , interrupted_by: {if: $low}}", "needs what is asked"),
        ("{work: , interrupted_by: {if: $low, then: {clean: }}}", "needs what is asked"),
        ("{work: , interrupted_by: {if: $low, do: {clean: }}}", "nothing that runs meanwhile writes"),
        ("{work: , interrupted_by: {if: {fail: no}, do: {clean: }}}", "never succeeds"),
        ("{work: , interrupted_by: {if: 1 < 2, do: {clean: }}}", "never reached"),
        ("{parallel: [{sequence: [{clean: }, {set: {low: true}}]}, {work: , interrupted_by: {if: $low, do: {move: {by: $far}}}}]}", "key 'far'"),
    ],
)  # fmt: skip
def test_the_check_tells(tmp_path, node, message):
    (tmp_path / "m.yaml").write_text(f"mission: m\n{KEYS}tree: {node}\n")
    library = MissionLibrary.load([tmp_path], built_in=False)
    found = [str(each) for each in check(library.get("m"), library, DECLARATIONS)]
    assert any(message in each for each in found), found
