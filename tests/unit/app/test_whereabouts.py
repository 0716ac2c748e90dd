from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from types import SimpleNamespace

from florence_interfaces.srv import GetRoom
from geometry_msgs.msg import PoseStamped
from nav2_msgs.action import NavigateToPose

from florence_bt.app.bringup.locks import lock_domain
from florence_bt.app.bringup.options import BringUp
from florence_bt.app.runs import whereabouts
from florence_bt.app.runs.whereabouts import Whereabouts, where_text

HOTSPOTS = """\
hotspots:
- {label: hall, x: 0, y: 0, phi: 0}
- {label: study, x: 10, y: 0, phi: 0}
"""


@pytest.mark.parametrize(
    ("known", "text"),
    [
        ((), ""),
        (("hall",), "in the hall"),
        (("hall", "the study", 3.41, 8.6), "in the hall; drives to the study: 3.4 m, about 9 s left"),
        (("hall", "", 3.41), "in the hall; drives, 3.4 m left"),
        (("", "(1.0, 2.0)", 0.5), "drives to (1.0, 2.0): 0.5 m left"),
    ],
)
def test_where_the_robot_is_as_text(known, text):
    assert where_text(*(known or ("",))) == text


class Ways:
    """Stands for the subscriptions to the feedback of navigation."""

    def __init__(self, node, message_type, topic, depth):
        self.messages = node.feedback.setdefault(topic, [])

    def take(self):
        while self.messages:
            yield self.messages.pop(0)


@pytest.fixture
def world(tmp_path, monkeypatch):
    """A bring-up whose hotspots are known, a client that is answered at once, and a clock."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv("ROS_DOMAIN_ID", "41")
    (tmp_path / "spots.yaml").write_text(HOTSPOTS)
    BringUp(str(tmp_path / "up"), hotspots_file=str(tmp_path / "spots.yaml")).write()
    lock = lock_domain(tmp_path / "up")
    goals = []
    node = SimpleNamespace(
        feedback={}, create_subscription=lambda kind, topic, callback, qos: goals.append(callback)
    )
    world = SimpleNamespace(node=node, now=100.0, room="hall", answers=True)
    world.ask = lambda kind, name, request: SimpleNamespace(
        done=lambda: world.answers, result=lambda: GetRoom.Response(room=world.room, valid=bool(world.room))
    )
    world.dropped = 0
    world.drop = lambda name, future: setattr(world, "dropped", world.dropped + 1)
    monkeypatch.setattr(whereabouts, "LatestMessages", Ways)
    monkeypatch.setattr(whereabouts.time, "monotonic", lambda: world.now)
    world.where = Whereabouts(world)
    world.set_goal = goals[0]
    yield world
    lock.close()


def seen(world, passed=0.1):
    world.now += passed
    return world.where.text()


def feedback(metres):
    return NavigateToPose.Impl.FeedbackMessage(feedback=NavigateToPose.Feedback(distance_remaining=metres))


def test_a_drive_is_told_by_rooms_until_it_is_over(world):
    assert seen(world) == "" and seen(world) == "in the hall"
    goal = PoseStamped()
    goal.pose.position.x = 9.0
    world.set_goal(goal)
    world.node.feedback["navigate_to_pose/_action/feedback"].append(feedback(4.0))
    assert seen(world) == "in the hall; drives to the study: 4.0 m left"
    world.room = "study"
    seen(world, 1.5)
    assert seen(world) == "in the study; drives to (9.0, 0.0): 4.0 m left"
    assert seen(world, 5.0) == "in the study"
    world.node.feedback["navigate_to_pose/_action/feedback"].append(feedback(0.01))
    assert seen(world) == "in the study"


def test_where_nobody_answers_nothing_is_told_and_nobody_waits(world):
    world.answers = False
    assert [seen(world, 1.0) for _ in range(20)] == [""] * 20
    assert world.dropped == 3
