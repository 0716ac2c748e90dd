"""Ticks trees of py_trees faster than py_trees does, with the same outcome; docs/ticking.md explains how."""

from florence_bt.runtime.ticking._table import StatusChange
from florence_bt.runtime.ticking.ticker import Ticker
from florence_bt.runtime.ticking.tree import BehaviourTree

__all__ = ["BehaviourTree", "StatusChange", "Ticker"]
