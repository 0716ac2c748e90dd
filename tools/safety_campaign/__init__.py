"""Attacks on a running system, to show that stop means stop and that no message ends it."""
