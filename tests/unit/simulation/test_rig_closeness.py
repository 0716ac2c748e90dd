from __future__ import annotations

import math

import pytest

from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.closeness import closeness, closeness_text


@pytest.mark.parametrize(
    ("robot", "polite"),
    [
        (Pose2(0.0, 0.0, 0.0), True),
        (Pose2(0.0, 0.0, math.radians(14.0)), True),
        (Pose2(0.0, 0.0, math.radians(-14.0)), True),
        (Pose2(0.0, 0.0, math.radians(-16.0)), False),
        (Pose2(0.0, 0.0, math.pi), False),
        (Pose2(-0.09, 0.0, 0.0), True),
        (Pose2(-0.11, 0.0, 0.0), False),
        (Pose2(0.11, 0.0, 0.0), False),
    ],
)
def test_polite_is_half_a_metre_and_face_to_face(robot, polite):
    assert closeness(robot, Pose2(0.5, 0.0, 2.0)).polite is polite


@pytest.mark.parametrize(("away", "polite"), [(0.39, False), (0.41, True), (0.9, True), (1.11, False)])
def test_nearer_than_a_robot_was_thought_to_get_is_polite_too(away, polite):
    assert closeness(Pose2(-away, 0.0, 0.0), Pose2(0.0, 0.0)).polite_at(1.0) is polite


def test_the_person_may_stand_anywhere_around():
    for degrees in range(0, 360, 30):
        yaw = math.radians(degrees)
        person = Pose2(1.0 + 0.5 * math.cos(yaw), 2.0 + 0.5 * math.sin(yaw), 0.0)
        value = closeness(Pose2(1.0, 2.0, yaw), person)
        assert value.distance == pytest.approx(0.5) and value.facing == pytest.approx(0.0, abs=1e-9)


def test_in_words():
    text = closeness_text(closeness(Pose2(0.0, 0.0, math.radians(5.0)), Pose2(0.5, 0.0)))
    assert text == "0.50 m from the person, facing them within 5 degrees"
