"""A condition over a topic, watched by a mission: the drive stops with the message that says so."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")
from sensor_msgs.msg import BatteryState

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.runtime.executor import Executor
from florence_bt.runtime.run import MissionRequest, RunIds, RunStatus
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.loader import MissionLibrary
from tests.scripted_skill import ScriptedSkill

pytestmark = pytest.mark.ros

DECLARATIONS = {
    "battery_above": own_declarations()["battery_above"],
    "drive": SkillDeclaration("drive", "Drive for ever", deadline_s=1e6),
}
LOW = "the battery holds 20% of its full charge"
MISSION = "mission: m\ntree: {sequence: [{battery_above: {charge: 0.3}}, drive: ], memory: false}\n"


def test_a_message_stops_the_drive(ros: Any, tmp_path: Path) -> None:
    from florence_bt.app.bringup.skills_ros import make_skills
    from florence_bt.ros.node import FlorenceNode
    from florence_bt.ros.qos import RELIABLE

    (tmp_path / "m.yaml").write_text(MISSION)
    robot, server = ros.add(FlorenceNode("robot")), ros.add(FlorenceNode("missions"))
    publisher = robot.create_publisher(BatteryState, "battery_state", RELIABLE)
    battery: Any = make_skills(server)["battery_above"]
    drive = ScriptedSkill(DECLARATIONS["drive"], server.timebase, [Step(after=1e6)])
    executor = Executor(
        MissionLibrary.load([tmp_path], built_in=False),
        {"battery_above": battery, "drive": drive},
        DECLARATIONS,
        server.timebase,
        RunIds("T"),
    )
    ros.spin_until(lambda: publisher.get_subscription_count() == 1 and battery.server_is_there())
    publisher.publish(BatteryState(percentage=0.8))
    ros.spin_until(lambda: battery.start({"charge": 0.3}).poll().succeeded)
    run = executor.trigger(MissionRequest("m"))
    ros.spin_until(lambda: drive.active == 1)
    publisher.publish(BatteryState(percentage=0.5))
    publisher.publish(BatteryState(percentage=0.2))
    ros.spin_until(lambda: run.status.final)
    assert (run.status, run.why.code, run.why.reason) == (RunStatus.FAILED, "battery_low", LOW)
    assert drive.active == 0 and len(drive.runs) == 1
