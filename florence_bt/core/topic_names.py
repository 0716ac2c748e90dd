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

HOME_EVENT = "home_sensors/event"
"""``florence_interfaces/HomeEvent``: what a sensor of the home reports."""

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
"""Names of the values in the localiser's :data:`PLACE_STATUS`."""

AREA_M2, WAY_M, LOOPS = "m2", "m", "loops"
"""Names of the values in the mapping's :data:`PLACE_STATUS`: floor seen, way driven, places recognised."""

SUPERVISOR = "florence_up"
"""The node of ``florence up``, and the name before each part of its ``diagnostics`` on its processes."""
PROCESS = "process "
"""Stands before the name of the process in such a part."""

NAVIGATE_TO_POSE, NAVIGATE_THROUGH_POSES = "navigate_to_pose", "navigate_through_poses"
"""The actions of Nav2 (and of Florence's navigation) that drive."""

CLOCK = "/clock"
"""``rosgraph_msgs/Clock``: the time of a simulation; it is the same for all namespaces."""

MAP = "map"
"""``nav_msgs/OccupancyGrid``, latched: the map of the home."""

AMCL_POSE = "amcl_pose"
"""``geometry_msgs/PoseWithCovarianceStamped``, latched: where the robot is in the map."""

PARTICLE_CLOUD = "particle_cloud"
"""``geometry_msgs/PoseArray``: where the localiser takes it for possible that the robot is."""

SCAN = "scan"
"""``sensor_msgs/LaserScan``: what the laser scanner measures."""

ECHOES = "echoes"
"""``sensor_msgs/MultiEchoLaserScan``: the same with several echoes a beam."""

KINECT_SCAN = "kinect_scan"
"""``sensor_msgs/LaserScan``: what the Kinect's depth image shows at the laser's height."""

KINECT_LOW_SCAN = "kinect_low_scan"
"""``sensor_msgs/LaserScan``: what it shows below that height."""

KINECT_OVERHANG_SCAN = "kinect_overhang_scan"
"""``sensor_msgs/LaserScan``: what it shows above, as high as the robot."""

SCAN_COMBINED = "scan_combined"
"""``sensor_msgs/LaserScan``: laser scanner and Kinect in one."""

FILTERED_SCAN = "filtered_scan"
"""``sensor_msgs/LaserScan``: :data:`SCAN_COMBINED` without the robot itself."""

PEOPLE_SCAN = "people_scan"
"""``sensor_msgs/LaserScan``: where the camera sees people, as a scan."""

DEPTH_IMAGE = "camera/depth/image"
"""``sensor_msgs/Image``: the depths in metres."""

RAW_DEPTH_IMAGE = "camera/depth/image_raw"
"""``sensor_msgs/Image``: the depths in millimetres."""

DEPTH_POINTS = "camera/depth/points"
"""``sensor_msgs/PointCloud2``: the depths as points."""

DEPTH_CAMERA_INFO = "camera/depth/camera_info"
"""``sensor_msgs/CameraInfo`` of the depths."""

COLOUR_IMAGE = "camera/rgb/image_color"
"""``sensor_msgs/Image``: the camera's picture."""

COLOUR_CAMERA_INFO = "camera/rgb/camera_info"
"""``sensor_msgs/CameraInfo`` of the picture."""

IMU = "imu/data"
"""``sensor_msgs/Imu``: the gyro's rate, without its offset."""

RAW_IMU = "imu/raw"
"""``sensor_msgs/Imu``: the gyro's rate as it is measured."""

JOINT_STATES = "joint_states"
"""``sensor_msgs/JointState``: the wheels and the Kinect's tilt."""

SENSOR_STATE = "turtlebot_node/sensor_state"
"""``turtlebot_msgs/TurtlebotSensorState``: what the base measures."""

ROBOT_DESCRIPTION = "robot_description"
"""``std_msgs/String``, latched: the robot's URDF."""

CMD_VEL = "cmd_vel"
"""``geometry_msgs/Twist``: how programs want the base to drive."""

MANUAL_CMD_VEL = "manual_cmd_vel"
"""``geometry_msgs/Twist``: how a person wants it to drive during the override."""

FILTERED_CMD_VEL = "filtered_cmd_vel"
"""``geometry_msgs/Twist``: :data:`CMD_VEL` behind the velocity filter."""

JOY = "joy"
"""``sensor_msgs/Joy``: a gamepad."""

PLAN = "plan"
"""``nav_msgs/Path``: the way of a drive; empty when it is over."""

CURRENT_GOAL = "navigate/current_goal"
"""``geometry_msgs/PoseStamped``, latched: where to; no frame when nowhere."""

GOAL_POSE = "goal_pose"
"""``geometry_msgs/PoseStamped``: somebody wants the robot to drive there (as RViz does)."""

GLOBAL_COSTMAP = "global_costmap/costmap"
"""``nav_msgs/OccupancyGrid``, latched: the planner's costs."""

LOCAL_COSTMAP = "local_costmap/costmap"
"""``nav_msgs/OccupancyGrid``, latched: the costs around the robot."""

ALL_TRACKED_USERS = "tracked_users"
"""``florence_interfaces/TrackedUsers``: everybody who is followed, also out of view."""

USER_LYING = "user_lying"
"""``std_msgs/Bool``: whether the user lies."""

USER_MARKERS = "user_markers"
"""``visualization_msgs/MarkerArray``: people, for viewers."""

DETECTED_USER = "detected_user"
"""``florence_interfaces/DetectedUser``: where a user was found."""

APPROACH_STATUS = "approach_user/status"
"""``std_msgs/String``: what the approach does."""

TREE = "florence_bt/tree"
"""``std_msgs/String``, latched: the tree of the run as text."""

RUN_TREE = "florence_bt/run_tree"
"""``florence_interfaces/RunTree``, latched: the run with the nodes of its tree, for those who show it."""

SNAPSHOTS = "florence_bt/snapshots"
"""``py_trees_ros_interfaces/BehaviourTree``, latched: the tree of the run for viewers."""

SAY = "say"
"""``std_msgs/String``: each sentence that the robot begins to say."""

SPEAKING = "speaking"
"""``std_msgs/String``, latched: the sentence that is being said; empty when none is."""

SIMULATOR_TRUTH = "simulator/truth"
"""``std_msgs/String``, latched: what is really so in a simulation, as JSON."""

FILTERED_KINECT_SCAN, FILTERED_KINECT_LOW_SCAN, FILTERED_KINECT_OVERHANG_SCAN, FILTERED_LASER_SCAN = (
    "filtered_kinect_scan",
    "filtered_kinect_low_scan",
    "filtered_kinect_overhang_scan",
    "filtered_laser_scan",
)
"""``sensor_msgs/LaserScan``: the single scans, without the robot itself."""
