"""Florence: missions for home robots, written as behaviour trees in YAML and run on ROS 2."""

__version__ = "0.2.0"
