"""Skill: drive to a pose and turn in place (document, sections 3.3 and 3.4; REFERENCE 7).

From the inside out: ``costmap`` (what is in the way), ``planner`` (a path over the map), ``controller`` (the
velocity to command now), ``drive`` (one goal: replanning and recovery), ``navigator`` (goals and turns in
place, one at a time) and ``node`` (the ROS side).
"""
