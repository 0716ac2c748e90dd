import pytest

from florence_bt.core.declaration import Kind
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.expressions.parser import parse_expression

KINDS = {
    "d": Kind.LENGTH,
    "t": Kind.DURATION,
    "v": Kind.SPEED,
    "a": Kind.ANGLE,
    "n": Kind.NUMBER,
    "i": Kind.INTEGER,
    "s": Kind.TEXT,
    "f": Kind.BOOLEAN,
    "p": Kind.POSE,
}


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("$v * $t", Kind.LENGTH),
        ("$t * $v", Kind.LENGTH),
        ("$d / $t", Kind.SPEED),
        ("$d / $v", Kind.DURATION),
        ("$d / $d", Kind.NUMBER),
        ("$d * 2", Kind.LENGTH),
        ("2.5 * $a", Kind.ANGLE),
        ("$t / 3", Kind.DURATION),
        ("$i + $n", Kind.NUMBER),
        ("$i * $i", Kind.INTEGER),
        ("$i / $i", Kind.NUMBER),
        ("max(0, $d)", Kind.LENGTH),
        ("0 + $v", Kind.SPEED),
        ("$p.x - 1 m", Kind.LENGTH),
        ("$p.yaw", Kind.ANGLE),
        ("distance($p, $p)", Kind.LENGTH),
        ("bearing($p, $p)", Kind.ANGLE),
        ("abs(-$a)", Kind.ANGLE),
        ("$d < 0 and $s == 'x' or $p != $p", Kind.BOOLEAN),
        ("$unknown + 1 m", Kind.LENGTH),
        ("$unknown * $d", None),
        ("$unknown and $f", Kind.BOOLEAN),
    ],
)
def test_kinds(text, kind):
    checked = check_kinds(parse_expression(text), KINDS)
    assert (checked.kind, checked.problems) == (kind, ())


@pytest.mark.parametrize(
    ("text", "column", "message", "valid"),
    [
        ("$d < 3", 4, "'$d' is a length and '3' is an integer", ("3 m", "3 cm", "3 mm", "3 km")),
        ("$d + $t", 4, "'+' needs two of one kind", ()),
        ("1 + $a", 3, "'1' is an integer and '$a' is an angle", ("1 deg", "1 °", "1 rad")),
        ("$d * $d", 4, "a length cannot be multiplied with a length", ("$d * 2", "speed * duration")),
        ("2 / $t", 3, "an integer cannot be divided by a duration", ()),
        ("not $d", 5, "'not' needs true or false, but '$d' is a length", ("$d > 0 m",)),
        ("$f and $s", 8, "'and' needs true or false, but '$s' is a text", ('$s == "kitchen"',)),
        ("$s < 'b'", 1, "'<' needs numbers or quantities, but '$s' is a text", ('$s == "b"', '$s != "b"')),
        ("$s == $n", 4, "needs two of one kind", ()),
        ("$s == 3", 4, "needs two of one kind", ('"3"',)),
        ("$p + $d", 1, "'$p' is a pose", ("$p.x",)),
        ("$d.x", 1, "'.x' needs a pose, but '$d' is a length", ()),
        ("distance($p, $d)", 14, "'distance' needs a pose", ()),
        ("bearing($d, $p)", 9, "'bearing' needs a pose", ()),
        ("abs($s)", 5, "'abs' needs a number or a quantity", ()),
        ("-$f", 2, "'-' needs a number or a quantity, but '$f' is true or false", ()),
    ],
)
def test_what_cannot_be_computed(text, column, message, valid):
    (problem,) = check_kinds(parse_expression(text), KINDS).problems
    assert message in problem.message
    assert problem.position.column == column
    assert problem.valid == valid


def test_every_problem_is_found():
    problems = check_kinds(parse_expression("$d < 3 and $s and not $t == 4 s"), KINDS).problems
    assert [problem.position.column for problem in problems] == [4, 12]


@pytest.mark.parametrize(
    ("text", "wanted", "valid"),
    [
        ("$d", Kind.BOOLEAN, ("$d > 0 m",)),
        ("$n", Kind.INTEGER, ()),
        ("$p", Kind.LENGTH, ("$p.x", "$p.y")),
        ("2", Kind.SPEED, ("2 m/s", "2 cm/s", "2 km/h")),
        ("$s", Kind.BOOLEAN, ('$s == "kitchen"',)),
    ],
)
def test_what_is_wanted(text, wanted, valid):
    (problem,) = check_kinds(parse_expression(text), KINDS, wanted).problems
    assert "is needed" in problem.message and problem.valid == valid


@pytest.mark.parametrize(("text", "wanted"), [("0", Kind.SPEED), ("$i", Kind.NUMBER), ("$what", Kind.POSE)])
def test_what_fits(text, wanted):
    assert check_kinds(parse_expression(text), KINDS, wanted).problems == ()


@pytest.mark.parametrize(
    ("text", "column", "wrong", "meant"),
    [
        ("not($i == 3 or 4)", 16, "'4' beside 'or'", "not ($i == 3 or $i == 4)"),
        ("$i == 3 or 4", 12, "'4' beside 'or'", "$i == 3 or $i == 4"),
        ("$i == 3 or 4 or 5", 12, "'4' beside 'or'", "$i == 3 or $i == 4 or $i == 5"),
        ('$s == "x" or "y"', 14, "'\"y\"' beside 'or'", '$s == "x" or $s == "y"'),
        ('$s != "x" or "y"', 14, "'\"y\"' beside 'or'", '$s != "x" and $s != "y"'),
        ('$s == "x" and "y"', 15, "'\"y\"' beside 'and'", '$s == "x" or $s == "y"'),
        ("$i == (3 or 4)", 8, "'3' beside 'or'", "$i == 3 or $i == 4"),
        ('$f and $s != ("x" or "y")', 15, "'\"x\"' beside 'or'", '$f and ($s != "x" and $s != "y")'),
        ("3 or 4 == $i", 1, "'3' beside 'or'", "3 == $i or 4 == $i"),
        ("$i or $n == 3", 1, "'$i' beside 'or'", "$i == 3 or $n == 3"),
        ("$d < 2 m or 4 m", 13, "'4 m' beside 'or'", "$d < 2 m or $d < 4 m"),
        ('$s in $l or "y"', 13, "'\"y\"' beside 'or'", '$s in $l or "y" in $l'),
        ('not $s == "x" and "y"', 19, "'\"y\"' beside 'and'", 'not $s == "x" and not $s == "y"'),
    ],
)
def test_a_value_that_is_compared_with_nothing_is_told_once_with_what_is_meant(text, column, wrong, meant):
    kinds = {**KINDS, "l": Kind.LIST_OF_TEXT}
    (problem,) = check_kinds(parse_expression(text), kinds, Kind.BOOLEAN).problems
    assert problem.position.column == column
    assert problem.message == f"{wrong} is compared with nothing"
    assert problem.valid == (meant,)
    assert check_kinds(parse_expression(meant), kinds, Kind.BOOLEAN).problems == ()


def test_a_value_of_another_kind_is_no_part_of_the_comparison():
    (problem,) = check_kinds(parse_expression('$i == 3 or "x"'), KINDS, Kind.BOOLEAN).problems
    assert problem.message == "'or' needs true or false, but '\"x\"' is a text"
    assert problem.valid == ('$key == "x"',)


def test_nested_values_cost_little():
    text = "$i == 3 or 4"
    for _ in range(20):
        text = f"$i == abs({text}) or 4"
    checked = check_kinds(parse_expression(text), KINDS)
    assert checked.problems


@pytest.mark.parametrize(
    ("text", "column", "says", "valid"),
    [
        ("$bed.state == 2", 6, "$bed is a text", "out: {state: state}"),
        ("$pose.z > 1 m", 7, "$pose is a pose", ".x"),
        ("$beds[0].dry", 10, "$beds[0] is a pose", ".yaw"),
        ("$new.state == 2", 6, "nobody says what $new is", "$new"),
    ],
)
def test_a_part_that_is_none_says_what_the_whole_is_and_what_would_have_worked(text, column, says, valid):
    kinds = {"bed": Kind.TEXT, "pose": Kind.POSE, "beds": Kind.LIST_OF_POSE}
    found = check_kinds(parse_expression(text), kinds).problems
    problem = next(each for each in found if each.position.column == column)
    assert says in problem.message and any(valid in each for each in problem.valid)
