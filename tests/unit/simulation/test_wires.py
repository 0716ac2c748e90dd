"""The wires of the rig: when what is sent comes, to whom, and what is lost."""

from __future__ import annotations

import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.ports import Delivery, Topic
from florence_bt.core.transforms import TransformUnavailable
from florence_bt.simulation.rig.wires import EVERY, TRANSFORMS, Link, Wires

WORDS = Topic("words", str)
STATE = Topic("state", str, Delivery.LATCHED)
READINGS = Topic("readings", float, Delivery.SENSOR)


class Bench:
    """Two components that are connected, and what the second has heard, and when."""

    def __init__(self, links: dict[str, Link] | None = None) -> None:
        self.clock = ManualClock()
        self.wires = Wires(self.clock, [], links)
        self.one, self.other = self.wires.ports("one"), self.wires.ports("other")
        self.heard: list[tuple[float, object]] = []

    def listen(self, topic: Topic[str] | Topic[float]) -> None:
        self.other.listen(topic, lambda value: self.heard.append((self.clock.now(), value)))


def test_what_is_sent_comes_at_the_same_moment_and_after_what_goes_on() -> None:
    bench = Bench()
    bench.listen(WORDS)
    words = bench.one.output(WORDS)
    words.send("a")
    words.send("b")
    assert bench.heard == []
    bench.clock.advance(0.0)
    assert bench.heard == [(0.0, "a"), (0.0, "b")]


def test_one_topic_is_late_and_the_others_are_not() -> None:
    bench = Bench({"words": Link(delay=0.3)})
    bench.listen(WORDS)
    bench.listen(READINGS)
    bench.one.output(WORDS).send("a")
    bench.one.output(READINGS).send(1.0)
    bench.clock.advance(1.0)
    assert bench.heard == [(0.0, 1.0), (0.3, "a")]


def test_a_latched_value_is_late_for_who_comes_later_too() -> None:
    bench = Bench({EVERY: Link(delay=0.3)})
    bench.one.output(STATE).send("ready")
    bench.clock.advance(1.0)
    bench.listen(STATE)
    bench.clock.advance(1.0)
    assert bench.heard == [(1.3, "ready")]


def test_readings_are_lost_and_what_is_reliable_is_not() -> None:
    bench = Bench({EVERY: Link(drops=0.5)})
    bench.listen(WORDS)
    bench.listen(READINGS)
    for number in range(100):
        bench.one.output(WORDS).send(str(number))
        bench.one.output(READINGS).send(float(number))
    bench.clock.advance(0.0)
    assert len([value for _, value in bench.heard if isinstance(value, str)]) == 100
    assert 30 < len([value for _, value in bench.heard if isinstance(value, float)]) < 70


def test_frames_have_a_link_of_their_own() -> None:
    bench = Bench({TRANSFORMS: Link(delay=0.2)})
    frames = bench.other.listen_to_frames()
    bench.one.send_frame("map", "odom", 0.0, Pose2(1.0))
    bench.clock.advance(0.1)
    with pytest.raises(TransformUnavailable):
        frames.buffer.lookup("map", "odom")
    bench.clock.advance(0.2)
    assert frames.buffer.lookup_pose("map", "odom") == Pose2(1.0)


def test_a_topic_below_the_name_of_its_component_is_found_by_its_whole_name() -> None:
    bench = Bench()
    bench.listen(Topic("one/mood", str))
    bench.one.output(Topic("~/mood", str)).send("fine")
    bench.clock.advance(0.0)
    assert bench.heard == [(0.0, "fine")]


def test_a_link_of_no_topic_is_refused() -> None:
    bench = Bench({"wrods": Link(delay=0.1)})
    bench.listen(WORDS)
    with pytest.raises(ConfigError, match=r"'wrods'.*words"):
        bench.wires.check_links()
