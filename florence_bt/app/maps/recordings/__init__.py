"""Recordings of drives that maps are built from: logs of CARMEN, and bags of ROS."""
