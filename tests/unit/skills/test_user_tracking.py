"""The user tracker as a component: what it does with pictures, frames and looks that come when they come."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from florence_bt.core.clock import ManualClock, call_every
from florence_bt.core.errors import FrameError
from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.core.ports import Delivery, Topic
from florence_bt.core.sensing import CameraModel, ColourImage, DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.rig.wires import TRANSFORMS, Link, Wires
from florence_bt.skills.people.user_tracker import tracking
from florence_bt.skills.people.user_tracker.detector import Detection
from florence_bt.skills.people.user_tracker.evidence import Region
from florence_bt.skills.people.user_tracker.parameters import (
    DetectorParameters,
    LookParameters,
    TrackerParameters,
)
from florence_bt.skills.people.user_tracker.tracking import UserTracking, UserTrackingParameters
from florence_bt.trees.language.loader import BUILT_IN

CAMERA = CameraModel(4, 3, 4.0, 4.0, 1.5, 1.0)
MOUNT = (
    "base_footprint",
    "camera",
    Transform3.from_xyz_rpy((0.0, 0.0, 0.5), (-math.pi / 2, 0.0, -math.pi / 2)),
)
PERIOD_S = 0.1


class Picture:
    """A picture that was taken at some moment; it counts how often it is read."""

    def __init__(self, stamp: float, image: Any) -> None:
        self.stamp, self._image, self.reads = stamp, image, 0

    def read(self) -> Any:
        self.reads += 1
        if isinstance(self._image, Exception):
            raise self._image
        return self._image


def depth_at(stamp: float) -> Picture:
    return Picture(stamp, DepthImage(stamp, "camera", CAMERA, np.full((3, 4), 2.0, np.float32)))


class Surroundings:
    """A robot at (1, 0) that sees somebody 2 m ahead of it, its frames, and what the tracker sends."""

    def __init__(self, links: dict[str, Link] | None = None, verifier: Any = None, **own: Any) -> None:
        self.clock = ManualClock()
        self.wires = Wires(self.clock, [MOUNT], links)
        self.hardware = self.wires.ports("hardware")
        self.depth, self.colour = self.hardware.output(tracking.DEPTH), self.hardware.output(tracking.COLOUR)
        parts = DetectorParameters(), TrackerParameters(), LookParameters(), verifier
        self.tracking = UserTracking(
            self.wires.ports("tracker"), UserTrackingParameters(use_map=False, **own), *parts
        )
        self.heard: dict[str, list[Any]] = {}
        for topic in (tracking.USERS, tracking.LYING, tracking.FOUND):
            listener: Callable[[Any], None] = self.heard.setdefault(topic.name, []).append
            self.hardware.listen(topic, listener)
        self.frames_known_until = math.inf
        self.turns = 0.0
        call_every(self.clock, 0.02, self._send_frames)

    def _send_frames(self) -> None:
        now = self.clock.now()
        if now <= self.frames_known_until:
            self.hardware.send_frame("odom", "base_footprint", now, self.pose_at(now))
            self.hardware.send_frame("map", "odom", now + 0.2, Pose2())

    def pose_at(self, when: float) -> Pose2:
        return Pose2(1.0, 0.0, self.turns * when)

    def start(self) -> None:
        assert self.wires.services["tracker/Start"]({}).success
        self.clock.advance(0.3)  # the place of the odometry frame is stamped ahead

    def see(self, count: int = 1) -> list[Picture]:
        pictures = []
        for _ in range(count):
            self.clock.advance(PERIOD_S)
            pictures.append(depth_at(self.clock.now()))
            self.depth.send(pictures[-1])
        self.clock.advance(0.04)
        return pictures

    def look(self, window: float = 5.0, user_id: int = 0) -> Any:
        action = self.wires.actions["look_for_user"]
        goal = {"window": window, "user_id": user_id, "x": 0.0, "y": 0.0}
        ended: list[Any] = []
        action.start(goal, lambda result, outcome: ended.append((result, outcome)) or _over(), str)
        return ended

    @property
    def users(self) -> list[Any]:
        return self.heard["tracked_users"]


def _over() -> Any:
    from florence_bt.core.outcome import success

    return success()


@pytest.fixture(autouse=True)
def somebody(monkeypatch: pytest.MonkeyPatch) -> list[Detection]:
    """Whom the detector finds in each picture."""
    found = [Detection(2.0, 0.0, 2.0, posture="standing", height=1.7)]
    monkeypatch.setattr(tracking, "detect_people", lambda *_, **__: list(found))
    return found


def test_without_a_start_nothing_listens_to_pictures_and_none_is_read() -> None:
    around = Surroundings()
    assert not around.depth.listeners and not any(picture.reads for picture in around.see(3))
    assert around.users == [] and around.wires.buffers == []


def test_after_a_stop_it_listens_for_a_while_and_reads_none() -> None:
    around = Surroundings(keep_pictures_s=2.0)
    around.start()
    around.see(3)
    assert around.users[-1].num_users_tracked == 1
    around.wires.services["tracker/Stop"]({})
    heard = len(around.users)
    assert not any(picture.reads for picture in around.see(5)) and around.depth.listeners
    assert len(around.users) == heard
    around.clock.advance(2.0)
    assert not around.depth.listeners and around.wires.buffers == []


def test_a_picture_that_overtakes_its_pose_waits_for_it() -> None:
    around = Surroundings({TRANSFORMS: Link(delay=0.35)})
    around.start()
    around.clock.advance(1.0)
    around.see(12)
    assert around.users[-1].num_users_tracked == 1


@pytest.mark.parametrize("late_s", [0.0, 0.15, 0.35])
def test_a_picture_of_a_robot_that_turns_is_placed_where_the_robot_was(
    monkeypatch: pytest.MonkeyPatch, late_s: float
) -> None:
    placed: list[tuple[float, Pose2]] = []

    def detect(depth: DepthImage, *_: Any, robot: Pose2 | None = None, **__: Any) -> list[Detection]:
        if robot is not None:
            placed.append((depth.stamp, robot))
        return []

    monkeypatch.setattr(tracking, "detect_people", detect)
    around = Surroundings({TRANSFORMS: Link(delay=late_s)})
    around.turns = 1.0
    around.start()
    around.clock.advance(1.0)
    around.see(12)
    assert len(placed) >= 8, "those that wait are used as fast as they come"
    worst = max(abs(angle_difference(robot.yaw, around.pose_at(stamp).yaw)) for stamp, robot in placed)
    assert worst < 0.05, "of a person 3 m off, that is 15 cm"


def test_pictures_that_wait_are_not_pushed_out_by_newer_ones() -> None:
    around = Surroundings({TRANSFORMS: Link(delay=1.2)})
    around.start()
    around.clock.advance(1.5)
    around.see(40)
    assert len(around.users) > 15, "more than wait at a time"


def test_a_picture_of_before_the_first_frame_holds_up_nobody() -> None:
    around = Surroundings()
    around.clock.advance(1.0)
    assert around.wires.services["tracker/Start"]({}).success
    around.depth.send(depth_at(around.clock.now()))
    around.see(5)
    assert around.users, "the place of the odometry frame is stamped ahead, so that it is known from later on"


def test_a_picture_without_a_pose_is_given_up_after_two_seconds_and_later_ones_count() -> None:
    around = Surroundings()
    around.start()
    around.see(3)
    known = len(around.users)
    around.frames_known_until = around.clock.now()
    around.clock.advance(0.5)
    around.see(30)
    assert len(around.users) == known
    around.frames_known_until = math.inf
    around.clock.advance(0.1)
    around.see(3)
    assert len(around.users) > known


def test_pictures_that_come_too_soon_are_not_read() -> None:
    around = Surroundings(period_s=0.25)
    around.start()
    pictures = around.see(10)
    assert [picture.reads for picture in pictures] == [1, 0, 0, 1, 0, 0, 1, 0, 0, 1]


def test_a_late_picture_is_judged_by_the_pose_of_its_moment() -> None:
    around = Surroundings({"camera/depth/image": Link(delay=0.5)})
    around.start()
    around.see(12)
    ended = around.look()
    around.see(12)
    ((result, _),) = ended
    assert result.found and (result.x, result.y) == pytest.approx((3.0, 0.0), abs=0.01)


def test_a_look_starts_the_tracker_and_stops_it_again() -> None:
    around = Surroundings(keep_pictures_s=0.5)
    ended = around.look()
    assert around.depth.listeners
    around.see(12)
    assert ended[0][0].found and around.heard["detected_user"][0].user_position_x == pytest.approx(3.0)
    around.clock.advance(0.6)
    assert not around.depth.listeners


def test_a_look_without_pictures_ends_at_its_deadline_and_says_so() -> None:
    around = Surroundings()
    ended = around.look(window=3.0)
    around.clock.advance(2.9)
    assert ended == []
    around.clock.advance(0.2)
    assert ended[0][0].error_code == 2, "no_image"


def test_a_look_counts_nobody_whom_its_pictures_do_not_show(somebody: list[Detection]) -> None:
    """The tracker believes for a while in somebody who is out of view, and goes on with them as they went."""
    around = Surroundings()
    around.start()
    around.see(5)
    somebody.clear()
    ended = around.look(2.0, user_id=1)
    around.see(25)
    ((result, _),) = ended
    assert not result.found


def test_a_picture_of_before_the_start_is_not_used() -> None:
    """The robot turned then: a camera that turns sees people who are not there."""
    around = Surroundings(links={tracking.DEPTH.name: Link(delay=0.5)})
    around.start()
    around.see(8)
    around.wires.services["tracker/Stop"]({})
    turning = around.see(4)
    around.start()
    after = around.see(8)
    assert [picture.reads for picture in turning] == [1] * 4, "by the link only"
    assert after[0].reads == 2


def test_a_look_counts_no_picture_that_was_taken_before_it_began(somebody: list[Detection]) -> None:
    around = Surroundings(links={tracking.DEPTH.name: Link(delay=1.0)})
    around.start()
    around.see(20)
    somebody.clear()
    somebody.append(Detection(2.0, 0.1, 2.0, posture="standing", height=1.7))
    ended = around.look(0.9)
    around.see(12)
    ((result, _),) = ended
    assert result.error_msg.startswith("0 usable images")


def test_who_tracks_already_goes_on_after_a_look() -> None:
    around = Surroundings()
    around.start()
    around.look()
    around.see(12)
    heard = len(around.users)
    around.see(2)
    assert len(around.users) == heard + 2


def test_a_window_that_is_too_long_is_refused() -> None:
    around = Surroundings()
    action = around.wires.actions["look_for_user"]
    run = action.start({"window": 100.0}, lambda *_: _over(), str)
    assert run.result is not None and run.result.code == "rejected" and "window" in run.result.reason


def test_a_broken_depth_picture_is_left_out_and_the_next_one_counts() -> None:
    around = Surroundings()
    around.start()
    around.clock.advance(0.1)
    around.depth.send(Picture(around.clock.now(), FrameError("half a picture")))
    around.see(3)
    assert around.users[-1].num_users_tracked == 1


def test_colours_are_read_only_when_the_verifier_has_somebody_to_judge(
    somebody: list[Detection], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    monkeypatch.setattr(
        tracking, "verdicts", lambda _, colour, candidates: asked.append(len(candidates)) or []
    )
    around = Surroundings(verifier=object())
    around.start()
    here = [replace(each, region=Region(0.0, 0.0, 1.0, 1.0)) for each in somebody]
    for people, reads in (([], 0), (here, 1)):
        somebody[:] = people
        colour = Picture(around.clock.now() + PERIOD_S, _colours(around.clock.now() + PERIOD_S))
        around.colour.send(colour)
        around.see(1)
        assert min(colour.reads, 1) == reads
    assert asked == [1]


def _colours(stamp: float) -> ColourImage:
    return ColourImage(stamp, "camera", CAMERA, np.zeros((3, 4, 3), np.uint8))


def test_wires_drop_sensor_readings_and_nothing_else() -> None:
    clock = ManualClock()
    wires = Wires(clock, [], {"a": Link(drops=0.5), "b": Link(drops=0.5, delay=0.2)}, seed=1)
    one, two = wires.ports("one"), wires.ports("two")
    sensor, sure = Topic("a", float, Delivery.SENSOR), Topic("b", float)
    heard: dict[str, list[float]] = {"a": [], "b": []}
    for topic in (sensor, sure):
        two.listen(topic, heard[topic.name].append)
        output = one.output(topic)
        for number in range(200):
            output.send(float(number))
    assert heard == {"a": [], "b": []}, "nothing comes within the call that sends it"
    clock.advance(0.1)
    assert 60 < len(heard["a"]) < 140 and heard["b"] == []
    clock.advance(0.2)
    assert heard["b"] == [float(number) for number in range(200)]
    latched = Topic("c", str, Delivery.LATCHED)
    one.output(latched).send("last")
    clock.advance(0.1)
    late: list[str] = []
    two.listen(latched, late.append)
    clock.advance(0.1)
    assert late == ["last"]


@pytest.mark.parametrize("mission", sorted(BUILT_IN.glob("*.yaml"), key=str))
def test_each_look_of_a_mission_is_long_enough_at_five_pictures_a_second(mission: Path) -> None:
    """A shorter one ends with ``no_image`` whenever a picture is late."""
    windows = [float(each) for each in re.findall(r"window: ([\d.]+) s\b", mission.read_text())]
    least = (LookParameters().enough_pictures + 1) / 5.0
    assert all(window >= least for window in windows)
