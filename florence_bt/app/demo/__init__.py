"""Simulated runs: the demo, and the rig of the package's own flat."""
