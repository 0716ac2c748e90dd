"""The scripts of BehaviorTree.CPP: what they mean, and what is wrong with them."""

import pytest
from florence_btcpp.convert import set_nodes
from florence_btcpp.names import Names, identifier
from florence_btcpp.script import (
    Inexpressible,
    condition_text,
    parse_condition,
    parse_script,
    script_of,
    value_text,
)
from florence_btcpp.values import quantity_text, si_text

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.expressions.parser import parse_expression as parse_ours
from florence_bt.trees.language.quantities import UNITS, read_value


class Keys:
    """Every name in lower case is a key; some have a kind."""

    kinds = {"far": Kind.LENGTH, "n": Kind.INTEGER, "s": Kind.TEXT, "flag": Kind.BOOLEAN, "v": Kind.SPEED}  # noqa: RUF012

    def key(self, foreign):
        return None if foreign.isupper() else foreign

    def key_name(self, foreign):
        return foreign

    def kind(self, foreign):
        return self.kinds.get(foreign)


@pytest.mark.parametrize(
    ("script", "ours"),
    [
        ("flag", "$flag"),
        ("!flag", "not $flag"),
        ("n", "$n != 0"),
        ("s", '$s != ""'),
        ("true", "true"),
        ("0", "false"),
        ("far < 1", "$far < 1 m"),
        ("1.5 > far", "1.5 m > $far"),
        ("far + 0.05 <= 2 * far", "$far + 5 cm <= 2 * $far"),
        ("far * 2 > 3", "$far * 2 > 3 m"),
        ("n < 1 && far < 1 || flag", "$n < 1 and $far < 1 m or $flag"),
        ("flag || n == 1 && n == 2", "($flag or $n == 1) and $n == 2"),
        ("1 < n < 5", "1 < $n and $n < 5"),
        ("s == 'a' && s != RED", '$s == "a" and $s != "RED"'),
        ("!(n == 1)", "not $n == 1"),
        ("-n < -1", "-$n < -1"),
        ("n == 0x10", "$n == 16"),
        ("(n)", "$n != 0"),
    ],
)
def test_conditions(script, ours):
    text = condition_text(parse_condition(script), Keys())
    assert text == ours
    parse_ours(text)


@pytest.mark.parametrize(
    ("script", "nodes"),
    [
        ("a := 1; b := 'x'", [{"set": {"a": "1", "b": "x"}}]),
        ("a := 1; b := a", [{"set": {"a": "1"}}, {"set": {"b": "$a"}}]),
        ("a := 1; a := 2", [{"set": {"a": "1"}}, {"set": {"a": "2"}}]),
        ("far := 0.5", [{"set": {"far": "0.5 m"}}]),
        ("n += 2", [{"set": {"n": "${$n + 2}"}}]),
        ("n = n * (n - 1)", [{"set": {"n": "${$n * ($n - 1)}"}}]),
        ("a := OK", [{"set": {"a": "OK"}}]),
        ("a := n > 1 ? 5 : 6", [{"if": "$n > 1", "then": {"set": {"a": "5"}}, "else": {"set": {"a": "6"}}}]),
        ("n", [{"condition": "true"}]),
        ("s := '30 s'", [{"set": {"s": "30 s"}}]),
    ],
)
def test_assignments(script, nodes):
    assert set_nodes(parse_script(script), Keys(), lambda _: None) == nodes


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("", "the script is empty"),
        (";", "a value is needed before ';'"),
        ("a :=", "a value is needed at the end"),
        ("a := 1 b := 2", "';' is needed before 'b'"),
        ("(a", r"'\)' is needed at the end"),
        ("1 := 2", "only a name can stand before ':='"),
        ("{a} == 1", "'{' has no place in a script"),
        ("'open", '"\'" has no place'),
        ("(" * 60 + "a" + ")" * 60, "nested more than 40 deep"),
        ("a" * 10_001, "more than 10000 characters"),
    ],
)
def test_broken_scripts(script, message):
    with pytest.raises(ConfigError, match=message):
        parse_script(script)


@pytest.mark.parametrize(
    "script", ["a & 1", "a | b", "a ^ b", "~a", "s + 'x' == 'y'", "(a ? b : c) == 1", "(a := 1) == 1"]
)
def test_what_expressions_do_not_have(script):
    with pytest.raises(ConfigError, match="no equivalent"):
        condition_text(parse_condition(script), Keys())


@pytest.mark.parametrize(
    ("ours", "script"),
    [
        ("$a < 30 cm", "a < 0.3"),
        ("$a and $b or not $c", "(a && b) || !c"),
        ("$a and ($b or $c)", "a && (b || c)"),
        ("not ($a < 1)", "!(a < 1)"),
        ("$a + 2 * $b - 3", "(a + (2 * b)) - 3"),
        ("-($a + 1) > 0", "-(a + 1) > 0"),
        ('$s == "red" or true', "s == 'red' || true"),
    ],
)
def test_our_expressions_as_scripts(ours, script):
    assert script_of(parse_ours(ours).term) == script
    parse_condition(script)


@pytest.mark.parametrize("ours", ["$p.x < 1 m", "abs($a) > 1", '$s == "it\'s"', "$s == 'é'"])
def test_expressions_that_no_script_can_say(ours):
    with pytest.raises(Inexpressible):
        script_of(parse_ours(ours).term)


def test_values_take_the_unit_that_is_wanted():
    assert value_text(parse_condition("far * 2 + 1"), Keys(), Kind.LENGTH) == "$far * 2 + 1 m"
    assert value_text(parse_condition("2 + 1"), Keys(), Kind.LENGTH) == "2 m + 1 m"
    assert value_text(parse_condition("2 * 3"), Keys(), Kind.DURATION) == "2 s * 3"


@pytest.mark.parametrize("kind", list(UNITS))
@pytest.mark.parametrize("value", [0.0, 0.1, 1.0, 90.0, 0.7853981633974483, 1 / 3, 1e-9, 2345.678, -2.5])
def test_quantities_are_read_back_exactly(kind, value):
    assert read_value(quantity_text(value, kind), kind) == value
    assert float(si_text(value)) == value


def test_names():
    names = {
        "ComputePathToPose": "compute_path_to_pose",
        "GoTo2D": "go_to2_d",
        "my-node": "my_node",
        "9lives": "x_9lives",
    }
    assert {name: identifier(name) for name in names} == names
    given = Names("key", {"wait"})
    assert [given.of(name) for name in ("A", "a", "A", "wait", "é")] == ["a", "a_2", "a", "key_wait", "key"]
