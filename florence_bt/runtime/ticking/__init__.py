"""Ticks trees of py_trees faster than py_trees does, with the same outcome; docs/ticking.md tells how."""

from florence_bt.runtime.ticking._table import Changes, StatusChange
from florence_bt.runtime.ticking.ticker import Ticker
from florence_bt.runtime.ticking.tree import BehaviourTree

__all__ = ["BehaviourTree", "Changes", "StatusChange", "Ticker"]
