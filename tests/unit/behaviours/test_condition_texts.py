"""What a condition says about itself, and when it wakes the tree."""

import pytest
from py_trees.common import Status

from florence_bt.behaviours.expressions import BadExpression, CompiledExpression
from florence_bt.behaviours.keys import KeyStore
from florence_bt.behaviours.leaves import Condition
from florence_bt.core.outcome import failure
from tests.ticking import make_context

NEAR = CompiledExpression(
    "$distance < 1 m",
    lambda keys: keys.read("distance") < 1.0,
    ("distance", "room"),
    {"distance": lambda value: f"{value} m"},
)


def test_values_are_named_as_their_kinds_are_written():
    assert NEAR.with_values(KeyStore({"distance": 0.5, "room": "hall"})) == "distance is 0.5 m, room is hall"
    assert NEAR.with_values(KeyStore({"distance": 0.5})) == "distance is 0.5 m, room is not known"
    assert CompiledExpression("true", lambda keys: True, ()).with_values(KeyStore()) == ""


def test_a_denial_says_what_does_not_hold_and_why():
    keys = KeyStore({"distance": 2.0, "room": "hall"})
    assert not NEAR.holds(keys)
    assert NEAR.denial(keys) == "$distance < 1 m does not hold (distance is 2.0 m, room is hall)"
    assert CompiledExpression("false", lambda keys: False, ()).denial(KeyStore()) == "false does not hold"


def test_a_condition_is_true_or_false():
    with pytest.raises(BadExpression, match=r"three is 3, neither true nor false"):
        CompiledExpression("three", lambda keys: 3, ()).holds(KeyStore())


def test_a_condition_wakes_the_tree_only_when_its_answer_changes(clock):
    context = make_context(clock, keys={"distance": 0.5, "room": "hall"})
    node = Condition("near?", context, NEAR)
    context.keys.write("distance", 0.6)
    assert not context.wake.take()  # nobody has asked yet
    node.tick_once()
    assert (node.status, node.feedback_message) == (Status.SUCCESS, "distance is 0.6 m, room is hall")
    context.keys.write("distance", 0.7)
    assert not context.wake.take()
    context.keys.write("distance", 2.0)
    assert context.wake.take()
    node.tick_once()
    reason = "$distance < 1 m does not hold (distance is 2.0 m, room is hall)"
    assert (node.status, node.result) == (Status.FAILURE, failure("condition_false", reason))
    context.keys.write("distance", 3.0)
    assert not context.wake.take()
    context.keys.reset({"room": "hall"})
    assert not context.wake.take()
    node.tick_once()
    assert node.result.code == "missing_key"


def test_what_holds_is_put_into_words_only_when_it_is_read_and_computed_once_for_the_same_values(clock):
    computed, shown = [], []
    near = CompiledExpression(
        "$distance < 1 m",
        lambda keys: computed.append(1) or keys.read("distance") < 1.0,
        ("distance",),
        {"distance": lambda value: shown.append(1) or f"{value} m"},
    )
    context = make_context(clock, keys={"distance": 0.5})
    node = Condition("near", context, near)
    for _ in range(3):
        node.tick_once()
    assert (node.status, len(computed), len(shown)) == (Status.SUCCESS, 1, 0)
    context.keys.write("distance", 0.75)
    node.tick_once()
    assert node.feedback_message == node.feedback_message == "distance is 0.75 m"
    assert len(shown) == 1
    context.keys.write("distance", 2.0)
    node.tick_once()
    assert node.status is Status.FAILURE and "distance is 2.0 m" in node.feedback_message
