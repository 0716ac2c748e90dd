"""What navigation shows of its goal: as a component, on the manual clock."""

from __future__ import annotations

from florence_bt.app.bringup.config import load_config
from florence_bt.app.bringup.simulated import robot_frames
from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import FramedPose, Pose2
from florence_bt.core.ports import Delivery, Topic
from florence_bt.core.topic_names import CURRENT_GOAL
from florence_bt.core.topics import MAP
from florence_bt.simulation.rig.components import connect_navigation
from florence_bt.simulation.rig.skills import rig_skills
from florence_bt.simulation.rig.wires import Wires
from tests.unit.skills.navigation_world import make_map

SHOWN = Topic(CURRENT_GOAL, FramedPose, Delivery.LATCHED, "geometry_msgs/msg/PoseStamped")


def test_the_goal_of_a_drive_is_taken_back_when_it_ends_and_by_no_goal_after_it() -> None:
    clock = ManualClock(10.0)
    wires, shown = Wires(clock, robot_frames().mounts()), []
    connect_navigation(wires, load_config())
    wires.ports("map_server").output(MAP).send(make_map())
    wires.ports("viewer").listen(SHOWN, shown.append)
    clock.advance(1.0)
    skills = rig_skills(wires)
    drive = skills["navigate_to"].start({"goal": Pose2(2.0, 1.0, 0.5), "precise": False})
    clock.advance(0.2)
    assert [(each.frame, each.pose) for each in shown] == [("map", Pose2(2.0, 1.0, 0.5))]
    drive.cancel()
    clock.advance(0.2)
    assert [each.frame for each in shown] == ["map", ""], "a goal without a frame is none"
    turn = skills["turn"].start({"angle": 1.0, "time_allowance": 10.0})
    clock.advance(0.2)
    turn.cancel()
    clock.advance(0.2)
    assert len(shown) == 2
