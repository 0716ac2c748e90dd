"""The parts of following somebody: the track of the person, and what the robot does about it."""
