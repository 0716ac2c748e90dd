"""Candidates for legs of people in a laser scan: no ROS, no memory."""
