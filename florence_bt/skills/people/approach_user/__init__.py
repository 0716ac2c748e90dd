"""Proposes where to stand politely in front of a person."""
