"""The laser of the rig is the robot's but for its bytes: its scans are stamped and come as real ones."""

from __future__ import annotations

from typing import Any

import pytest

from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.geometry import Twist2
from florence_bt.core.sensing import LaserScan
from florence_bt.core.topics import DIAGNOSES, SCAN
from florence_bt.drivers.hokuyo.geometry import URG_04LX
from florence_bt.simulation.rig.rig import Rig
from florence_bt.simulation.rig.robot import FILTERED_VELOCITY


def scans_of(rig: Rig) -> list[tuple[float, LaserScan]]:
    heard: list[tuple[float, LaserScan]] = []
    rig.topics[SCAN.name].subscribe(lambda scan: heard.append((rig.clock.now(), scan)))
    return heard


def test_a_scan_comes_when_its_sweep_ends_and_its_middle_is_the_moment_of_what_it_shows() -> None:
    rig = make_rig(person="absent", seed=1)
    heard = scans_of(rig)
    command = rig.wires.ports("hand").output(FILTERED_VELOCITY)
    for _ in range(20):
        command.send(Twist2(0.3, 0.0))
        rig.clock.advance(0.1)
    assert len(heard) == 20
    for came, scan in heard:
        sweep = (len(scan.ranges) - 1) * scan.time_increment
        assert came == pytest.approx(scan.stamp + sweep + scan.time_increment, abs=1e-6)
        middle = scan.stamp + sweep / 2
        turns = middle / URG_04LX.scan_period
        assert turns == pytest.approx(round(turns), abs=1e-6)


def test_a_robot_that_stands_gets_few_scans_and_all_of_them_again_once_it_is_driven() -> None:
    rig = make_rig(person="absent", seed=1)
    rig.clock.advance(2.0)
    heard = scans_of(rig)
    rig.clock.advance(5.0)
    assert len(heard) == 10
    rig.wires.ports("hand").output(FILTERED_VELOCITY).send(Twist2(0.2, 0.0))
    heard.clear()
    rig.clock.advance(0.5)
    assert len(heard) >= 4


def test_the_scanner_tells_once_a_second_that_it_measures() -> None:
    rig = make_rig(person="absent", seed=1)
    told: list[Any] = []
    rig.topics[DIAGNOSES.name].subscribe(told.append)
    rig.clock.advance(3.0)
    found = [each.found["laser scanner"] for each in told if "laser scanner" in each.found]
    assert len(found) == 3 and all(each.values["Measurement"].startswith("MD") for each in found)
