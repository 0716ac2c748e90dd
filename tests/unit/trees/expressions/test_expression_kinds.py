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
        ("$s < 'b'", 1, "'<' needs numbers or quantities, but '$s' is a text", ("==", "!=")),
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
