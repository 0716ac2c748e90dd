"""Localisation, driving and the map (document, sections 3.2 to 3.4)."""
