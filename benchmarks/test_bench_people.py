"""What it costs to find and follow people in the Kinect's pictures."""

from __future__ import annotations

import itertools
import statistics
import time

import cv2

from benchmarks.measure import size
from florence_bt.app.bringup.simulated import robot_frames
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import DepthImage
from florence_bt.drivers.kinect.codec import metres_from_raw
from florence_bt.simulation.home.build_map import laser_map
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.robot import BASE_FRAME, CAMERA_FRAME
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.skills.people.user_tracker.detector import detect_people
from florence_bt.skills.people.user_tracker.known_obstacles import KnownObstacles
from florence_bt.skills.people.user_tracker.tracker import UserTracker

PICTURES, ROUNDS, RATE_HZ = size(200, 2), size(3, 1), 10


def test_tracker(benchmark, figures):
    """Two people in view, 320 x 240, the map known, no colours; one thread of OpenCV."""
    flat, mount = load_flat(), robot_frames().lookup(BASE_FRAME, CAMERA_FRAME)
    people = [
        PersonSpec(name, flat.start @ Pose2(ahead, left))
        for name, ahead, left in (("a", 1.5, 0.3), ("b", 1.8, -0.4))
    ]
    world = SimulatedWorld(flat, people=people)
    kinect = KinectSensor(world, mount)
    depth = DepthImage(0.0, CAMERA_FRAME, kinect.camera, metres_from_raw(kinect.measure_depth()))
    known, tracker, seen = KnownObstacles(laser_map(flat)), UserTracker(), []
    tracker.start()

    stamps = itertools.count()

    def look() -> None:
        found = detect_people(depth, mount, known=known, robot=flat.start)
        now = next(stamps) / RATE_HZ
        seen.append(len(tracker.update(now, [each.moved_by(flat.start) for each in found])))

    def look_at_all() -> float:
        begin = time.process_time()
        for _ in range(PICTURES):
            look()
        return (time.process_time() - begin) / PICTURES

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    look()
    costs = []
    benchmark.pedantic(lambda: costs.append(look_at_all()), rounds=ROUNDS)
    cv2.setNumThreads(threads)
    assert seen[-1] == len(people)
    cost = statistics.median(costs)
    figures.add("people: detection and tracking of a picture", f"{1000 * cost:.1f} ms", "320x240, two people")
    figures.add(
        f"people: tracker at {RATE_HZ} Hz", f"{100 * cost * RATE_HZ:.0f} % of a core", "aim: under 40 %"
    )
