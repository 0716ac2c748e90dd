"""The filters as components: what they listen to, what they send then, and what stops them."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.geometry import STANDSTILL, Twist2
from florence_bt.core.ports import Delivery, Topic
from florence_bt.core.sensing import LaserScan
from florence_bt.core.topic_names import MANUAL_OVERRIDE
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.rig.wires import WiredPorts, Wires
from florence_bt.skills.filters.depth_to_laser import projecting
from florence_bt.skills.filters.depth_to_laser.fake_laser import ThrottleParameters
from florence_bt.skills.filters.depth_to_laser.low_obstacles import LowObstacleParameters
from florence_bt.skills.filters.depth_to_laser.overhangs import OverhangParameters
from florence_bt.skills.filters.laser_combinator import combining
from florence_bt.skills.filters.laser_combinator.merge import CombinatorParameters
from florence_bt.skills.filters.laser_filter.filtering import LaserFiltering, LaserFilterTopics
from florence_bt.skills.filters.laser_filter.laser_filter import LaserFilterParameters
from florence_bt.skills.filters.velocity_filter.limiting import VelocityLimiting
from florence_bt.skills.filters.velocity_filter.velocity_filter import VelocityFilterParameters
from tests.unit.skills.depth_pictures import MIDDLE, WHOLE_BAND, floor, picture, with_box
from tests.unit.skills.test_combinator import MOUNTING, kinect_scan, laser_scan

LASER, KINECT = "base_laser_round_link", "camera_depth_frame"


class HeardPorts(WiredPorts):
    """Ports that keep the warnings."""

    def __init__(self, wires: Wires, node: str) -> None:
        super().__init__(wires, node, {})
        self.warnings: list[str] = []

    def warn(self, text: str, about: Hashable = None) -> None:
        self.warnings.append(text)


class Around:
    """What is around a component: its topics, and what it says."""

    def __init__(self, *mounts: tuple[str, str, Transform3]) -> None:
        self.clock = ManualClock(10.0)
        self.wires = Wires(self.clock, list(mounts))
        self.ports = HeardPorts(self.wires, "filter")
        self.other = self.wires.ports("other")
        self.heard: list[tuple[str, Any]] = []

    def hear(self, name: str, kind: type[Any] = LaserScan) -> None:
        self.other.listen(Topic(name, kind), lambda value: self.heard.append((name, value)))

    def send(self, name: str, value: Any, delivery: Delivery = Delivery.SENSOR) -> None:
        self.other.output(Topic(name, type(value), delivery)).send(value)
        self.clock.advance(0.0)


# ---- depth pictures to scans ---------------------------------------------------------------------------


class Depth:
    """A depth picture that may be damaged."""

    def __init__(self, stamp: float, depth: np.ndarray | None) -> None:
        self.stamp, self._depth = stamp, depth

    def read(self) -> Any:
        if self._depth is None:
            raise FrameError("damaged")
        return replace(picture(self._depth), stamp=self.stamp)


def projecting_around(**parameters: Any) -> Around:
    around = Around()
    parts = (
        parameters.get("low", LowObstacleParameters(low_min_height=-0.48)),
        parameters.get("overhangs", OverhangParameters(overhang_min_height=0.21)),
    )
    projecting.DepthProjecting(around.ports, WHOLE_BAND, *parts, ThrottleParameters(max_rate=20.0))
    return around


ALL_SCANS = ("kinect_scan", "kinect_low_scan", "kinect_overhang_scan")


def test_a_picture_becomes_three_scans_of_its_moment() -> None:
    around = projecting_around()
    for name in ALL_SCANS:
        around.hear(name)
    shoe_and_box = with_box(with_box(floor(), 1.35, (0.0, 0.1), 0.1, -0.1), 2.0, (0.8, 0.95), 0.1, -0.1)
    around.send("camera/depth/image", Depth(9.9, shoe_and_box))
    assert [(name, scan.stamp) for name, scan in around.heard] == [(name, 9.9) for name in ALL_SCANS]
    tall, low, over = (scan.ranges[MIDDLE] for _, scan in around.heard)
    assert (tall, low, over) == pytest.approx((2.0, 1.35, 2.0), abs=0.03)


def test_nothing_is_made_while_nobody_listens_to_the_whole_band() -> None:
    around = projecting_around()
    around.hear("kinect_low_scan")
    around.send("camera/depth/image", Depth(9.9, None))
    assert (around.heard, around.ports.warnings) == ([], [])


def test_scans_whose_band_is_empty_are_left_out() -> None:
    around = projecting_around(low=LowObstacleParameters(), overhangs=OverhangParameters())
    for name in ALL_SCANS:
        around.hear(name)
    around.send("camera/depth/image", Depth(9.9, floor()))
    assert [name for name, _ in around.heard] == ["kinect_scan"]


def test_pictures_come_no_faster_than_the_rate_and_a_damaged_one_is_told() -> None:
    around = projecting_around()
    around.hear("kinect_scan")
    for stamp in (9.0, 9.04, 9.046, 9.08, 9.092):
        around.send("camera/depth/image", Depth(stamp, floor()))
    assert [scan.stamp for _, scan in around.heard] == [9.0, 9.046, 9.092]
    around.send("camera/depth/image", Depth(9.5, None))
    assert around.ports.warnings == ["depth picture dropped: damaged"]
    assert len(around.heard) == 3


# ---- the combinator ------------------------------------------------------------------------------------


def combining_around(*mounts: tuple[str, str, Transform3], **parameters: Any) -> Around:
    around = Around(*mounts)
    around.hear("scan_combined")
    combining.LaserCombining(around.ports, CombinatorParameters(**parameters))
    return around


def test_scans_are_combined_when_a_kinects_scan_comes() -> None:
    around = combining_around()
    around.send("scan", laser_scan())
    assert around.heard == []
    around.send("kinect_scan", kinect_scan(np.full(360, 2.0)))
    ((_, combined),) = around.heard
    assert combined.ranges[256] == 2.0 and combined.frame_id == LASER
    around.clock.advance(2.0)
    around.send("kinect_scan", kinect_scan())
    assert len(around.heard) == 1, "neither is fresh any more"
    assert around.wires.buffers == [], "no frames are needed"


def test_the_mounting_is_looked_up_once_and_frames_are_no_longer_kept_then() -> None:
    around = combining_around((LASER, KINECT, MOUNTING), project_origin=True)
    assert len(around.wires.buffers) == 1
    around.send("kinect_scan", kinect_scan(np.full(360, 2.0)))
    assert len(around.wires.buffers) == 1, "the laser's frame is not known before its first scan"
    around.send("scan", laser_scan())
    around.send("kinect_scan", kinect_scan(np.full(360, 2.0)))
    ((_, combined),) = around.heard
    assert combined.ranges[256] == pytest.approx(2.0 - 0.1444, abs=0.01)
    assert around.wires.buffers == []
    around.send("kinect_scan", kinect_scan(np.full(360, 2.0)))
    assert len(around.heard) == 2 and around.ports.warnings == []


@pytest.mark.parametrize(("named", "combines"), [("", True), ("elsewhere", False)])
def test_the_frame_of_the_kinect_may_be_named(named: str, combines: bool) -> None:
    around = combining_around((LASER, "tilted", MOUNTING), project_origin=True, kinect_frame_id=named)
    around.send("scan", laser_scan())
    around.send("kinect_scan", replace(kinect_scan(np.full(360, 2.0)), frame_id="tilted"))
    assert (len(around.heard) == 1) is combines
    assert [text.startswith("nothing combined yet: ") for text in around.ports.warnings] == [True] * (
        not combines
    )


# ---- the laser filter ----------------------------------------------------------------------------------


def scan_of(ranges: list[float]) -> LaserScan:
    return LaserScan(3.0, "laser", -1.0, 0.1, 0.02, 5.6, np.array(ranges, np.float32))


@pytest.mark.parametrize("filter_kinect", [False, True])
def test_every_scan_is_filtered_on_its_own_topic(filter_kinect: bool) -> None:
    around = Around()
    topics = LaserFilterTopics("scan_combined", filter_kinect) if filter_kinect else LaserFilterTopics()
    LaserFiltering(around.ports, LaserFilterParameters(), topics)
    results = {
        "scan_combined": "filtered_scan",
        "scan": "filtered_laser_scan",
        "kinect_scan": "filtered_kinect_scan",
        "kinect_low_scan": "filtered_kinect_low_scan",
        "kinect_overhang_scan": "filtered_kinect_overhang_scan",
    }
    for result in results.values():
        around.hear(result)
    for number, source in enumerate(results):
        around.send(source, scan_of([math.inf, 0.1, 1.0 + number]))
    names = list(results.values()) if filter_kinect else ["filtered_scan"]
    assert [name for name, _ in around.heard] == names
    for number, (_, scan) in enumerate(around.heard):
        assert scan.ranges[0] == pytest.approx(5.5999, abs=1e-5)
        assert np.isnan(scan.ranges[1]) and scan.ranges[2] == 1.0 + number


def test_a_filter_without_a_topic_is_refused_with_what_would_have_worked() -> None:
    with pytest.raises(
        ConfigError, match=r"input_topic is empty.*input_topic: scan_combined, input_topic: scan"
    ):
        LaserFilterTopics("")


# ---- the velocity filter -------------------------------------------------------------------------------


class Limiting(Around):
    """A velocity filter, and what it sends to the base."""

    def __init__(self) -> None:
        super().__init__()
        self.limiting = VelocityLimiting(self.ports, VelocityFilterParameters())
        self.speeds: dict[str, list[Twist2]] = {}
        for name in ("filtered_cmd_vel", "filtered_manual_cmd_vel"):
            heard: Callable[[Any], None] = self.speeds.setdefault(name, []).append
            self.other.listen(Topic(name, Twist2), heard)

    def drive(self, topic: str = "cmd_vel", speed: float = 0.5) -> float:
        """Command a speed for a while; return the last one that came out, of all the newest."""
        sent = self.speeds[f"filtered_{topic}"]
        sent.clear()
        for _ in range(20):
            self.send(topic, Twist2(speed, 0.0), Delivery.COMMAND)
            self.clock.advance(0.05)
        return sent[-1].linear if sent else 0.0

    def ask(self, service: str, on: bool) -> str:
        answer = self.wires.services[f"filter/{service}"]({"data": on})
        assert answer.success
        self.clock.advance(0.0)
        return str(answer.message)

    def override(self, on: bool) -> None:
        self.send(MANUAL_OVERRIDE, on, Delivery.LATCHED)


def test_commands_of_programs_and_of_a_hand_have_a_filter_each() -> None:
    base = Limiting()
    assert base.drive("cmd_vel", 0.4) == pytest.approx(0.4)
    assert base.speeds["filtered_manual_cmd_vel"] == []
    assert base.drive("manual_cmd_vel", 0.3) == pytest.approx(0.3)


def test_a_hard_stop_holds_programs_and_the_hand_until_it_is_released() -> None:
    base = Limiting()
    base.drive()
    said = base.ask("hard_stop", True)
    assert said == "standing still until released: cmd_vel and manual_cmd_vel"
    assert base.speeds["filtered_cmd_vel"][-1] == STANDSTILL
    assert base.drive() == base.drive("manual_cmd_vel") == 0.0
    assert base.ask("hard_stop", False) == "released; the next velocity command counts again"
    assert base.drive() == base.drive("manual_cmd_vel") == pytest.approx(0.5)


@pytest.mark.parametrize("first", ["the override", "the stop"])
def test_the_hand_passes_a_hard_stop_while_the_override_is_on(first: str) -> None:
    base = Limiting()
    if first == "the override":
        base.override(True)
    said = base.ask("hard_stop", True)
    if first == "the stop":
        base.override(True)
    else:
        assert said == "standing still until released: cmd_vel"
    assert base.drive() == 0.0
    assert base.drive("manual_cmd_vel") == pytest.approx(0.5)
    base.override(False)
    assert base.speeds["filtered_manual_cmd_vel"][-1] == STANDSTILL
    assert base.drive("manual_cmd_vel") == 0.0


def test_a_stop_of_all_holds_the_hand_also_while_the_override_is_on() -> None:
    base = Limiting()
    base.override(True)
    assert base.ask("stop_all", True) == "standing still until released: cmd_vel and manual_cmd_vel"
    assert base.drive("manual_cmd_vel") == 0.0
    base.ask("hard_stop", True)
    assert base.drive("manual_cmd_vel") == 0.0, "what is stopped for all stays so"
    base.ask("hard_stop", False)
    assert base.drive("manual_cmd_vel") == pytest.approx(0.5), "each of them releases both"
    base.ask("hard_stop", True)
    assert base.drive("manual_cmd_vel") == pytest.approx(0.5), "and the next one is no stop of all"
    base.ask("stop_all", False)
    assert base.drive() == pytest.approx(0.5)


def test_a_stop_that_is_repeated_sends_a_zero_again_and_an_override_does_not() -> None:
    base = Limiting()
    base.ask("hard_stop", True)
    base.clock.advance(5.0)
    sent = base.speeds["filtered_cmd_vel"]
    for act, more in (
        (lambda: base.override(True), 0),
        (lambda: base.ask("hard_stop", True), 1),
    ):
        before = len(sent)
        act()
        assert (len(sent) - before > 0) is bool(more)
        assert all(twist == STANDSTILL for twist in sent)


def test_commands_that_are_no_numbers_are_told_with_their_count() -> None:
    base = Limiting()
    for _ in range(2):
        base.send("cmd_vel", Twist2(math.nan, 0.0), Delivery.COMMAND)
    base.send("cmd_vel", Twist2(0.1, 0.0), Delivery.COMMAND)
    assert base.ports.warnings == [
        "velocity command refused: its numbers are not finite (1 so far)",
        "velocity command refused: its numbers are not finite (2 so far)",
    ]


def test_a_failure_stops_at_once_and_the_end_leaves_a_zero() -> None:
    base = Limiting()
    base.drive()
    base.limiting.fail()
    base.clock.advance(0.0)
    assert base.speeds["filtered_cmd_vel"][-1] == STANDSTILL
    assert base.drive() == pytest.approx(0.5), "the next command counts"
    base.limiting.close()
    base.clock.advance(0.0)
    assert all(sent[-1] == STANDSTILL for sent in base.speeds.values())
    assert base.drive() == 0.0
