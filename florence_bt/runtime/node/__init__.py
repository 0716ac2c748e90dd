"""The mission server on ROS: triggers in; status, tree and run state out. Thin: convert, call the executor.

Names live under ``florence_bt/`` (docs/reference/ros_api.md). One module per group of them; ``_server`` puts
them together. Here, as in every module named ``node``, rclpy and messages may be imported.
"""

from florence_bt.runtime.node._server import MissionNode, MissionNodeParameters

__all__ = ["MissionNode", "MissionNodeParameters"]
