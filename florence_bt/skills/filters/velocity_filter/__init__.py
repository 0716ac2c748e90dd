"""Limits the acceleration of a tall robot (REFERENCE 6.5).

``velocity_filter`` has one step of it and what runs the steps on a clock; ``node`` is the ROS side.
"""
