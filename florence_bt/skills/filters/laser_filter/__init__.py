"""Makes scans fit for a costmap (REFERENCE 6.4): ``laser_filter`` computes, ``node`` is the ROS side."""
