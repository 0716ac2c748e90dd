"""Data for viewers of a running tree: snapshots, keys, statistics. No ROS in here."""
