"""The actions that drive the robot, as one table."""
