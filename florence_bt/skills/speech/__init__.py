"""What the robot says to people and what they answer; programs that speak and listen are not part of it."""
