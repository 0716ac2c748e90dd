"""Skill: find the robot in the map from laser scans and odometry (document, section 3.3; REFERENCE 7.7)."""
