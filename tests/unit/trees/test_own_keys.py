"""Names of loops belong to their loops; the check tells of branches that write one key."""

import pytest
from py_trees.common import Status

from florence_bt.behaviours.keys import NOTHING, KeyStore, MissingKey, OwnKeys
from tests.unit.trees.language import BROKEN, Play, takes

HEAD = "keys: {one: {type: list of text, default: []}, two: {type: list of text, default: []}}\n"


def notes(key, name="x"):
    """A part that takes a second, then adds what the loop's key holds to a list."""
    return f"{{sequence: [{{wait: 1 s}}, {{append: {{{key}: ${name}}}}}]}}"


@pytest.mark.parametrize("more", ["", ", first_success: true"])
def test_two_loops_at_once_have_each_their_own_item(tmp_path, more):
    first = f"{{for_each: [a, b], as: x, do: {notes('one')}}}"
    second = f"{{for_each: [c, d], as: x, do: {notes('two')}{more}}}"
    play = Play(tmp_path, f"{HEAD}tree: {{parallel: [{first}, {second}]}}")
    assert play.run() == "success"
    items = ("c",) if more else ("c", "d")
    assert (play.keys.read("one"), play.keys.read("two")) == (("a", "b"), items)


def test_two_retries_at_once_count_for_themselves(tmp_path):
    tries = "retry: 3, attempt: n, do: {sequence: [{move: {by: '${$n * 1 m}'}}, work: ]}"
    waits = "between: {sequence: [{wait: 1 s}, {move: {by: '${$n * -1 m}'}}]}"
    play = Play(
        tmp_path,
        f"tree: {{parallel: [{{{tries}, {waits}}}, {{sequence: [{{wait: 0.5 s}}, {{{tries}}}]}}]}}",
        work=[takes(0.0, BROKEN), takes(0.0)],
    )
    assert play.run() == "success"
    assert [run.inputs["by"] for run in play.skills["move"].runs] == [1.0, 1.0, -1.0, 2.0]


def test_each_handler_has_the_failure_that_it_deals_with(tmp_path):
    def branch(code, key):
        said = f"{{sequence: [{{wait: 1 s}}, {{append: {{{key}: $failure_code}}}}]}}"
        return f"{{fail: no, code: {code}, on_failure: {{any: {said}}}}}"

    tree = f"{{parallel: [{branch('red', 'one')}, {branch('blue', 'two')}]}}"
    play = Play(tmp_path, f"{HEAD}tree: {tree}")
    assert play.run() == "success"
    assert (play.keys.read("one"), play.keys.read("two")) == (("red",), ("blue",))


def test_a_loop_in_a_loop_leaves_the_outer_ones_name_alone(tmp_path):
    inner = "{for_each: [a, b], as: x, do: {append: {two: $x}}}"
    tree = f"{{for_each: [c, d], as: x, do: {{sequence: [{inner}, {{append: {{one: $x}}}}]}}}}"
    play = Play(tmp_path, f"{HEAD}tree: {tree}")
    assert play.run() == "success"
    assert (play.keys.read("one"), play.keys.read("two")) == (("c", "d"), ("a", "b") * 2)


def test_after_a_loop_its_names_have_their_last_values(tmp_path):
    loop = "{for_each: [a, b, c], as: x, index: i, first_success: true, do: {condition: $x == 'b'}}"
    play = Play(tmp_path, f"tree: {{sequence: [{loop}, {{set: {{found: $x, number: $i}}}}]}}")
    assert play.run() == "success"
    assert (play.keys.read("found"), play.keys.read("number")) == ("b", 1)


def test_a_condition_in_a_loop_is_woken_by_the_loops_own_name(tmp_path):
    # The loop in the condition's branch goes on; what another branch writes to a key x is nothing to it.
    loop = "{for_each: [a, b], as: x, do: {parallel: [{wait: 2 s, while: $x != 'z'}]}}"
    play = Play(tmp_path, f"tree: {{parallel: [{loop}, {{sequence: [{{wait: 1 s}}, {{set: {{x: z}}}}]}}]}}")
    assert (play.run(), play.clock.now()) == ("success", 4.0)


def test_own_keys_see_what_is_outside_and_are_seen_there():
    outer = KeyStore({"a": 1, "x": 1})
    own = OwnKeys(outer, ["x"])
    heard = []
    end = own.watch(["a", "x"], heard.append)
    assert own.read("a") == 1 and own.peek(["a", "x"]) == (1, NOTHING) and "x" not in own
    with pytest.raises(MissingKey):
        own.read("x")
    own.write("x", 2)
    outer.write("x", 3)
    outer.write("a", 4)
    assert (own.read("x"), outer.read("x"), own.as_dict()) == (2, 3, {"a": 4, "x": 2})
    assert heard == ["x", "a"] and set(own) == {"a", "x"}
    end()
    own.write("x", 5)
    assert heard == ["x", "a"] and outer.read("x") == 5
    inner = OwnKeys(own, ["x"])
    inner.write("x", 6)
    assert (own.read("x"), inner.with_values({"a": 7}).as_dict()) == (5, {"a": 7, "x": 6})


BOTH = "{sequence: [{wait: 1 s}, {set: {n: 1}}, {wait: 1 s}]}"


# A parallel | whether the check tells of a race
@pytest.mark.parametrize(
    ("parallel", "told"),
    [
        (f"[{BOTH}, {{sequence: [{{wait: 1 s}}, {{set: {{n: 2}}}}]}}]", True),
        (f"[{BOTH}, {{retry: 2, attempt: n, do: {{turn: {{angle: 1 deg}}}}}}]", True),
        (f"[{BOTH}, {{get_hotspot: {{label: a}}, out: {{pose: p}}}}]", False),
        (f"[{BOTH}, {BOTH}]", False),  # the same value
        (f"[{{set: {{n: 0}}}}, {BOTH}]", False),  # the first value
        ("[{sequence: [{wait: 1 s}, {set: {n: 1}}]}, {sequence: [{wait: 2 s}, {set: {n: 2}}]}]", True),
        (
            "[{sequence: [{wait: 1 s}, {set: {n: 1}}]}, {sequence: [{wait: 2 s}, {set: {n: 2}}]}],"
            " policy: any",
            False,
        ),
        (f"[{BOTH}, {{sequence: [{{wait: 2 s}}, {{set: {{n: 2}}}}]}}], policy: any", True),
        ("[{for_each: [1], as: n, do: {wait: 1 s}}, {for_each: [2], as: n, do: {wait: 1 s}}]", True),
    ],
)
def test_branches_that_write_one_key_are_told(workshop, parallel, told):
    tree = f"tree:\n  sequence: [{{parallel: {parallel}}}, {{condition: $n > 0}}]\n"
    found = [line for line in workshop.lines(tree) if "another branch writes the key 'n'" in line]
    assert bool(found) is told


@pytest.mark.parametrize(
    "parallel",
    [
        "[{for_each: [1], as: n, do: {wait: $n}}, {for_each: [2], as: n, do: {wait: $n}}]",
        "[{append: {n: a}}, {append: {n: b}}]",
    ],
)
def test_what_does_not_mix_is_not_told(workshop, parallel):
    assert not [line for line in workshop.lines(f"tree: {{parallel: {parallel}}}\n") if "another" in line]


def test_a_stop_ends_loops_with_own_names(tmp_path):
    play = Play(tmp_path, f"{HEAD}tree: {{for_each: [a, b], as: x, do: {notes('one')}}}")
    play.at(1.5)
    play.root.stop(Status.INVALID)
    assert play.keys.read("one") == ("a",)
