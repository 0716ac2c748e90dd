"""Names of topics, services and diagnostics that several nodes must agree on."""

from __future__ import annotations

SWITCH_OVERRIDE = "florenceLocator/manualOverride"
"""``std_msgs/Bool``: switches the manual override (REFERENCE 11.1, table 11); the base's driver listens."""

OVERRIDE_BY = "manual_override_by"
"""``std_msgs/String``: who is about to switch the manual override, for the journal. Nobody need say it."""

MANUAL_OVERRIDE = "manual_override"
"""``std_msgs/Bool``, latched: whether the manual override is on. The base's driver says so; all others read
it."""

OVERRIDE_STATE = "manual_override_state"
"""``florence_interfaces/ManualOverride``, latched, twice a second: how the override and the base stand, as
its driver knows it; for people, and for those who hung or were not there when it was on and released."""

RELEASE_OVERRIDE = "release_manual_override"
"""``florence_interfaces/ReleaseOverride``: the base's driver ends the override for somebody who knows how it
stands, and not when somebody has stopped the robot since."""

INITIAL_POSE = "initialpose"
"""``geometry_msgs/PoseWithCovarianceStamped``: somebody says where the robot is in the map (as RViz does)."""

DOCK = "turtlebot_node/dock"
"""``std_srvs/SetBool``: the base drives to its dock by itself, or ends that."""

USER_SEEN = "home_sensors/user_seen"
"""``florence_interfaces/UserSeen``, latched: the room of the user by the home sensors."""

ANSWER = "answer"
"""``std_msgs/String``: what somebody answers to the robot: the name of a button, or words."""

HOTSPOTS = "hotspots"
"""``visualization_msgs/MarkerArray``, latched: the rooms and objects of the locator."""

ZONES = "zones"
"""``florence_interfaces/Zones``, latched: where the robot does not drive, or drives slowly."""

SERVERS_STATUS = "servers"
"""The part of the mission server's ``diagnostics`` on missing servers; its values: skill -> server."""

DIAGNOSTICS = "diagnostics"
"""``diagnostic_msgs/DiagnosticArray``, latched: how each part of a node does; see :data:`SERVERS_STATUS` and
the other names of parts."""

BATTERY_STATE = "battery_state"
"""``sensor_msgs/BatteryState``, latched, once a second: the charge of the base."""

RUN_STATE = "florence_bt/run_state"
"""``florence_interfaces/RunState``, latched: the run of a mission that goes on, or the last one."""

STOP_REASON = "turtlebot_node/stop_reason"
"""``florence_interfaces/StopReason``, latched: what holds the base."""

ODOMETRY = "odom"
"""``nav_msgs/Odometry``: where the base believes to be since it began, and how fast it is."""

TRACKED_USERS = "filtered_tracked_users"
"""``florence_interfaces/TrackedUsers``, five times a second while it runs: the people in view."""

PLACE_STATUS = "Place in the map"
"""The part of the localiser's and of the mapping's ``diagnostics`` on where the robot is."""

LATENESS = "lateness"
"""The part of the ``diagnostics`` of a node whose process falls behind."""

REFUSALS, FAILURES = "messages", "callbacks"
"""The parts of the ``diagnostics`` of a node that refuses messages, and of one whose callbacks fail."""

SCAN_FIT, DEVIATION_M, DEVIATION_DEG = (
    "part of the scan that fits the map",
    "standard deviation, metres",
    "standard deviation, degrees",
)
"""What the localiser's :data:`PLACE_STATUS` has values of."""

AREA_M2, WAY_M, LOOPS = "m2", "m", "loops"
"""What the mapping's :data:`PLACE_STATUS` has values of: floor seen, way driven, places recognised."""

SUPERVISOR = "florence_up"
"""The node name before each part of the ``diagnostics`` of ``florence up`` on its processes."""

NAVIGATE_TO_POSE, NAVIGATE_THROUGH_POSES = "navigate_to_pose", "navigate_through_poses"
"""The actions of Nav2 (and of Florence's navigation) that drive."""
