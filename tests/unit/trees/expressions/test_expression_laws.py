"""Laws of expressions on random ones: printing and parsing, exact values, and the soundness of the units."""

import random
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.behaviours.expressions import BadExpression
from florence_bt.behaviours.keys import KeyStore
from florence_bt.core.declaration import Kind
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.expressions.compiling import compile_expression
from florence_bt.trees.language.expressions.parser import parse_expression
from florence_bt.trees.language.expressions.syntax import (
    Binary,
    Constant,
    Expression,
    Function,
    Key,
    Listed,
    PosePart,
    Unary,
    print_term,
)
from tests.sweeps import examples

HERE = Position()
NUMBERS = st.one_of(
    st.integers(0, 9).map(lambda n: Constant(n, Kind.INTEGER, str(n), HERE)),
    st.sampled_from("abc").map(lambda name: Key(name, HERE)),
)


def larger_numbers(smaller):
    return st.one_of(
        st.builds(Binary, st.sampled_from("+-*/"), smaller, smaller, st.just(HERE)),
        st.builds(Unary, st.just("-"), smaller, st.just(HERE)),
        st.builds(Function, st.sampled_from(["min", "max"]), st.tuples(smaller, smaller), st.just(HERE)),
        st.builds(Function, st.just("abs"), st.tuples(smaller), st.just(HERE)),
    )


SUMS = st.recursive(NUMBERS, larger_numbers, max_leaves=8)
COMPARISONS = st.builds(
    Binary, st.sampled_from(["==", "!=", "<", "<=", ">", ">="]), SUMS, SUMS, st.just(HERE)
)
LISTS = st.builds(Listed, st.lists(SUMS, min_size=1, max_size=3).map(tuple), st.just(HERE))
CONTAINED = st.builds(Binary, st.just("in"), SUMS, LISTS, st.just(HERE))
CONDITIONS = st.recursive(
    st.one_of(
        COMPARISONS, CONTAINED, st.booleans().map(lambda b: Constant(b, Kind.BOOLEAN, str(b).lower(), HERE))
    ),
    lambda smaller: st.one_of(
        st.builds(Binary, st.sampled_from(["and", "or"]), smaller, smaller, st.just(HERE)),
        st.builds(Unary, st.just("not"), smaller, st.just(HERE)),
    ),
    max_leaves=5,
)


def nowhere(term):
    """A term with every part at the same place."""
    match term:
        case Binary(operator=operator, left=left, right=right):
            return Binary(operator, nowhere(left), nowhere(right), HERE)
        case Unary(operator=operator, operand=operand):
            return Unary(operator, nowhere(operand), HERE)
        case Function(name=name, arguments=arguments):
            return Function(name, tuple(nowhere(argument) for argument in arguments), HERE)
        case Listed(items=items):
            return Listed(tuple(nowhere(item) for item in items), HERE)
        case PosePart(pose=pose, part=part):
            return PosePart(nowhere(pose), part, HERE)
        case Constant(value=value, kind=kind, text=text):
            return Constant(value, kind, text, HERE)
        case Key(key=key):
            return Key(key, HERE)


@given(st.one_of(SUMS, CONDITIONS))
def test_a_printed_expression_parses_to_itself(term):
    assert nowhere(parse_expression(print_term(term)).term) == term


def exactly(text, keys):
    """Python's own reading of the text, in exact fractions."""
    for name in keys:
        text = text.replace(f"${name}", f"keys[{name!r}]")
    for digit in range(10):
        text = text.replace(f"{digit}", f"F({digit})")
    text = text.replace("true", "True").replace("false", "False")
    return eval(text, {"F": Fraction, "keys": keys, "min": min, "max": max, "abs": abs})


@settings(max_examples=examples(300))
@given(st.one_of(SUMS, CONDITIONS), st.lists(st.integers(-5, 5), min_size=3, max_size=3))
def test_values_are_those_of_exact_arithmetic(term, numbers):
    keys = dict(zip("abc", numbers, strict=True))
    text = print_term(term)
    formula = compile_expression(parse_expression(text))
    try:
        expected = exactly(text, {name: Fraction(value) for name, value in keys.items()})
    except ZeroDivisionError:
        with pytest.raises(BadExpression, match="divided by zero"):
            formula.resolve(KeyStore(keys))
        return
    value = formula.resolve(KeyStore(keys))
    if isinstance(expected, bool):
        assert value is expected
    else:
        assert value == pytest.approx(float(expected), rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        # Sums of decimals have errors of rounding, whole numbers have none.
        ("(0.1 + 0.7) * 10 == 8", True),
        ("(0.1 + 0.7) * 10 == $eight", True),
        ("(0.1 + 0.7) * 10 < 8", False),
        ("(0.1 + 0.7) * 10 >= $eight", True),
        ("(0.1 + 0.7) * 10 != 8.001", True),
        ("9007199254740993 == 9007199254740992", False),
        ("9007199254740993 > 9007199254740992", True),
    ],
)
def test_what_counts_as_equal(text, holds):
    assert compile_expression(parse_expression(text)).resolve(KeyStore({"eight": 8})) is holds


KINDS = {
    "d": Kind.LENGTH,
    "e": Kind.LENGTH,
    "t": Kind.DURATION,
    "u": Kind.DURATION,
    "v": Kind.SPEED,
    "w": Kind.SPEED,
    "g": Kind.ANGLE,
    "n": Kind.NUMBER,
    "i": Kind.INTEGER,
    "f": Kind.BOOLEAN,
}


def random_term(rng, depth):
    """Any expression over the keys, most of them nonsense."""
    if depth == 0 or rng.random() < 0.2:
        return Key(rng.choice(list(KINDS)), HERE) if rng.random() < 0.85 else parse_expression("0").term
    below = depth - 1
    operator = rng.choice(
        ["+", "-", "*", "/", "*", "/", "<", ">=", "==", "and", "or", "not", "-x", "min", "abs"]
    )
    if operator in ("not", "-x"):
        return Unary(operator[:3].rstrip("x"), random_term(rng, below), HERE)
    if operator == "abs":
        return Function("abs", (random_term(rng, below),), HERE)
    left, right = random_term(rng, below), random_term(rng, below)
    return Function("min", (left, right), HERE) if operator == "min" else Binary(operator, left, right, HERE)


def test_what_passes_the_check_does_not_depend_on_the_choice_of_units():
    # In other units (lengths 8 times, durations 4 times, angles 2 times as large a number) a right expression
    # says the same: a length comes out 8 times as large, a speed twice, a truth as it was. (Powers of two:
    # no rounding comes in between.)
    sizes = {Kind.LENGTH: 8, Kind.DURATION: 4, Kind.SPEED: 2, Kind.ANGLE: 2}
    rng = random.Random(7)
    passed = 0
    for _ in range(15_000):
        expression = Expression("", random_term(rng, rng.randint(1, 4)), HERE)
        checked = check_kinds(expression, KINDS)
        if checked.problems:
            continue
        keys = {name: rng.choice([True, False]) if name == "f" else rng.randint(1, 9) for name in KINDS}
        other = {
            name: value * sizes.get(KINDS[name], 1) if name != "f" else value for name, value in keys.items()
        }
        formula = compile_expression(expression)
        try:
            value, scaled = formula.resolve(KeyStore(keys)), formula.resolve(KeyStore(other))
        except BadExpression as error:
            assert "divided by zero" in str(error)
            continue
        passed += 1
        assert (type(value) is bool) == (checked.kind is Kind.BOOLEAN)
        assert scaled == (value if isinstance(value, bool) else value * sizes.get(checked.kind, 1)), (
            print_term(expression.term)
        )
    assert passed > 1500


def test_what_the_check_refuses_is_mostly_for_a_reason():
    # Among small sums of two keys the check refuses exactly those of two kinds.
    for first, second in ((a, b) for a in KINDS for b in KINDS):
        plain = {KINDS[first], KINDS[second]} <= {Kind.INTEGER, Kind.NUMBER}
        right = KINDS[first] is not Kind.BOOLEAN and (KINDS[first] is KINDS[second] or plain)
        assert (not check_kinds(parse_expression(f"${first} + ${second}"), KINDS).problems) is right
