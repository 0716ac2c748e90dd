"""Depth pictures to a fake laser scan (REFERENCE 6.1): ``fake_laser`` computes, ``node`` is the ROS side."""
