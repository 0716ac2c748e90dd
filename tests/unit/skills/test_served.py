"""The tables that say how each shipped skill is served, without ROS."""

from __future__ import annotations

from datetime import timedelta
from types import SimpleNamespace
from typing import Any

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result, failure, success
from florence_bt.core.serving import Served, ServedAction, ServedService
from florence_bt.skills.served import ACTIONS, SERVED
from florence_bt.trees.language.declarations import collect_declarations

BY_NAME = {served.skill.name: served for served in SERVED}
POSE = Pose2(1.0, 2.0, 0.5)


def answered(name: str, **fields: Any) -> Result:
    served = BY_NAME[name]
    assert isinstance(served, ServedService)
    return served.result(SimpleNamespace(**fields))


def ended(name: str, outcome: Outcome, **fields: Any) -> Result:
    served = BY_NAME[name]
    assert isinstance(served, ServedAction)
    return served.result(SimpleNamespace(**fields), outcome)


def test_every_declared_skill_is_served_once() -> None:
    assert sorted(served.skill.name for served in SERVED) == list(collect_declarations(third_party=False))
    assert ACTIONS == ("navigate_to_pose", "spin", "look_for_user")


@pytest.mark.parametrize("served", SERVED, ids=lambda served: served.skill.name)
def test_the_type_fits_the_table(served: Served) -> None:
    kind = "action" if isinstance(served, ServedAction) else "srv"
    assert served.interface.split("/")[1:2] == [kind]


@pytest.mark.parametrize(
    ("name", "inputs", "fields"),
    [
        ("navigate_to", {"goal": POSE}, {"pose": POSE}),
        (
            "turn",
            {"angle": 1, "time_allowance": 20.0},
            {"target_yaw": 1.0, "time_allowance": timedelta(seconds=20.0)},
        ),
        ("look_for_user", {"window": 5}, {"window": 5.0}),
        ("get_hotspot", {"label": "kitchen"}, {"label": "kitchen"}),
        ("set_user_position", {"user": POSE}, {"x": 1.0, "y": 2.0, "phi": 0.5}),
        ("get_user_room", {}, {}),
    ],
)
def test_inputs_become_fields(name: str, inputs: dict[str, Any], fields: dict[str, Any]) -> None:
    assert BY_NAME[name].request(inputs) == fields


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
    assert isinstance(served, ServedService) and served.judge is not None
    assert served.judge({"room": "hall"}, success(room="hall")) == success()
    assert served.judge({"room": "hall"}, success(room="kitchen")).code == "elsewhere"


def test_ends_of_actions_become_results() -> None:
    error = {"error_code": 106, "error_msg": "a chair"}
    assert ended("navigate_to", Outcome.FAILED, **error) == failure("blocked", "a chair", server_code=106)
    assert ended("turn", Outcome.SUCCEEDED, error_code=0, error_msg="") == success()
    seen = ended(
        "look_for_user", Outcome.SUCCEEDED, found=True, x=1.0, y=2.0, phi=0.5, distance=2.0, user_id=7
    )
    assert seen == success(user=POSE, distance=2.0, user_id=7)
    nobody = ended("look_for_user", Outcome.FAILED, found=False, error_code=2, error_msg="")
    assert nobody.code == "no_picture" and nobody.server_code == 2
    assert ended("look_for_user", Outcome.CANCELLED).outcome is Outcome.CANCELLED
