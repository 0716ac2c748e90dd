"""Songs that are played at once, and the tune of ``bonus``: the first line of Beethoven's Ode to Joy."""

from __future__ import annotations

from collections.abc import Sequence

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.turtlebot.codec import commands
from florence_bt.drivers.turtlebot.codec.models import Model

QUARTER, DOTTED, EIGHTH, HALF = 16, 24, 8, 32
"""Durations in 1/64 s."""

NOTES = (
    *((pitch, QUARTER) for pitch in (76, 76, 77, 79, 79, 77, 76, 74, 72, 72, 74, 76)),
    (76, DOTTED),
    (74, EIGHTH),
    (74, HALF),
)
"""Pitches (MIDI) and durations."""
SONG = 0
"""The number by which it is kept: every base has this one."""
LONGEST_NOTE_S = 255 / 64
"""A duration is a byte, in 1/64 s (REFERENCE 1.3)."""


def play_notes(notes: Sequence[int], durations_s: Sequence[float], model: Model) -> bytes:
    """Return the commands that store and play a song; the base must be in Safe or Full mode.

    Args:
        notes: 1 to 16 MIDI numbers, 31 to 127; anything else is a rest.
        durations_s: Seconds, one for each note, 0 to 3.98.
        model: The base.

    Raises:
        ConfigError: There are too many notes, or none, or a duration is missing or out of range.
    """
    if len(notes) != len(durations_s):
        raise ConfigError(
            f"{len(notes)} notes have {len(durations_s)} durations", valid=["one duration for each note"]
        )
    if not all(0.0 <= duration <= LONGEST_NOTE_S for duration in durations_s):
        raise ConfigError("a note is too long, or its duration is not a number", valid=["0 to 3.98 s"])
    pairs = [(note, round(64 * duration)) for note, duration in zip(notes, durations_s, strict=True)]
    return commands.song(SONG, pairs, model) + commands.play_song(SONG, model)


def play_tune(model: Model) -> bytes:
    """Return the commands that store and play it; the base must be in Safe or Full mode."""
    return commands.song(SONG, NOTES, model) + commands.play_song(SONG, model)
