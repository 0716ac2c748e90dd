"""The tune of the parameter ``bonus``: the first line of Beethoven's Ode to Joy."""

from __future__ import annotations

from florence_bt.drivers.turtlebot import codec
from florence_bt.drivers.turtlebot.codec.models import Model

QUARTER, DOTTED, EIGHTH, HALF = 16, 24, 8, 32
"""Durations in 1/64 s."""

NOTES = (
    *((pitch, QUARTER) for pitch in (76, 76, 77, 79, 79, 77, 76, 74, 72, 72, 74, 76)),
    (76, DOTTED),
    (74, EIGHTH),
    (74, HALF),
)
SONG = 0


def play_tune(model: Model) -> bytes:
    """The commands that store and play it; the base must be in Safe or Full mode."""
    return codec.song(SONG, NOTES, model) + codec.play_song(SONG, model)
