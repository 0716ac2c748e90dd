"""The packages of ROS interfaces: which are installed, what they define, and building further ones."""
