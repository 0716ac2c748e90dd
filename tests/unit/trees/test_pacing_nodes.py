"""``once``, declared keys and expressions as values."""

import pytest

from florence_bt.core.errors import ConfigError
from tests.unit.trees.dumps import ascii_tree
from tests.unit.trees.language import BROKEN, ENDLESS, Play, measured, takes


@pytest.mark.parametrize(("result", "status"), [(None, "success"), (BROKEN, "broken")])
def test_once_keeps_its_first_result(tmp_path, result, status):
    tree = "{sequence: [{repeat: 3, do: {succeed: {once: {work: }}}}, {name: again, once: {other: }}]}"
    play = Play(tmp_path, f"tree: {tree}", work=[takes(1.0, result)])
    assert (play.run(), [skill for _, skill in play.started]) == ("success", ["work", "other"])
    again = Play(tmp_path, "tree: {repeat: 2, do: {once: {work: }}}", work=[takes(1.0, result)])
    assert again.run() == status
    assert len(again.started) == 1


def test_once_remembers_why_it_failed(tmp_path):
    play = Play(tmp_path, "tree: {retry: 2, do: {once: {work: }}}", work=[takes(1.0, BROKEN)])
    assert play.run() == "broken"
    assert play.why.reason == "2 of 2 attempts failed; last: it broke"
    # The leaf of the first time is the cause, also when its failure is only repeated.
    assert play.why.path == "m/once work/work"


def test_a_reason_of_once_words_the_repeated_failure_too(tmp_path):
    tree = '{retry: 2, do: {once: {work: , because: "$n is out"}, because: {broken: "told again"}}}'
    head = "keys: {n: {type: integer, default: 1}}\n"
    play = Play(tmp_path, f"{head}tree: {tree}", work=[takes(1.0, BROKEN)])
    assert play.run() == "broken"
    assert play.why.reason == "2 of 2 attempts failed; last: told again"


def test_what_was_stopped_before_its_end_is_done_again(tmp_path):
    tree = "{retry: 2, do: {timeout: 2 s, do: {once: {work: }}}}"
    play = Play(tmp_path, f"tree: {tree}", work=[ENDLESS, takes(1.0)])
    assert (play.run(), len(play.started)) == ("success", 2)


# ---- keys and expressions -----------------------------------------------------------------------------


def test_declared_keys_begin_with_their_defaults_in_every_call(tmp_path):
    called = (
        "keys: {n: {type: integer, default: 3}}\noutputs: {n: {type: integer}}\ntree: {set: {n: '${$n + 1}'}}"
    )
    tree = "{repeat: 2, do: {run: called, out: {n: seen}}}"
    play = Play(tmp_path, f"tree: {tree}", others={"called": called})
    assert play.run() == "success"
    assert play.keys.read("seen") == 4


@pytest.mark.parametrize(
    ("port", "distance", "status"),
    [
        ("{type: length}", 1.5, "success"),
        ("{type: length, max: 1 m}", 1.5, "bad_output"),
        ("{type: text}", 1.5, "bad_output"),
    ],
)
def test_what_is_written_must_fit_the_declaration(tmp_path, port, distance, status):
    text = f"keys: {{d: {port}}}\ntree: {{measure: , out: {{distance: d}}}}"
    play = Play(tmp_path, text, measure=[measured(distance)])
    assert play.run() == status
    if status != "success":
        assert "d" not in play.keys and "the key 'd' cannot hold this" in play.why.reason


def test_set_writes_all_or_nothing(tmp_path):
    head = "keys: {n: {type: integer, max: 3}}\ninputs: {x: {type: integer, default: 7}}\n"
    play = Play(tmp_path, f"{head}tree: {{set: {{a: 1, n: $x}}}}")
    assert play.run() == "bad_output"
    assert "a" not in play.keys


def test_an_output_of_a_mission_has_its_type(tmp_path):
    text = "outputs: {d: {type: length}}\ntree: {sequence: [{measure: , out: {label: x}}, {set: {d: $x}}]}"
    assert Play(tmp_path, text, measure=[measured(1.0)]).run() == "bad_output"


def test_expressions_as_values(tmp_path):
    text = """
inputs: {start: {type: pose, default: {x: 1 m, y: 2 m, yaw: 0}}, step: {type: length, default: 50 cm}}
tree:
  sequence:
    - set: {goal: {x: "${$start.x + 2 * $step}", y: "${-$start.y}", yaw: "${$start.yaw + 90 deg}"}}
    - move: {by: "${distance($start, $goal) / 10}"}
    - wait: ${abs($start.y - $step) / 0.5 m/s}
    - set: {text: "moved by $step", odd: "${1 + 1 == 2}"}
"""
    text = text.replace("{type: pose, default: {x: 1 m, y: 2 m, yaw: 0}}", "{type: pose}")
    play = Play(tmp_path, text, {"start": "{x: 1 m, y: 2 m, yaw: 0}"})
    assert play.run() == "success"
    goal = play.keys.read("goal")
    assert (goal.x, goal.y, goal.yaw) == (2.0, -2.0, pytest.approx(1.5708, abs=1e-4))
    assert play.skills["move"].calls == [{"by": pytest.approx(17**0.5 / 10)}]
    assert play.clock.now() == pytest.approx(3.0)
    assert (play.keys.read("text"), play.keys.read("odd")) == ("moved by 0.5 m", True)


def test_the_result_of_an_expression_is_held_against_the_limits(tmp_path):
    text = "inputs: {d: {type: length, default: 3 m}}\ntree: {move: {by: '${$d}'}}"
    play = Play(tmp_path, text)
    assert play.run() == "bad_input"
    assert play.started == []


@pytest.mark.parametrize(
    ("tree", "place", "message"),
    [
        ("{move: {by: '${1.5 m * 2}'}}", "3:22", "above the maximum"),
        ("{move: {by: '${$d * 2}'}}", "3:22", "'$d * 2' is a duration; a length is needed"),
        ("{move: {by: '$d + 1 m'}}", "3:19", 'would have worked: "${$d + 1 m}"'),
        ("{wait: '${$d + 1}'}", "3:20", "needs two of one kind"),
        ("{work: , when: $d > 3}", "3:25", "needs two of one kind"),
        ("{condition: $d}", "3:19", "true or false is needed"),
        ("{wait: '${1 s / 0}'}", "3:17", "divided by zero"),
    ],
)
def test_errors_in_expressions_stop_the_compiler_with_their_place(tmp_path, tree, place, message):
    with pytest.raises(ConfigError) as caught:
        Play(tmp_path, f"inputs: {{d: {{type: duration, default: 1 s}}}}\ntree: {tree}")
    assert message in str(caught.value)
    assert f"m.yaml:{place}:" in str(caught.value)


def test_dumps_show_the_values_behind_titles(tmp_path):
    text = """
inputs: {looks: {type: integer, default: 8}, pause: {type: duration, default: 90 s}}
tree:
  retry: $looks
  do:
    timeout: $pause
    do: {switch: $looks, cases: {8: {work: }}}
"""
    play = Play(tmp_path, text)
    assert ascii_tree(play.root).splitlines()[0] == "[ ] m"
    assert "retry" not in ascii_tree(play.root)
    play = Play(
        tmp_path,
        text.replace("tree:\n  retry", "tree:\n sequence:\n - retry").replace(
            "\n  do:\n    timeout", "\n   do:\n    timeout"
        ),
    )
    assert "retry up to $looks times" in ascii_tree(play.root)
    assert play.run() == "success"
    shown = ascii_tree(play.root)
    for title in ("retry up to 8 times", "within 90 s", "switch 8"):
        assert title in shown
    assert any("retry up to $looks times" in node.name for node in play.root.iterate())
