"""The Kinect of the rig is the robot's but for its source: pictures, and all that is made of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.diagnosis import Severity
from florence_bt.core.topics import COLOUR, DEPTH, DIAGNOSES
from florence_bt.drivers.kinect.seeing import DEPTH_POINTS, RAW_DEPTH


def test_who_listens_gets_pictures_points_and_millimetres_of_the_same_moment() -> None:
    rig = make_rig(person="absent", seed=1)
    listener = rig.wires.ports("viewer")
    heard: dict[str, list[Any]] = {topic.name: [] for topic in (DEPTH, COLOUR, RAW_DEPTH, DEPTH_POINTS)}

    def take(name: str, value: Any) -> None:
        heard[name].append(value.read() if hasattr(value, "read") else value)

    for topic in (DEPTH, COLOUR, RAW_DEPTH, DEPTH_POINTS):
        listener.listen(topic, lambda value, name=topic.name: take(name, value))
    rig.clock.advance(1.0)
    depth, colour, raw, cloud = (values[-1] for values in heard.values())
    assert depth.stamp == colour.stamp == raw.stamp == cloud.stamp
    seen = np.isfinite(depth.depth)
    assert seen.any()
    np.testing.assert_array_equal(raw.depth[seen], np.rint(1000.0 * depth.depth[seen]))
    np.testing.assert_array_equal(cloud.points[..., 2][seen], depth.depth[seen])
    assert colour.pixels.shape == (120, 160, 3)


def test_it_tells_that_pictures_come() -> None:
    rig = make_rig(person="absent", seed=1)
    told: list[Any] = []
    rig.topics[DIAGNOSES.name].subscribe(told.append)
    rig.clock.advance(2.0)
    found = [each.found["Kinect"] for each in told if "Kinect" in each.found]
    assert [each.level for each in found] == [Severity.OK, Severity.OK]
