"""The steps of tools/setup.py. Standard library only."""
