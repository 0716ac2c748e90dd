"""The simulated sensors. They speak device units, so that emulators can put their values into bytes."""

from florence_bt.simulation.kinect_sensor import KinectParameters, KinectSensor
from florence_bt.simulation.laser_sensor import LaserParameters, LaserSensor

__all__ = ["KinectParameters", "KinectSensor", "LaserParameters", "LaserSensor"]
