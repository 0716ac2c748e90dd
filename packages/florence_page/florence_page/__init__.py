"""The page: where the robot is, what it sees and what its mission does, in a browser."""
