"""The tables that say how each shipped skill is served, without ROS."""

from __future__ import annotations

import math
from random import Random
from types import SimpleNamespace
from typing import Any

import pytest

from florence_bt.core.declaration import Kind
from florence_bt.core.geometry import Pose2
from florence_bt.core.interfaces import fill, load_interface, part_of
from florence_bt.core.outcome import Outcome, Result, failure, success
from florence_bt.core.serving import (
    ActionBinding,
    AnswerBinding,
    ClockBinding,
    ConditionBinding,
    ServiceBinding,
    SkillBinding,
)
from florence_bt.skills.navigation.navigate.bindings import PRECISE
from florence_bt.skills.served import ACTIONS, BINDINGS
from florence_bt.trees.language.declarations import own_declarations

BY_NAME = {served.skill: served for served in BINDINGS}
POSE = Pose2(1.0, 2.0, 0.5)


def answered(name: str, **fields: Any) -> Result:
    served = BY_NAME[name]
    assert isinstance(served, ServiceBinding)
    return served.result(SimpleNamespace(**fields))


def ended(name: str, outcome: Outcome, **fields: Any) -> Result:
    served = BY_NAME[name]
    assert isinstance(served, ActionBinding)
    return served.result(SimpleNamespace(**fields), outcome)


def test_every_declared_skill_is_served_once() -> None:
    declared = own_declarations()
    assert sorted(served.skill for served in BINDINGS) == list(declared)
    moving = {
        served.name
        for served in BINDINGS
        if declared[served.skill].resources and isinstance(served, ActionBinding)
    }
    assert moving <= set(ACTIONS)
    assert set(ACTIONS) - {served.name for served in BINDINGS} == {"follow_path", "wait"}


@pytest.mark.parametrize("served", BINDINGS, ids=lambda served: served.skill)
def test_the_type_fits_the_table(served: SkillBinding) -> None:
    kind = {ActionBinding: "action", ServiceBinding: "srv", AnswerBinding: None, ClockBinding: None}.get(
        type(served), "msg"
    )
    assert served.interface.split("/")[1:2] == ([kind] if kind is not None else [])


@pytest.mark.parametrize(
    ("name", "inputs", "fields"),
    [
        ("navigate_to", {"goal": POSE, "precise": False}, {"pose": POSE, "behavior_tree": ""}),
        ("navigate_to", {"goal": POSE, "precise": True}, {"pose": POSE, "behavior_tree": PRECISE}),
        (
            "turn",
            {"angle": 1, "time_allowance": 20.0},
            {"target_yaw": 1.0, "time_allowance": 20.0},
        ),
        ("navigate_through", {"via": POSE, "goal": Pose2()}, {"poses": [POSE, Pose2()]}),
        ("plan_to", {"goal": POSE}, {"goal": POSE}),
        (
            "drive_back",
            {"distance": 0.5, "speed": 0.1, "time_allowance": 20.0},
            {"target.x": 0.5, "speed": 0.1, "time_allowance": 20.0},
        ),
        (
            "drive_straight",
            {"distance": -1, "speed": 0.1, "time_allowance": 20.0},
            {"target.x": -1, "speed": -0.1, "time_allowance": 20.0},
        ),
        ("clear_costmap", {}, {}),
        (
            "look_for_user",
            {"window": 5, "user_id": 7, "x": 1, "y": 0.5},
            {"window": 5.0, "user_id": 7, "x": 1.0, "y": 0.5},
        ),
        (
            "follow_user",
            {"user_id": 7, "distance": 1, "max_lin_speed": 0, "max_ang_speed": 0.5},
            {"user_id": 7, "distance": 1.0, "max_lin_speed": 0.0, "max_ang_speed": 0.5},
        ),
        (
            "search_for_user",
            {"user_id": 7, "max_lin_speed": 0, "max_ang_speed": 0.5},
            {"user_id": 7, "max_lin_speed": 0.0, "max_ang_speed": 0.5},
        ),
        (
            "approach_person",
            {
                "x": 2,
                "y": -1,
                "distance": 1,
                "p2r_orientation": 3,
                "r2p_orientation": 0.5,
                "max_lin_speed": 0.2,
                "max_ang_speed": 0,
            },
            {
                "x": 2.0,
                "y": -1.0,
                "desired_distance": 1.0,
                "desired_p2r_orientation": 3.0,
                "desired_r2p_orientation": 0.5,
                "max_lin_speed": 0.2,
                "max_ang_speed": 0.0,
            },
        ),
        ("get_hotspot", {"label": "kitchen"}, {"label": "kitchen"}),
        ("set_user_position", {"user": POSE}, {"x": 1.0, "y": 2.0, "phi": 0.5}),
        ("get_user_room", {}, {}),
    ],
)
def test_inputs_become_fields(name: str, inputs: dict[str, Any], fields: dict[str, Any]) -> None:
    served = BY_NAME[name]
    assert isinstance(served, ActionBinding | ServiceBinding)
    assert served.request(inputs) == fields


@pytest.mark.parametrize("served", BINDINGS, ids=lambda served: served.skill)
def test_the_interface_has_every_field_that_is_sent(served: SkillBinding) -> None:
    time = pytest.importorskip("builtin_interfaces.msg").Time
    write = getattr(served, "request", None) or getattr(served, "message", None)
    if write is None:
        return
    ports = own_declarations()[served.skill].inputs
    values = {Kind.POSE: POSE, Kind.TEXT: "hall", Kind.INTEGER: 3}
    fields = write({name: values.get(port.kind, 2) for name, port in ports.items()})
    part = {ActionBinding: "Goal", ServiceBinding: "Request"}.get(type(served), "")
    empty = part_of(load_interface(served.interface), part)
    assert (fill(empty(), fields, time(sec=7)) != empty()) == bool(fields)


def test_answers_of_services_become_results() -> None:
    here = {"x": 1.0, "y": 2.0, "phi": 0.5}
    seen = {"room": "hall", "source": "hall_pir", "age": 3.0}
    assert answered("get_user_room", valid=True, **seen) == success(**seen)
    assert answered("get_user_room", valid=False).code == "user_unknown"
    assert answered("get_hotspot", valid=True, message="", **here) == success(pose=POSE)
    assert answered("get_hotspot", valid=False, message="no such") == failure("unknown_hotspot", "no such")
    assert answered("get_robot_pose", valid=True, **here) == success(pose=POSE)
    assert answered("get_robot_pose", valid=False).code == "no_pose"
    assert answered("set_user_position", success=True, message="") == success()
    assert answered("set_user_position", success=False, message="wall") == failure("bad_input", "wall")
    assert answered("start_tracker", success=True, message="") == success()
    assert answered("stop_tracker", success=False, message="") == failure("tracker_failed", "it answered no")
    assert answered("propose_approach_pose", valid=True, message="", **here) == success(pose=POSE)
    assert answered("propose_approach_pose", valid=False, message="").code == "pose_occupied"


def test_the_robot_is_in_the_room_that_was_asked_for() -> None:
    served = BY_NAME["robot_in_room"]
    assert isinstance(served, ServiceBinding) and served.judge is not None
    assert served.judge({"room": "hall"}, success(room="hall")) == success()
    assert served.judge({"room": "hall"}, success(room="kitchen")).code == "elsewhere"


@pytest.mark.parametrize(
    ("wanted", "rooms"),
    [
        ((), ("hall", "kitchen", "bath room")),
        (("bath room", "hall", "bath room"), ("bath room", "hall")),
        ((" hall ",), ("hall",)),
    ],
)
def test_the_rooms_are_those_of_the_caller_or_all(wanted: tuple[str, ...], rooms: tuple[str, ...]) -> None:
    assert get_rooms("hall, kitchen, bath room", wanted) == success(rooms=rooms)


def test_a_room_that_does_not_exist_is_refused() -> None:
    assert get_rooms("", ()) == success(rooms=())
    unknown = get_rooms("hall, kitchen", ("hall", "kichen"))
    assert unknown.code == "unknown_room"
    assert unknown.reason == "there is no room 'kichen' (would have worked: kitchen)"


def get_rooms(known: str, wanted: tuple[str, ...]) -> Result:
    served = BY_NAME["get_rooms"]
    assert isinstance(served, ServiceBinding) and served.judge is not None
    answer = served.result(SimpleNamespace(success=True, message=known))
    return served.judge({"rooms": wanted}, answer)


def test_a_pick_is_one_of_the_items_and_each_can_be_it() -> None:
    served = BY_NAME["pick_random"]
    assert isinstance(served, AnswerBinding)
    chance = Random(1)
    picks = [served.answer({"items": ("kitchen", "hall")}, chance) for _ in range(100)]
    assert {pick.outputs["item"] for pick in picks} == {"kitchen", "hall"}
    assert served.answer({"items": ()}, chance).code == "nothing_to_pick"


def test_the_battery_is_above_a_part_of_its_charge() -> None:
    served = BY_NAME["battery_above"]
    assert isinstance(served, ConditionBinding)
    assert served.judge({"charge": 0.2}, SimpleNamespace(percentage=0.21)) == success()
    low = served.judge({"charge": 0.2}, SimpleNamespace(percentage=0.2))
    assert low == failure("battery_low", "the battery holds 20% of its full charge")
    for unknown in (math.nan, -0.1, 65.529 / 2.696, 50.0):
        not_known = served.judge({"charge": 0.0}, SimpleNamespace(percentage=unknown))
        assert not_known.code == "battery_low" and "not known" in not_known.reason


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        (
            "navigate_through",
            {102: "no_pose", 104: "blocked", 204: "goal_outside", 304: "goal_outside", 309: "bad_input"},
        ),
        ("navigate_through", {10001: "wheel_drop", 308: "no_path", 1: "blocked", 105: "no_progress"}),
        (
            "plan_to",
            {200: "bad_input", 202: "no_transform", 205: "start_occupied", 208: "no_path", 9: "no_path"},
        ),
        (
            "drive_back",
            {710: "drive_failed", 711: "time_allowance", 712: "no_pose", 713: "bad_input", 717: "no_scan"},
        ),
        ("drive_back", {714: "collision_ahead", 10006: "bumper"}),
        (
            "drive_straight",
            {720: "drive_failed", 721: "time_allowance", 723: "collision_ahead", 724: "bad_input"},
        ),
    ],
)
def test_numbers_of_nav2_become_codes(name: str, numbers: dict[int, str]) -> None:
    for number, code in numbers.items():
        result = ended(name, Outcome.FAILED, error_code=number, error_msg="")
        assert result.code == code
        assert code == "bad_input" or code in own_declarations()[name].failures
        assert str(number) in result.reason


def test_who_lies_on_the_floor_is_a_condition() -> None:
    served = BY_NAME["user_lying"]
    assert isinstance(served, ConditionBinding)
    assert served.judge({}, SimpleNamespace(data=True)) == success()
    assert served.judge({}, SimpleNamespace(data=False)).code == "nobody_lies"


def test_ends_of_actions_become_results() -> None:
    error = {"error_code": 106, "error_msg": "a chair"}
    assert ended("navigate_to", Outcome.FAILED, **error) == failure("blocked", "a chair")
    assert ended("turn", Outcome.SUCCEEDED, error_code=0, error_msg="") == success()
    path = [
        SimpleNamespace(pose=SimpleNamespace(position=SimpleNamespace(x=x, y=y))) for x, y in ((0, 0), (3, 4))
    ]
    planned = {"error_code": 0, "error_msg": "", "path": SimpleNamespace(poses=path)}
    assert ended("plan_to", Outcome.SUCCEEDED, **planned) == success(length=5.0)
    person = {"distance": 2.0, "user_id": 7, "posture": "lying", "height": 0.3}
    lost = ended("follow_user", Outcome.FAILED, error_code=10000, error_msg="out of sight")
    assert (lost.code, lost.reason) == ("user_lost", "out of sight")
    chair = ended("approach_person", Outcome.FAILED, code="blocked", reason="a chair")
    assert chair == failure("blocked", "a chair")
    assert ended("approach_person", Outcome.FAILED, code="", reason="").code == "rejected"
    assert ended("approach_person", Outcome.SUCCEEDED, code="", reason="") == success()
    assert ended("approach_person", Outcome.CANCELLED, code="", reason="").outcome is Outcome.CANCELLED
    seen = ended("look_for_user", Outcome.SUCCEEDED, found=True, x=1.0, y=2.0, phi=0.5, **person)
    assert seen == success(user=POSE, **person)
    without = ended(
        "look_for_user", Outcome.SUCCEEDED, found=True, x=1.0, y=2.0, phi=0.5, **{**person, "posture": ""}
    )
    posture = own_declarations()["look_for_user"].outputs["posture"]
    assert posture.problem_with(without.outputs["posture"]) is None
    nobody = ended("look_for_user", Outcome.FAILED, found=False, error_code=2, error_msg="")
    assert nobody.code == "no_image"
    assert ended("look_for_user", Outcome.CANCELLED).outcome is Outcome.CANCELLED
