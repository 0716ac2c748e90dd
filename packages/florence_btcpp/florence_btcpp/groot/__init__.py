"""Groot2's monitor protocol: what a running mission does, for Groot2 and other programs that speak it."""
