"""Trains the network that finds people in depth pictures."""
