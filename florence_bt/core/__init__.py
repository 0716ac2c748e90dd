"""The vocabulary that every layer shares: geometry, clocks, outcomes, skills and errors.

Nothing here knows ROS, a device or a mission file. Modules that need numpy (``sensing``, ``transforms``)
are imported by name only, so that ``florence check`` starts without it.
"""
