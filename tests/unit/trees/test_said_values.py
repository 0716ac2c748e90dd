"""Values in what is said: bare numbers, and units of what is computed."""

# ruff: noqa: E501  (missions on one line)

import pytest

from florence_bt.behaviours.why import explain
from tests.unit.trees.language import Play

KEYS = (
    "inputs: {n: {type: integer, default: 3}, p: {type: duration, default: 90 min}, ok: {type: boolean,"
    " default: true}, at: {type: pose, default: {x: 1 m, y: 2 m, yaw: 0}}, place: {type: text, default: hall}}\n"
)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("$n", "3"),
        ("$p", "90 min"),
        ("$ok", "true"),
        ("'${$n + 1}'", "4"),
        ("'${$p * 2}'", "3 h"),
        ("'${2 * 45 min}'", "90 min"),
        ("'${$place}'", "hall"),
    ],
)
def test_a_number_is_given_where_any_text_will_do(tmp_path, given, said):
    other = {
        "other": "inputs: {words: {type: text}}\noutputs: {said: {type: text}}\ntree: {set: {said: $words}}\n"
    }
    tree = f"tree: {{sequence: [{{run: other, with: {{words: {given}}}, out: {{said: said}}}}, {{fail: $said}}]}}"
    play = Play(tmp_path, KEYS + tree, others=other)
    assert play.run() == "failed"
    assert explain(play.root).reason == said


@pytest.mark.parametrize(
    ("reason", "said"),
    [("$p", "90 min"), ("'${$p / 3}'", "30 min"), ("after $p", "after 90 min"), ("$n", "3")],
)
def test_a_reason_has_its_unit(tmp_path, reason, said):
    play = Play(tmp_path, f"{KEYS}tree: {{fail: {reason}}}")
    assert (play.run(), explain(play.root).reason) == ("failed", said)


@pytest.mark.parametrize(("added", "held"), [("$p", "a 90 min"), ("'${$p / 3}'", "a 30 min"), ("$n", "a 3")])
def test_what_is_appended_to_a_text_has_its_unit(tmp_path, added, held):
    play = Play(tmp_path, f"{KEYS}tree: {{sequence: [{{set: {{t: 'a '}}}}, {{append: {{t: {added}}}}}]}}")
    assert (play.run(), play.keys.read("t")) == ("success", held)


def test_a_number_names_no_place_and_a_pose_is_no_text(workshop):
    for node, problem in (
        ("get_hotspot: {label: $n}", "label: a text is needed, but $n is an integer"),
        ("get_hotspot: {label: '${$n + 1}'}", "a text is needed"),
        ("run: other, with: {words: $at}", "words: a text is needed, but $at is a pose"),
    ):
        workshop.write("inputs: {words: {type: text}}\ntree: {fail: $words}\n", "other")
        assert any(problem in line for line in workshop.lines(f"{KEYS}tree: {{{node}}}\n")), node
