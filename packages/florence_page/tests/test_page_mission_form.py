"""The form that starts a mission sends what the mission server can read."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")

from florence_interfaces.msg import MissionInfo, MissionPort
from florence_page.access import Role
from florence_page.acting import Actor
from florence_page.mission_form import choose_mission
from florence_page.presses import LATE
from nicegui import ui

from packages.florence_page.tests.page_user import NotedRobot, actor_for, click, look_at, until


@pytest.mark.parametrize("ticked", [True, False])
def test_a_checkbox_is_a_boolean_input(ticked):
    mission = MissionInfo(
        name="wave", inputs=[MissionPort(name="twice", type="boolean", default_value="false")]
    )
    robot = NotedRobot(
        {
            "florence_bt/list_missions": SimpleNamespace(missions=[mission]),
            "florence_bt/run_mission": SimpleNamespace(accepted=True, message=""),
        }
    )

    async def do(user):
        await click(user, "begin")
        await user.should_see("mission", retries=600)
        (chosen,) = user.find(ui.select).elements
        chosen.value = "wave"
        await user.should_see(ui.checkbox, retries=600)
        (box,) = user.find(ui.checkbox).elements
        box.value = ticked
        await click(user, "go")
        await until(lambda: robot.requests("florence_bt/run_mission"))

    look_at(lambda: ui.button("begin", on_click=lambda: choose_mission(actor_for(robot, Role.RUN))), do)
    (request,) = robot.requests("florence_bt/run_mission")
    assert request.input_names == ["twice"]
    assert request.input_values == ["true" if ticked else "false"]


def test_a_start_that_comes_late_starts_nothing_and_says_so():
    robot = NotedRobot({"florence_bt/list_missions": SimpleNamespace(missions=[MissionInfo(name="wave")])})
    actor = Actor(robot, Role.RUN)  # of a browser that says nothing of when it was pressed

    async def do(user):
        await click(user, "begin")
        await user.should_see("mission", retries=600)
        (chosen,) = user.find(ui.select).elements
        chosen.value = "wave"
        await click(user, "go")
        await user.should_see(LATE, retries=600)

    look_at(lambda: ui.button("begin", on_click=lambda: choose_mission(actor)), do)
    assert robot.requests("florence_bt/run_mission") == []
