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

SERVERS_STATUS = "servers"
"""The part of the mission server's ``diagnostics`` on missing servers; its values: skill -> server."""
