"""The application with all its verbs: one module per group of verbs; importing it adds them."""

from __future__ import annotations

from florence_bt.cli import (
    exploring,
    interfaces,
    maps,
    missions,
    places,
    recording,
    replaying,
    robot,
    runs,
    skills,
    system,
    testing,
    verifying,
)
from florence_bt.cli.common import app

__all__ = [
    "app",
    "exploring",
    "interfaces",
    "maps",
    "missions",
    "places",
    "recording",
    "replaying",
    "robot",
    "runs",
    "skills",
    "system",
    "testing",
    "verifying",
]
