import math
import shlex
from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.parse import parse_mission

MISSION = parse_mission(
    """\
mission: m
inputs:
  far: {type: length, default: 1 m, min: 0 m, max: 2 m, description: how far}
  who: {type: text, description: whom to look for}
  n: {type: integer, default: 3}
  loud: {type: boolean, default: false}
tree: {fail: x}
""",
    Path("m.yaml"),
)
POSE = parse_mission("mission: m\ninputs: {goal: {type: pose}}\ntree: {fail: x}\n", Path("m.yaml"))


def test_texts_are_read_like_yaml_and_defaults_filled_in():
    assert parse_inputs(MISSION, {"who": "Ada", "far": "50 cm", "loud": "true"}) == {
        "far": 0.5,
        "who": "Ada",
        "n": 3,
        "loud": True,
    }


def test_values_in_si_units():
    assert parse_inputs(MISSION, {"who": "", "far": 2, "n": 7})["far"] == 2.0
    assert isinstance(parse_inputs(MISSION, {"who": "", "far": 2})["far"], float)


@pytest.mark.parametrize("goal", ["{x: 1 m, y: 200 cm, yaw: 90 deg}", Pose2(1.0, 2.0, math.pi / 2)])
def test_poses(goal):
    assert parse_inputs(POSE, {"goal": goal}) == {"goal": Pose2(1.0, 2.0, pytest.approx(math.pi / 2))}


@pytest.mark.parametrize(
    "goal", ["1 2 3", "{x: 1 m}", "{x: 1 m, y: $y, yaw: 0}", "$pose", "[1", "", Pose2(math.nan, 0, 0), 5]
)
def test_bad_poses(goal):
    with pytest.raises(ConfigError, match="goal: "):
        parse_inputs(POSE, {"goal": goal})


@pytest.mark.parametrize(
    ("given", "problem"),
    [
        ({"far": 3.0}, "far: 3 m is above the maximum of 2 m"),
        ({"far": "3 m"}, "far: 3 m is above the maximum of 2 m"),
        ({"far": math.nan}, "far: nan is not finite"),
        ({"far": True}, "far: a value of type length is needed"),
        ({"n": 2.0}, "n: a value of type integer is needed"),
        ({"n": "2.0"}, "n: a whole number is needed"),
        ({"loud": 1}, "loud: a value of type boolean is needed"),
        ({"loud": "yes"}, "true or false is needed"),
        ({"who": 5}, "who: a value of type text is needed"),
        ({"who": None}, "who: a value of type text is needed"),
    ],
)
def test_bad_values(given, problem):
    with pytest.raises(ConfigError, match=problem):
        parse_inputs(MISSION, {"who": "Ada", **given})


def test_everything_wrong_is_in_one_error():
    with pytest.raises(ConfigError) as error:
        parse_inputs(MISSION, {"fra": "1 m", "far": "1"})
    assert error.value.problem == (
        "m has no input 'fra'; far: a length needs a unit: '1'; who is missing: whom to look for"
    )
    assert error.value.valid == ("far", "far='1 m'", "far='1 cm'", "far='1 mm'", "far='1 km'", "who=kitchen")


def test_a_misspelt_input_is_not_told_as_missing_too():
    with pytest.raises(ConfigError) as error:
        parse_inputs(MISSION, {"whoo": "Ada"})
    assert error.value.problem == "m has no input 'whoo'"
    assert error.value.valid == ("who=Ada",)
    with pytest.raises(ConfigError) as error:
        parse_inputs(MISSION, {"whoo": "x" * 10_000})
    assert error.value.valid[0] == "who"


def test_a_mission_without_inputs():
    mission = parse_mission("mission: m\ntree: {fail: x}\n", Path("m.yaml"))
    assert parse_inputs(mission, {}) == {}
    with pytest.raises(ConfigError, match="no inputs at all"):
        parse_inputs(mission, {"a": "1"})


@pytest.mark.parametrize("far", ["1e308 m", "11 km", 1e17, -1e308])
def test_a_length_that_nobody_can_mean_is_refused(far):
    with pytest.raises(ConfigError, match=r"far: .*(too large|not between -10 km and 10 km)"):
        parse_inputs(MISSION, {"who": "", "far": far})


def test_a_pose_that_is_too_far_away_is_refused():
    with pytest.raises(ConfigError, match="too far away"):
        parse_inputs(POSE, {"goal": Pose2(1e17, 0.0)})
    with pytest.raises(ConfigError, match="too large"):
        parse_inputs(POSE, {"goal": "{x: 1e308 m, y: 0 m, yaw: 0 deg}"})


@pytest.mark.parametrize(
    ("declared", "typed"),
    [
        ("pose", "pose='{x: 1 m, y: 2 m, yaw: 90 deg}'"),
        ("duration", "pose='30 s'"),
        ("list of text", "pose='[kitchen, hall]'"),
        ("text", "pose=kitchen"),
    ],
)
def test_what_is_suggested_can_be_pasted_into_a_shell(declared, typed):
    mission = parse_mission(
        f"mission: go\ninputs: {{pose: {{type: {declared}}}}}\ntree: {{wait: 1 s}}\n", Path("go.yaml")
    )
    with pytest.raises(ConfigError) as error:
        parse_inputs(mission, {"x": "1"})
    assert typed in error.value.valid
    (argument,) = shlex.split(typed)
    name, _, value = argument.partition("=")
    assert list(parse_inputs(mission, {name: value})) == ["pose"]
