import pytest

# ruff: noqa: E501  (cases on one line)
from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.language.expressions.parser import (
    MAX_LENGTH,
    MAX_NESTING,
    MAX_TOKENS,
    closing_brace,
    parse_expression,
)
from florence_bt.trees.language.expressions.syntax import Binary, Function, keys_of, print_term, start_of


def grouped(text):
    """The text with every operation in parentheses."""

    def group(term):
        match term:
            case Binary(operator=operator, left=left, right=right):
                return f"({group(left)} {operator} {group(right)})"
            case Function(name=name, arguments=arguments):
                return f"{name}({', '.join(group(a) for a in arguments)})"
        return f"({print_term(term)})" if hasattr(term, "operator") else print_term(term)

    return group(parse_expression(text).term)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("$a < 1 m and not $b or $c == 2", "((($a < 1 m) and (not $b)) or ($c == 2))"),
        ("$a - $b - $c", "(($a - $b) - $c)"),
        ("$a / $b * $c", "(($a / $b) * $c)"),
        ("$a + $b * $c", "($a + ($b * $c))"),
        ("($a + $b) * $c", "(($a + $b) * $c)"),
        ("-$a * $b", "((-$a) * $b)"),
        ("- - 2", "(--2)"),
        ("not $a == $b", "(not $a == $b)"),
        ("not not $a", "(not not $a)"),
        ("$pose.x + distance($a, ${b}) / 2", "($pose.x + (distance($a, $b) / 2))"),
        ("$d/2 m/s", "($d / 2 m/s)"),
        ("1 m/$t", "(1 m / $t)"),
        ("min(0.5 m,$d)<=.5m", "(min(0.5 m, $d) <= .5m)"),
        ("'it''s'", None),
        ("$room == 'a \"b\"'", "($room == 'a \"b\"')"),
        ("90 ° > 1e-3 rad", "(90 ° > 1e-3 rad)"),
        ("true", "true"),
    ],
)
def test_what_belongs_together(text, expected):
    if expected is None:
        with pytest.raises(ConfigError):
            parse_expression(text)
    else:
        assert grouped(text) == expected


# What is written | column of the problem | what is wrong | what would have worked
WRONG = """
kitchen == $room      | 1 | neither a key nor text | $kitchen, "kitchen"
$room == kitchen      | 10 | neither a key nor text | $kitchen, "kitchen"
$a = 3                | 4 | not known here | ==
$a && $b              | 4 | not known here | and
$a === 3              | 4 | not known here | ==
$a <> 3               | 4 | not known here | !=
!$a                   | 1 | not known here | not
$a is 3               | 4 | an operator is needed | ==
1 < $x < 3            | 8 | cannot be chained | $a < $b and $b < $c
$pose. > 1            | 6 | a pose has no part | .x, .y, .yaw
min($a)               | 1 | needs 2 values, not 1 | min($a, $b)
abs()                 | 1 | needs 1 value, not 0 | abs($a)
mn($a, 1)             | 1 | no function 'mn' | min(...)
5 meters              | 3 | 'meters' is not a unit | 5 m
$a > 5 mm2            | 8 | 'mm2' is not a unit | 5 mm
5. meters             | 4 | 'meters' is not a unit | 5. m
5 m m                 | 5 | cannot follow '5 m' | and, or, <, ==, +, *
$battery > 20 %       | 15 | not known here | a number between 0 and 1
($a                   | 1 | this ( is not closed | )
max($a, 1             | 4 | this ( is not closed | )
$a)                   | 3 | this ) closes nothing |
"abc                  | 1 | the text has no end | a closing "
$A > 1                | 1 | a $ must stand before | $a
$a >                  | 5 | a value is missing after '>' | $key, 1.5 m
* 2                   | 1 | a value is needed before '*' | $key, 1.5 m
$a $b                 | 4 | an operator is missing before '$b' | and, or, ==, !=, <, <=, >, >=, in, +, -, *, /
True                  | 1 | written in lower case | true
$a AND $b             | 4 | an operator is needed, not 'AND' | and
and $a                | 1 | a value is needed before 'and' | $key, true
nt $a                 | 1 | neither a key nor text | $nt, "nt", not
1e999                 | 1 | too large | 2.5
$a in [1              | 7 | this [ is not closed | ]
__import__('os')    | 1 | no function '__import__' | abs(...), bearing(...), count(...), distance(...), max(...), min(...)
$a; $b                | 3 | no place in an expression |
"""


@pytest.mark.parametrize("line", WRONG.strip().splitlines())
def test_what_is_wrong_is_said_with_its_place(line):
    text, column, message, valid = (part.strip() for part in line.split(" |", 3))
    with pytest.raises(ConfigError) as caught:
        parse_expression(text)
    assert message in caught.value.problem
    assert (caught.value.line, caught.value.column) == (1, int(column))
    assert ", ".join(caught.value.valid) == valid


@pytest.mark.parametrize(
    "text",
    [
        "1" + "+1" * MAX_TOKENS,
        "(" * (MAX_NESTING + 1) + "1" + ")" * (MAX_NESTING + 1),
        "-" * (MAX_NESTING + 1) + "1",
        "not " * (MAX_NESTING + 1) + "$a",
        "abs(" * (MAX_NESTING + 1) + "1" + ")" * (MAX_NESTING + 1),
        " " * (MAX_LENGTH + 1),
        "(" * MAX_LENGTH,
    ],
)
def test_what_is_too_large_is_refused(text):
    with pytest.raises(ConfigError, match=r"at most|more than"):
        parse_expression(text)


def test_a_long_chain_of_the_allowed_length_works():
    text = "+".join(["1"] * (MAX_TOKENS // 2 - 1))
    assert len(list(print_term(parse_expression(text).term))) == 4 * (MAX_TOKENS // 2 - 1) - 3


@pytest.mark.parametrize(
    "text",
    [
        "1".ljust(MAX_LENGTH),
        "-" + "+".join(["1"] * (MAX_TOKENS // 2)),
        "(" * MAX_NESTING + "1" + ")" * MAX_NESTING,
        "-" * MAX_NESTING + "1",
    ],
)
def test_what_is_as_large_as_is_allowed_is_read(text):
    parse_expression(text)


def test_words_and_signs_are_counted_as_the_message_says():
    with pytest.raises(ConfigError, match=f"of {MAX_TOKENS + 1} words and signs; at most {MAX_TOKENS} are"):
        parse_expression("+".join(["1"] * (MAX_TOKENS // 2 + 1)))


def test_every_part_knows_its_place():
    expression = parse_expression("$a.x + min($b, 2 m) > -$c", Position(7, 11))
    assert [(key.key, key.position.line, key.position.column) for key in keys_of(expression.term)] == [
        ("a", 7, 11),
        ("b", 7, 22),
        ("c", 7, 34),
    ]
    assert expression.term.position == Position(7, 31)
    assert start_of(expression.term) == Position(7, 11)
    assert expression.keys == ("a", "b", "c")


def test_a_text_over_several_lines_knows_only_where_it_begins():
    expression = parse_expression("$a\n and $b", Position(3, 5), exact=False)
    assert {key.position for key in keys_of(expression.term)} == {Position(3, 5)}
    assert expression.text == "$a and $b"


@pytest.mark.parametrize(
    ("text", "end"),
    [("$a}", 2), ("'}' }", 4), ("${a} + 1}", 8), ("$a", None), ('"}', None), ("}}", 0)],
)
def test_where_an_expression_ends(text, end):
    assert closing_brace(text, 0) == end
