"""Simulated runs: the demo, the trials, and the rig that both use."""
