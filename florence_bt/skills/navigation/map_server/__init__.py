"""Skill: publish the static map. Map files in, an occupancy grid out."""
