"""The application with all its verbs: one module per group of verbs; importing it adds them."""

from __future__ import annotations

from florence_bt.cli import draw, exchange, journal, kinect, missions, robot, runs, schema, system, testing
from florence_bt.cli._common import app

__all__ = [
    "app",
    "draw",
    "exchange",
    "journal",
    "kinect",
    "missions",
    "robot",
    "runs",
    "schema",
    "system",
    "testing",
]
