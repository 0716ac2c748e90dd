"""Topics of values of ``core`` that several components share."""

from __future__ import annotations

from florence_bt.core.diagnosis import Diagnoses
from florence_bt.core.ports import Delivery, Topic
from florence_bt.core.sensing import LaserScan, OccupancyGrid, Odometry, PoseEstimate

DIAGNOSES = Topic("diagnostics", Diagnoses, Delivery.LATCHED)
MAP = Topic("map", OccupancyGrid, Delivery.LATCHED)
ODOMETRY = Topic("odom", Odometry, Delivery.STATE)
POSE = Topic("amcl_pose", PoseEstimate, Delivery.LATCHED)
SCAN = Topic("scan", LaserScan, Delivery.SENSOR)
"""The laser's own scans."""
