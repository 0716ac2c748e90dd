"""The time of day, in the time zone of the robot."""
