"""The command ``florence``. Every verb loads only what it needs: ``check`` and ``draw`` work without ROS.

One module per group of verbs; importing it adds its verbs to the application.
"""

from __future__ import annotations

from florence_bt.cli import draw, exchange, journal, kinect, missions, robot, runs, schema, system, testing
from florence_bt.cli._common import FAILED, INTERRUPTED, NOT_THERE, OK, USAGE, app

__all__ = [
    "FAILED",
    "INTERRUPTED",
    "NOT_THERE",
    "OK",
    "USAGE",
    "app",
    "draw",
    "exchange",
    "journal",
    "kinect",
    "main",
    "missions",
    "robot",
    "runs",
    "schema",
    "system",
    "testing",
]


def main() -> None:
    """Entry point of the command."""
    app(prog_name="florence", standalone_mode=True)
