"""Skill: give out the static map. Map files in, an occupancy grid out."""
