"""Sensors of the house say in which room the user is: motion detectors, door contacts, switches, TVs."""
