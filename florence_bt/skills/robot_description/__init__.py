"""Places of the robot's parts (document, section 3.2).

``description`` loads the xacro file, ``frames`` finds the frames in it, ``footprint`` is the outline on the
floor, ``room`` what it needs to move, ``node`` is the ROS side.
"""
