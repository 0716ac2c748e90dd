"""Runs everything that numba compiles once, so that the compiled code is on disk: ``make setup`` calls it.

The first call of a hot loop takes seconds to compile. On a robot, or in a simulation with a clock, that
would be seconds without control.
"""

from __future__ import annotations

from florence_bt.core.errors import FlorenceError
from florence_bt.runtime.run import RunStatus
from florence_bt.simulation.rig_robot import BASE_FRAME, CAMERA_FRAME
from florence_bt.simulation.sensors import KinectSensor
from florence_bt.wiring.rigs import make_rig
from florence_bt.wiring.simulated import robot_frames


def warm_up() -> None:
    """Run the main job once in the rig, and take one picture in colour.

    Raises:
        FlorenceError: The main job does not work on this machine.
    """
    rig = make_rig(seed=1, person="kitchen")
    run = rig.run("goto_user")
    if run.status is not RunStatus.SUCCEEDED:
        raise FlorenceError(f"goto_user in the rig: {run.status.value}: {run.reason}")
    KinectSensor(rig.world, robot_frames().lookup(BASE_FRAME, CAMERA_FRAME)).measure()


if __name__ == "__main__":
    warm_up()
