"""Navigation reads where people are from the frames of the user tracker."""

from __future__ import annotations

from typing import Any

from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import HISTORY_S, TransformBuffer
from florence_bt.skills.navigation.navigate.people_frames import see_people


class CountingBuffer(TransformBuffer):
    """Counts what it is asked."""

    lookups = 0

    def lookup_pose(self, *frames: Any) -> Pose2:
        self.lookups += 1
        return super().lookup_pose(*frames)


class SeenPeople:
    """Stands for the navigator: keeps whom it is told of."""

    def __init__(self) -> None:
        self.persons: list[tuple[Any, ...]] = []
        self.newest: list[Any] = []

    def saw_person(self, *person: Any) -> None:
        self.persons.append(person)

    def saw_people(self, stamp: float, places: list[Any]) -> None:
        self.newest = places


def test_who_was_seen_long_ago_is_not_looked_up_in_every_cycle() -> None:
    now, buffer, seen = 1000.0, CountingBuffer(), SeenPeople()
    for number in range(50):
        buffer.set_moving("map", f"user_{number}", now - HISTORY_S - 1.0 - number, Pose2(1.0, 1.0))
    for moment in range(3):
        buffer.set_moving("map", "odom", now - 1.0 + moment / 2.0, Pose2(1.0, 0.0))
    buffer.set_moving("map", "user_70", now - 0.5, Pose2(3.0, 2.0))
    buffer.set_moving("map", "user_x", now, Pose2())
    see_people(seen, buffer, "odom", now)  # type: ignore[arg-type]
    assert seen.persons == [(now - 0.5, 70, 2.0, 2.0)] and seen.newest == [(2.0, 2.0)]
    assert buffer.lookups == 1
