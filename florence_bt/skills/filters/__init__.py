"""Filters between sensors, navigation and the base (document, sections 3.5 to 3.7)."""
