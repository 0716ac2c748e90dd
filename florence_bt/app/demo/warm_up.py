"""Runs everything that numba compiles once, so that the compiled code is on disk: ``make setup`` calls it.

The first call of a hot loop takes seconds to compile. On a robot, or in a simulation with a clock, that
would be seconds without control.
"""

from __future__ import annotations

import numpy as np

from florence_bt.app.bringup.simulated import robot_frames
from florence_bt.app.demo.rigs import make_rig
from florence_bt.core.errors import FlorenceError
from florence_bt.drivers.kinect.camera import View
from florence_bt.drivers.kinect.codec import pack_11_bit
from florence_bt.drivers.kinect.driver import KinectDriver, KinectParameters
from florence_bt.drivers.kinect.frames import DepthEncoding, DepthFrame, VideoFrame
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.rig.robot import BASE_FRAME, CAMERA_FRAME
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor


def warm_up() -> None:
    """Run the main job once in the rig, take one picture in colour, and make pictures of Kinect frames.

    Raises:
        FlorenceError: The main job does not work on this machine.
    """
    rig = make_rig(seed=1, person="kitchen")
    run = rig.run("goto_user")
    if run.status is not RunStatus.SUCCEEDED:
        raise FlorenceError(f"goto_user in the rig: {run.status.value}: {run.reason}")
    KinectSensor(rig.world, robot_frames().lookup(BASE_FRAME, CAMERA_FRAME)).measure()
    _warm_up_kinect()


def _warm_up_kinect() -> None:
    """Make a picture of every encoding, and coloured points."""
    driver, raw = KinectDriver(KinectParameters()), np.full((2, 8), 800, np.uint16)
    packed = pack_11_bit(raw)
    for payload, encoding in (
        (packed, DepthEncoding.PACKED),
        (raw, DepthEncoding.RAW),
        (raw, DepthEncoding.MILLIMETRES),
    ):
        driver.depth(DepthFrame(8, 2, 0.0, payload, encoding, View.DEPTH), 0.0)
    driver.coloured_points(driver.colour(VideoFrame(8, 2, 0.0, bytes(48)), 0.0))
    large = np.zeros((480, 640, 3), np.uint8)
    driver.depth(DepthFrame(8, 2, 0.0, raw, DepthEncoding.RAW, View.DEPTH), 0.0)
    driver.coloured_points(driver.colour(VideoFrame(640, 480, 0.0, large), 0.0))


if __name__ == "__main__":
    warm_up()
