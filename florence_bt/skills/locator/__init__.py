"""Knows the rooms, the hotspots and where the robot and the user are (the Florence Locator)."""
