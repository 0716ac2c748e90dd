"""The TurtleBot's base, an iRobot Create with a gyro: codec, motion, state machine and node.

Everything but ``node`` is free of ROS, ports, threads and clocks: it is given bytes, numbers and the time.
"""
