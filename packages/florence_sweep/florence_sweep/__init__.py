"""Missions over hundreds of simulated homes, people, sensors and faults, and what came of them."""
