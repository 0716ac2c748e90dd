"""Laser and fake laser in one scan (REFERENCE 6.3).

``merge`` combines two scans, ``combinator`` decides when, ``node`` is the ROS side.
"""
