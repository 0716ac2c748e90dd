"""Sentences of the robot and people's answers; programs that speak and listen are not part of it."""
