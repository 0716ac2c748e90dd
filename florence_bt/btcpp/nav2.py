"""Which ports of Nav2's nodes are written, for trees that come without a ``TreeNodesModel``.

Source: the node models of Nav2 (Jazzy), REFERENCE section 7. All other ports of these nodes are read.
"""

from __future__ import annotations

from florence_bt.btcpp.port_models import NodeModel, PortModel
from florence_bt.btcpp.written import Quoted
from florence_bt.core.declaration import Kind

ERROR_PORTS = {"error_code_id": (Kind.INTEGER, "0"), "error_msg": (Kind.TEXT, Quoted(""))}
"""The ports of how an action ended -> kind and value at the start, as Nav2's bt_navigator gives them."""
_ENDS = "error_code_id error_msg"
_CANCELS = ("AssistedTeleop", "BackUp", "ComputeAndTrackRoute", "Control", "DriveOnHeading", "Spin", "Wait")
_ROUTE = "route path"
_TRACK = "last_node_id next_node_id current_edge_id rerouted"
_ACTIONS = {
    **{f"Cancel{what}": "" for what in _CANCELS},
    "AssistedTeleop": _ENDS,
    "BackUp": _ENDS,
    "ClearCostmapAroundPose": "",
    "ClearCostmapAroundRobot": "",
    "ClearCostmapExceptRegion": "",
    "ClearEntireCostmap": "",
    "ComputePathThroughPoses": f"path {_ENDS}",
    "ComputePathToPose": f"path {_ENDS}",
    "ComputeAndTrackRoute": f"execution_time {_ROUTE} {_TRACK} {_ENDS}",
    "ComputeRoute": f"planning_time {_ROUTE} {_ENDS}",
    "ConcatenatePaths": "output_path",
    "ControllerSelector": "selected_controller",
    "DockRobot": f"success num_retries {_ENDS}",
    "DriveOnHeading": _ENDS,
    "FollowPath": f"tracking_feedback {_ENDS}",
    "GetCurrentPose": "current_pose",
    "GetPoseFromPath": "pose",
    "GoalCheckerSelector": "selected_goal_checker",
    "NavigateThroughPoses": _ENDS,
    "NavigateToPose": _ENDS,
    "PlannerSelector": "selected_planner",
    "ProgressCheckerSelector": "selected_progress_checker",
    "ReinitializeGlobalLocalization": "",
    "RemoveInCollisionGoals": "output_goals output_waypoint_statuses",
    "RemovePassedGoals": "output_goals output_waypoint_statuses",
    "SmoothPath": f"smoothed_path smoothing_duration was_completed {_ENDS}",
    "SmootherSelector": "selected_smoother",
    "Spin": _ENDS,
    "TruncatePath": "output_path",
    "TruncatePathLocal": "output_path",
    "UndockRobot": f"success {_ENDS}",
    "Wait": _ENDS,
}
"""Action -> the ports that it writes."""
_CONDITIONS = frozenset(
    {
        "AreErrorCodesPresent",
        "ArePosesNear",
        "DistanceTraveled",
        "GlobalUpdatedGoal",
        "GoalReached",
        "GoalUpdated",
        "InitialPoseReceived",
        "IsBatteryCharging",
        "IsBatteryLow",
        "IsPathValid",
        "IsStopped",
        "IsStuck",
        "PathExpiringTimer",
        "TimeExpired",
        "TransformAvailable",
        "WouldAControllerRecoveryHelp",
        "WouldAPlannerRecoveryHelp",
        "WouldARouteRecoveryHelp",
        "WouldASmootherRecoveryHelp",
    }
)
_DECORATORS = {
    "DistanceController": "",
    "GoalUpdatedController": "",
    "GoalUpdater": "output_goal output_goals",
    "PathLongerOnApproach": "",
    "RateController": "",
    "SingleTrigger": "",
    "SpeedController": "",
}
_KINDS = {
    "goal": Kind.POSE,
    "start": Kind.POSE,
    "pose": Kind.POSE,
    "current_pose": Kind.POSE,
    "ref_pose": Kind.POSE,
    "target_pose": Kind.POSE,
    "rerouted": Kind.BOOLEAN,
    "input_goal": Kind.POSE,
    "output_goal": Kind.POSE,
    "error_code_id": Kind.INTEGER,
    "error_msg": Kind.TEXT,
    "was_completed": Kind.BOOLEAN,
    "success": Kind.BOOLEAN,
    "num_retries": Kind.INTEGER,
}
"""Port -> the kind of its values, where the name leaves no doubt."""


class Nav2Models:
    """Nav2's nodes; a port that is not among those written is read."""

    def find(self, name: str) -> NodeModel | None:
        """The model of a node with the ports that it writes, None when it is no node of Nav2."""
        if name in _ACTIONS:
            return NodeModel(name, "Action", _written(_ACTIONS[name]))
        if name in _DECORATORS:
            return NodeModel(name, "Decorator", _written(_DECORATORS[name]))
        return NodeModel(name, "Condition") if name in _CONDITIONS else None

    def port(self, model: NodeModel, port: str) -> PortModel:
        """A port of one of Nav2's nodes."""
        return model.ports.get(port) or PortModel("in", _KINDS.get(port))


def _written(ports: str) -> dict[str, PortModel]:
    return {port: PortModel("out", _KINDS.get(port)) for port in ports.split()}
