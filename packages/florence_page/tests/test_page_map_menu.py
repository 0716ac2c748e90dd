"""A click on the map: the pose and what may be done there, by role; poses of the map as inputs."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from florence_page.access import Role
from florence_page.components import MapView, pose_from_browser
from florence_page.map_menu import MapMenu
from florence_page.mission_form import map_choices

from florence_bt.core.geometry import Pose2
from florence_bt.skills.locator.hotspots import load_hotspots
from florence_bt.trees.language.inputs import parse_inputs
from florence_bt.trees.language.loader import MissionLibrary
from packages.florence_page.tests.page_user import NotedRobot, actor_for, click, look_at, until

ROOM = "{label: kitchen, kind: room, x: 1, y: 2, yaw: 90 deg, polygon: [[0, 0], [3, 0], [3, 3], [0, 3]]}"
HERE = {"x": 1.0, "y": 2.5, "yaw": math.pi / 2}


@pytest.fixture
def robot(tmp_path):
    file = tmp_path / "hotspots.yaml"
    file.write_text(f"hotspots:\n- {ROOM}\n")
    done = SimpleNamespace(accepted=True, success=True, message="done")
    robot = NotedRobot({"florenceLocator/setHotspot": done, "florence_bt/run_mission": done})
    robot.places = load_hotspots(file)
    return robot


def menu_of(robot, role):
    return lambda: MapMenu(MapView().mark("map"), actor_for(robot, role))


def test_a_pose_is_told_with_its_room_to_who_may_only_look(robot):
    async def do(user):
        user.find("map").trigger("place", HERE)
        await user.should_see("1.00 m, 2.50 m in kitchen", retries=600)
        await user.should_not_see("Drive there")
        await user.should_not_see("Put the place here")

    look_at(menu_of(robot, Role.LOOK), do)
    assert not robot.asked


def test_drive_there_asks_first_and_starts_a_mission_that_takes_what_it_is_given(robot):
    async def do(user):
        user.find("map").trigger("place", HERE)
        await click(user, "Drive there")
        await user.should_see("Drive to (1.00 m, 2.50 m), 90°?", retries=600)
        assert not robot.asked
        await click(user, "yes")
        await until(lambda: robot.asked)

    look_at(menu_of(robot, Role.RUN), do)
    (request,) = robot.requests("florence_bt/run_mission")
    library = MissionLibrary.load()
    given = dict(zip(request.input_names, request.input_values, strict=True))
    inputs = parse_inputs(library.get(request.mission), given)
    assert inputs == {"x": 1.0, "y": 2.5, "phi": pytest.approx(math.pi / 2)}
    assert request.caller == "page (run)"


def test_cancelled_is_not_done(robot):
    async def do(user):
        user.find("map").trigger("place", HERE)
        await click(user, "The robot is here", "Cancel")

    look_at(menu_of(robot, Role.RUN), do)
    assert not robot.asked and not robot.poses


def test_the_localiser_is_told_where_the_robot_is(robot):
    async def do(user):
        user.find("map").trigger("place", HERE)
        await click(user, "The robot is here", "yes")
        await until(lambda: robot.lines)

    look_at(menu_of(robot, Role.RUN), do)
    assert robot.poses == [Pose2(1.0, 2.5, pytest.approx(math.pi / 2))]
    assert "page (run)" in robot.lines[0]


@pytest.mark.parametrize(("name", "word"), [("kitchen", "Move"), ("sofa", "Add")])
def test_a_place_is_added_or_moved_by_who_may_edit(robot, name, word):
    async def do(user):
        user.find("map").trigger("place", HERE)
        await user.should_see("place-name", retries=600)
        user.find("place-name").type(name)
        await click(user, "Put the place here")
        await user.should_see(f"{word} the place {name}", retries=600)
        await click(user, "yes")
        await until(lambda: robot.lines)

    look_at(menu_of(robot, Role.EDIT), do)
    (request,) = robot.requests("florenceLocator/setHotspot")
    assert (request.label, request.x, request.y) == (name, 1.0, 2.5)


@pytest.mark.parametrize(
    "sent",
    [
        None,
        "x",
        [1, 2, 3],
        {},
        {"x": 1, "y": 2},
        {"x": "1", "y": 2, "yaw": 0},
        {"x": math.nan, "y": 2, "yaw": 0},
        {"x": 1e9, "y": 2, "yaw": 0},
        {"x": 10**400, "y": 2, "yaw": 0},
        {"x": 1, "y": 2, "yaw": math.inf},
    ],
)
def test_what_is_no_pose_opens_nothing(robot, sent):
    assert pose_from_browser(sent) is None


def test_poses_of_the_map_become_inputs():
    (as_pose,) = map_choices({"goal": "pose", "text": "text"})
    assert as_pose(Pose2(1.0, 2.0, math.pi)) == {"goal": "{x: 1.00 m, y: 2.00 m, yaw: 180 deg}"}
    (as_parts,) = map_choices({"x": "length", "y": "length", "phi": "angle"})
    assert as_parts(Pose2(1.0, 2.0, math.pi)) == {"x": "1.00 m", "y": "2.00 m", "phi": "180 deg"}
    assert map_choices({"x": "number", "y": "length"}) == []
