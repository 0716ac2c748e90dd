"""Marks of what was touched: in the costmap where the robot plans at once, in the other when it is off it."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from florence_bt.core.base_stop import BaseStop
from florence_bt.core.geometry import Pose2
from florence_bt.skills.navigation.navigate.contact_marks import ContactMarks

BUMPED, FREE = BaseStop("bumper", "the left bumper"), BaseStop()
IN_MAP = Pose2(10.0, 0.0)


@dataclass
class Marked:
    """A costmap that notes which contacts it is told."""

    contacts: list[tuple[Pose2, float]] = field(default_factory=list)

    def add_contact(self, pose: Pose2, now: float) -> None:
        self.contacts.append((pose, now))


@dataclass(frozen=True)
class Seen:
    """A cycle's state, as far as a contact goes."""

    now: float
    pose: Pose2
    stop: BaseStop = FREE
    localised: bool = True

    @property
    def map_pose(self) -> Pose2:
        return IN_MAP @ self.pose


@pytest.fixture
def costmaps() -> tuple[Marked, Marked]:
    return Marked(), Marked()


def test_a_mark_that_would_hold_the_robot_comes_when_it_is_off(costmaps: tuple[Marked, Marked]) -> None:
    there, in_map = costmaps
    marks = ContactMarks(in_map, there)
    marks.saw(Seen(1.0, Pose2(1.0), BUMPED))
    assert (in_map.contacts, there.contacts) == ([], [])
    marks.saw(Seen(1.1, Pose2(0.96)))
    assert in_map.contacts == [(Pose2(11.0), 1.1)] and there.contacts == []
    marks.saw(Seen(1.2, Pose2(0.94)))
    assert there.contacts == [(Pose2(1.0), 1.2)]
    marks.saw(Seen(1.3, Pose2(0.5)))
    assert len(in_map.contacts) == len(there.contacts) == 1


def test_a_robot_that_does_not_know_its_place_marks_nothing_in_the_map(
    costmaps: tuple[Marked, Marked],
) -> None:
    there, in_map = costmaps
    marks = ContactMarks(in_map, there)
    marks.saw(Seen(1.0, Pose2(1.0), BUMPED, localised=False))
    marks.saw(Seen(1.1, Pose2(0.9)))
    assert in_map.contacts == [] and there.contacts == [(Pose2(1.0), 1.1)]
