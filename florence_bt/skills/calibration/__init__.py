"""Calibration of the base's turning: odometry and gyro against a wall (document, section 7.2)."""
