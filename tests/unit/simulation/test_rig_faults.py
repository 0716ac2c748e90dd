"""Sensors that are worse than usual, and links that fall silent, in the rig."""

from __future__ import annotations

import math

import numpy as np
import pytest

from florence_bt.core.clock import ManualClock
from florence_bt.core.ports import Topic
from florence_bt.core.topic_names import RAW_DEPTH_IMAGE
from florence_bt.simulation.rig.wires import Link, Wires

PAIRS = Topic("pairs", float)


def heard_at(link: Link) -> list[float]:
    """When a message each 0.5 s for 5 s is heard over a link."""
    clock = ManualClock()
    wires = Wires(clock, [], {"pairs": link})
    heard: list[float] = []
    wires.ports("hears").listen(PAIRS, heard.append)
    output = wires.ports("sends").output(PAIRS)
    for _ in range(10):
        output.send(clock.now())
        clock.advance(0.5)
    return heard


def test_a_link_is_silent_for_its_time_and_carries_everything_before_and_after() -> None:
    usual = heard_at(Link())
    silent = heard_at(Link(silent_from=usual[0] + 1.0, silent_for=2.0))
    assert set(usual) - set(silent) == {at for at in usual if 1.0 <= at - usual[0] < 3.0}


@pytest.mark.slow
def test_a_camera_that_looks_further_down_sees_the_floor_nearer() -> None:
    from florence_bt.app.demo.rigs import make_rig
    from florence_bt.simulation.rig.robot import SensorQuality

    def lowest_row(pitch: float) -> float:
        rig = make_rig(person="absent", quality=SensorQuality(camera_pitch=pitch))
        images: list[np.ndarray] = []
        rig.topics[RAW_DEPTH_IMAGE].subscribe(lambda image: images.append(image.depth))
        rig.clock.advance(1.0)
        return float(np.median(images[-1][-1]))

    assert 0 < lowest_row(math.radians(3.0)) < lowest_row(0.0) - 50, "millimetres"
