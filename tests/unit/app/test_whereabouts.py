from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from types import SimpleNamespace

from florence_interfaces.srv import GetRoom, GetXYPhi
from nav2_msgs.action import NavigateThroughPoses, NavigateToPose

from florence_bt.app.runs import client, whereabouts
from florence_bt.app.runs.whereabouts import GOAL_POSE, GOAL_ROOM, ROBOT_ROOM, Whereabouts, where_text

TO_A_POSE, THROUGH_POSES = "navigate_to_pose/_action/feedback", "navigate_through_poses/_action/feedback"


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
def world(monkeypatch):
    """A client that a locator answers at once, and a clock."""
    node = SimpleNamespace(feedback={}, steady=SimpleNamespace(now=lambda: world.now))
    world = SimpleNamespace(node=node, now=100.0, answers=True, dropped=0, asked=[])
    world.told = {
        ROBOT_ROOM: GetRoom.Response(room="hall", valid=True),
        GOAL_ROOM: GetRoom.Response(room="study", valid=True),
        GOAL_POSE: GetXYPhi.Response(x=9.0, y=0.0, valid=True),
    }

    def ask(kind, name, request):
        assert isinstance(world.told[name], kind.Response)
        world.asked.append(name)
        return SimpleNamespace(done=lambda: world.answers, result=lambda: world.told[name])

    world.ask = ask
    world.drop = lambda name, future: setattr(world, "dropped", world.dropped + 1)
    monkeypatch.setattr(whereabouts, "LatestMessages", Ways)
    monkeypatch.setattr(client.time, "monotonic", lambda: world.now)
    world.where = Whereabouts(world)
    return world


def seen(world, passed=0.1):
    world.now += passed
    return world.where.text()


def tell(world, metres, goal=1, topic=TO_A_POSE, action=NavigateToPose):
    message = action.Impl.FeedbackMessage(feedback=action.Feedback(distance_remaining=metres))
    message.goal_id.uuid = [goal] * 16
    world.node.feedback[topic].append(message)


def test_a_drive_is_told_by_rooms_until_it_is_over(world):
    assert seen(world) == "" and seen(world) == "in the hall"
    tell(world, 4.0)
    assert seen(world) == "in the hall; drives, 4.0 m left"
    assert seen(world) == "in the hall; drives to the study: 4.0 m left"
    world.told[ROBOT_ROOM] = GetRoom.Response(room="study", valid=True)
    seen(world, 1.5)
    assert seen(world) == "in the study; drives to (9.0, 0.0): 4.0 m left"
    assert [seen(world, 1.0) for _ in range(5)][-1] == "in the study"
    tell(world, 0.01)
    assert seen(world) == "in the study"


def test_a_room_that_nobody_tells_any_more_is_not_told_as_of_now(world):
    assert seen(world) == "" and seen(world) == "in the hall"
    world.answers = False
    assert seen(world, 2.0) == "in the hall"
    assert seen(world, 1.5) == ""
    world.answers = True
    seen(world)
    assert seen(world, 1.0) == "in the hall"


def test_another_goal_is_not_told_with_the_place_of_the_one_before(world):
    tell(world, 4.0)
    seen(world)
    assert seen(world) == "in the hall; drives to the study: 4.0 m left"
    world.told[GOAL_ROOM] = GetRoom.Response(room="kitchen", valid=True)
    tell(world, 2.0, goal=2)
    assert seen(world) == "in the hall; drives, 2.0 m left"
    assert seen(world) == "in the hall; drives to the kitchen: 2.0 m left"


def test_a_drive_through_several_poses_has_no_place(world):
    seen(world)
    tell(world, 4.0, topic=THROUGH_POSES, action=NavigateThroughPoses)
    assert [seen(world, 0.6) for _ in range(3)][-1] == "in the hall; drives, 4.0 m left"
    assert set(world.asked) == {ROBOT_ROOM}


def test_where_nobody_answers_nothing_is_told_and_nobody_waits(world):
    world.answers = False
    assert [seen(world, 1.0) for _ in range(20)] == [""] * 20
    assert world.dropped == 3
