"""Driving by hand: ``florence teleop``, with the keys of a terminal or with a gamepad."""
