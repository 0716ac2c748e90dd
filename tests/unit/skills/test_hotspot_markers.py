"""Hotspots become markers and come back from them."""

from __future__ import annotations

import math

import pytest

pytest.importorskip("visualization_msgs.msg")

from std_msgs.msg import Header
from visualization_msgs.msg import Marker, MarkerArray

from florence_bt.core.geometry import Pose2
from florence_bt.skills.locator.hotspots import OBJECT, ROOM, Hotspot, Hotspots
from florence_bt.skills.locator.markers import hotspots_from_ros, hotspots_to_ros

SPOTS = [
    Hotspot("kitchen", Pose2(1.0, 2.0, 1.5), ROOM, ((0.0, 0.0), (3.0, 0.0), (3.0, 3.0))),
    Hotspot("label", Pose2(-4.0, 0.5, -3.0), OBJECT),
    Hotspot("hall", Pose2(5.0, 5.0), ROOM),
]


def test_hotspots_come_back_from_their_markers():
    message = hotspots_to_ros(Hotspots(SPOTS), Header(frame_id="map"))
    back = list(hotspots_from_ros(message))
    assert [(each.label, each.kind, each.polygon) for each in back] == [
        (each.label, each.kind, each.polygon) for each in SPOTS
    ]
    for each, spot in zip(back, SPOTS, strict=True):
        assert (each.pose.x, each.pose.y, each.pose.yaw) == pytest.approx(
            (spot.pose.x, spot.pose.y, spot.pose.yaw)
        )


def test_viewers_drop_the_markers_of_before_and_know_the_frame():
    first, *others = hotspots_to_ros(Hotspots(SPOTS), Header(frame_id="map")).markers
    assert first.action == Marker.DELETEALL
    assert {each.header.frame_id for each in others} == {"map"}
    assert len({(each.ns, each.id) for each in others}) == len(others)


def test_markers_of_others_and_poses_that_are_none_are_passed_over():
    message = hotspots_to_ros(Hotspots(SPOTS), Header(frame_id="map"))
    stray = Marker(ns="user", text="somebody")
    bad = Marker(ns=OBJECT, text="nowhere")
    bad.pose.position.x = math.nan
    found = hotspots_from_ros(MarkerArray(markers=[*message.markers, stray, bad]))
    assert found.labels() == ("kitchen", "label", "hall")
