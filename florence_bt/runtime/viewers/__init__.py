"""What viewers of a running tree are sent: snapshots, keys, statistics. No ROS in here."""
