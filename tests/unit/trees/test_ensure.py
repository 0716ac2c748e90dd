"""``ensure``: what must hold when a node has succeeded, whichever way it did."""

# ruff: noqa: E501  (missions on one line)

import pytest

from florence_bt.behaviours.why import explain
from florence_bt.core.outcome import failure
from florence_bt.trees.language.expressions.compiling import compile_expression
from florence_bt.trees.language.loader import MissionLibrary
from tests.unit.trees.language import BROKEN, ENDLESS, Play, measured, takes

FAR, NEAR = measured(0.8, after=1.0), measured(0.4, after=1.0)
MEASURING = "{{measure: , out: {{distance: d}}, ensure: $d < 0.5 m{}}}"


@pytest.mark.parametrize(
    ("more", "looks", "end"),
    [
        ("", [NEAR], "success"),
        ("", [FAR], "not_ensured"),
        (", code: too_far", [FAR], "too_far"),
        # A failure stays what it is.
        (", code: too_far", [takes(1.0, failure("blind", "dark"))], "blind"),
        # A node that was skipped has promised nothing.
        (", when: 1 > 2", [FAR], "success"),
    ],
)
def test_a_success_must_hold(tmp_path, more, looks, end):
    assert Play(tmp_path, f"tree: {MEASURING.format(more)}", measure=looks).run() == end


@pytest.mark.parametrize(
    "node",
    [
        "{sequence: [{succeed: {measure: , out: {distance: d}}}, {measure: , out: {distance: d}}], ensure: $d < 0.5 m}",
        "{work: , on_failure: {any: {measure: , out: {distance: d}}}, ensure: $d < 0.5 m}",
        "{other: , until: {measure: , out: {distance: d}}, ensure: $d < 0.5 m}",
        "{retry: 2, do: {measure: , out: {distance: d}}, ensure: $d < 0.5 m}",
        "{parallel: [{measure: , out: {distance: d}}, {other: }], policy: any, ensure: $d < 0.5 m}",
    ],
)
@pytest.mark.parametrize(("look", "end"), [(FAR, "not_ensured"), (NEAR, "success")])
def test_however_the_success_came_about(tmp_path, node, look, end):
    play = Play(tmp_path, f"tree: {node}", work=[takes(1.0, BROKEN)], other=[ENDLESS], measure=[look])
    assert play.run() == end


def test_it_is_asked_before_the_clean_up_which_runs_once(tmp_path):
    text = f"tree: {MEASURING.format(', finally: {clean: }')}"
    play = Play(tmp_path, text, measure=[FAR])
    assert (play.run(), [skill for _, skill in play.started]) == ("not_ensured", ["measure", "clean"])


def test_another_attempt_can_meet_it(tmp_path):
    text = f"tree: {{retry: 3, on: [too_far], do: {MEASURING.format(', code: too_far')}}}"
    play = Play(tmp_path, text, measure=[FAR, FAR, NEAR])
    assert (play.run(), len(play.started)) == ("success", 3)


def test_the_author_can_put_it_in_words(tmp_path):
    text = f"tree: {MEASURING.format(', because: {not_ensured: it stands too far away}')}"
    play = Play(tmp_path, text, measure=[FAR])
    play.run()
    assert explain(play.root).reason == "it stands too far away"


def test_the_reason_says_what_was_measured(tmp_path):
    text = """\
keys: {here: {type: pose, default: {x: 1 m, y: 0 m, yaw: 0 deg}}, goal: {type: pose, default: {x: 1 m, y: 2 m, yaw: 0 deg}}}
tree: {work: , ensure: "distance($here, $goal) < 0.5 m or bearing($here, $goal) > 95 deg"}
"""
    play = Play(tmp_path, text)
    play.run()
    assert "(distance($here, $goal) is 2 m, bearing($here, $goal) is 90 deg)" in play.why.reason


def test_what_has_no_value_is_told_so(tmp_path):
    play = Play(tmp_path, "keys: {n: {type: integer, default: 0}}\ntree: {work: , ensure: 1 / $n > 2}")
    assert play.run() == "bad_expression"


@pytest.mark.parametrize(
    ("node", "message"),
    [
        ("{wait: 1 s, ensure: $nothing > 3}", "'nothing'"),
        ("{wait: 1 s, ensure: 3 m}", "3 m"),
        ("{wait: 1 s, ensure: 1 < 2}", "always holds"),
        ("{condition: 1 < $n, ensure: $n < 3, code: odd}", "it is not clear"),
    ],
)
def test_the_check_reads_it(workshop, node, message):
    text = f"inputs: {{n: {{type: integer, default: 2}}}}\ntree: {node}\n"
    assert any(message in line for line in workshop.lines(text))


def test_a_comparison_without_keys_measures_nothing(tmp_path):
    (tmp_path / "m.yaml").write_text("mission: m\ntree: {wait: 1 s, ensure: $n < 3}\n")
    mission = MissionLibrary.load([tmp_path], built_in=False).get("m")
    condition = mission.tree.children[1].condition
    assert compile_expression(condition).measured == {}
