"""Ticks trees of py_trees faster than py_trees does, with the same outcome; see docs/notes/ticking.md."""

from florence_bt.behaviours.ticking.ticker import StatusChange, Ticker

__all__ = ["StatusChange", "Ticker"]
