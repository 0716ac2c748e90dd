"""``add``: numbers and quantities that are added to keys."""

# ruff: noqa: E501  (missions on one line)

import pytest

from tests.unit.trees.language import Play

KEYS = "keys: {n: {type: integer, default: 1}, d: {type: duration, default: 1 min}, most: {type: integer, default: 0, max: 2}}\n"


@pytest.mark.parametrize(
    ("node", "keys"),
    [
        ("add: {n: 1}", {"n": 2}),
        ("add: {n: -1}", {"n": 0}),
        ("add: {n: $n}", {"n": 2}),
        ('add: {n: "${$n * 3}"}', {"n": 4}),
        ('add: {n: 1, d: "${10 s * $n}"}', {"n": 2, "d": 70.0}),
        ("repeat: 3, do: {add: {n: 2, d: 1 h}}", {"n": 7, "d": 10860.0}),
    ],
)
def test_what_is_added(tmp_path, node, keys):
    play = Play(tmp_path, f"{KEYS}tree: {{{node}}}")
    assert play.run() == "success"
    assert {key: play.keys.read(key) for key in keys} == keys


@pytest.mark.parametrize(
    ("node", "code"), [("add: {most: 3, n: 1}", "bad_output"), ("add: {other: 1, n: 1}", "missing_key")]
)
def test_all_are_added_to_or_none(tmp_path, node, code):
    play = Play(tmp_path, f"{KEYS}tree: {{{node}}}")
    assert play.run() == code
    assert play.keys.read("n") == 1


@pytest.mark.parametrize(
    ("node", "line"),
    [
        ("add: {n: 1, d: 10 s}", ""),
        ("add: {n: 1 s}", "n: '$n' is an integer and '1 s' is a duration: '+' needs two of one kind"),
        ("add: {t: a}", "add: 'a' is no number and no quantity | append: {t: a}, to a text or a list"),
        ("add: {t: $t}", "t: '+' adds numbers, and puts no texts together"),
        ("add: {other: 1}", "the key 'other' is read before any node has written it"),
        ("add: n", "add needs keys and values | add: {n: 1}"),
        ("add: ", "add needs keys and values | add: {key: 1}"),
        (
            "append: {n: 1}",
            "append: $n is an integer, and only a text or a list can be added to | add: {n: 1}",
        ),
        ("add: {n: 1}, do: {wait: 1 s}", "'do' does not belong to 'add'"),
    ],
)
def test_what_the_check_says(workshop, node, line):
    head = KEYS.replace("keys: {", "keys: {t: {type: text, default: a}, ")
    tree = f"sequence: [{{{node}}}, {{fail: $n $d $t}}]"
    found = workshop.lines(f"description: d\n{head}tree: {{{tree}}}\n")
    assert (
        any(line in each for each in found) if line else [each for each in found if "error" in each] == []
    ), found
