"""A thing that looks like a person from far away, in the rig: it is looked at from nearby once."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.home.flat import Solid, load_flat
from florence_bt.skills.people.user_tracker import tracking
from florence_bt.skills.people.user_tracker.detector import Detection

pytestmark = pytest.mark.slow

STAND = (5.4, 2.95)


def test_a_second_look_at_a_coat_stand_is_short_and_who_stands_there_later_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    confidence = 0.8

    def detect(*arguments: Any, robot: Pose2 | None = None, **others: Any) -> list[Detection]:
        if robot is None:
            return []  # the picture that loads the detector
        camera = robot.apply(-0.09, 0.0)
        away, bearing = math.dist(camera, STAND), robot.bearing_to(*STAND)
        looks_so = 2.3 < away < 4.2 and abs(bearing) < 0.4
        return [Detection(*robot.inverse().apply(*STAND), away, confidence)] if looks_so else []

    monkeypatch.setattr(tracking, "detect_people", detect)
    stand = Solid("coat_stand", *STAND, 0.0, None, 0.12, 0.0, 1.75, (90, 60, 60))
    flat = load_flat()
    rig = make_rig(
        person="absent", flat=replace(flat, solids=(*flat.solids, stand)), start=Pose2(8.7, 2.95, math.pi)
    )

    found = rig.run("detect_user", {"looks": "1"})
    assert found.status is RunStatus.SUCCEEDED
    who = {"seen_at": found.outputs["user"], "seen_id": 1, "distance": 3.3}
    assert rig.run("meet_user", who).code == "no_user_seen"

    rig.run("goto_pose", {"x": "8.7 m", "y": "2.95 m", "phi": "180 deg"})
    rig.clock.advance(200.0)
    begin = rig.clock.now()
    assert rig.run("detect_user", {"looks": "1"}).code == "no_user_seen"
    assert rig.clock.now() - begin < 5.0

    confidence = 0.95
    assert rig.run("detect_user", {"looks": "1"}).status is RunStatus.SUCCEEDED
