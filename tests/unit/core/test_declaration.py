"""What fits a port, and what a skill may be started with."""

import math

import pytest

from florence_bt.core.declaration import MAGNITUDES, Kind, Port, SkillDeclaration, number_text
from florence_bt.core.geometry import MAX_DISTANCE_M, Pose2

FITTING = {
    Kind.TEXT: ["", "here"],
    Kind.BOOLEAN: [True, False],
    Kind.INTEGER: [0, -7],
    Kind.NUMBER: [2, -0.5, 1e300],
    Kind.LENGTH: [2, -0.5],
    Kind.ANGLE: [2, -0.5],
    Kind.DURATION: [2, 0.5],
    Kind.SPEED: [2, -0.5],
    Kind.POSE: [Pose2(), Pose2(1.0, -2.0, 7.0)],
}
FITTING |= {kind.list: [(), tuple(values)] for kind, values in tuple(FITTING.items())}
ODD = ["2", True, 2, 0.5, Pose2(), None]


@pytest.mark.parametrize("kind", Kind)
def test_a_port_takes_values_of_its_kind_only(kind):
    port = Port(kind, "a value")
    for value in FITTING[kind]:
        assert port.problem_with(value) is None
    for value in ODD:
        if type(value) not in {type(good) for good in FITTING[kind]}:
            assert port.problem_with(value) == f"a value of type {kind.value} is needed, not {value!r}"


def test_every_item_of_a_list_must_fit():
    port = Port(Kind.LIST_OF_LENGTH, "")
    assert port.problem_with((1.0, 2)) is None
    assert port.problem_with((1.0, "2")) == "a value of type length is needed, not '2'"
    assert port.problem_with((1.0, math.nan)) == "nan is not finite"


@pytest.mark.parametrize("kind", [Kind.NUMBER, *MAGNITUDES])
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_numbers_are_finite(kind, value):
    assert Port(kind, "").problem_with(value) == f"{value!r} is not finite"


@pytest.mark.parametrize(("kind", "most"), MAGNITUDES.items())
def test_what_is_larger_than_life_is_refused(kind, most):
    port = Port(kind, "")
    assert port.problem_with(most) is None and port.problem_with(-most) is None
    for value in (most * 1.001, -most * 1.001):
        limits = f"{number_text(-most, kind)} and {number_text(most, kind)}"
        assert port.problem_with(value) == f"{number_text(value, kind)} is not between {limits}"
    far = Pose2(MAX_DISTANCE_M + 1.0)
    assert "too far away" in (Port(Kind.POSE, "").problem_with(far) or "")


def test_the_limits_of_a_port_are_allowed():
    port = Port(Kind.LENGTH, "", minimum=0.5, maximum=2.0)
    assert port.problem_with(0.5) is None and port.problem_with(2.0) is None
    assert port.problem_with(0.4) == "0.4 m is below the minimum of 0.5 m"
    assert port.problem_with(2.1) == "2.1 m is above the maximum of 2 m"


def test_a_skill_tells_everything_that_is_wrong_with_its_inputs():
    skill = SkillDeclaration(
        "turn", "Turn", {"angle": Port(Kind.ANGLE, "how far"), "fast": Port(Kind.BOOLEAN, "", False)}
    )
    assert skill.problems_with({"angle": 1.0}) == []
    assert skill.complete({"angle": 1.0}) == {"angle": 1.0, "fast": False}
    assert skill.problems_with({"fast": 1, "left": True}) == [
        "turn has no input 'left'",
        "angle is missing",
        "fast: a value of type boolean is needed, not 1",
    ]
