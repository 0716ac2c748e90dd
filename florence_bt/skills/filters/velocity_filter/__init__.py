"""Limits the acceleration of a tall robot (REFERENCE 6.5).

``velocity_filter`` is one step of it, ``ticker`` runs the steps on a clock, ``node`` speaks ROS.
"""
