"""Topics of ports that several components share: each name with the type of its values, once."""

from __future__ import annotations

from florence_bt.core.ports import Delivery, Topic, pictures
from florence_bt.core.sensing import DepthImage, LaserScan, OccupancyGrid
from florence_bt.ros import topics

MAP = Topic(topics.MAP, OccupancyGrid, Delivery.LATCHED)
SCAN = Topic(topics.SCAN, LaserScan, Delivery.SENSOR)
KINECT_SCAN = Topic(topics.KINECT_SCAN, LaserScan, Delivery.SENSOR)
DEPTH = pictures(topics.DEPTH_IMAGE, DepthImage)
