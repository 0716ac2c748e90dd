"""The simulated home: the flat, its people, the robot in it, and physics."""
