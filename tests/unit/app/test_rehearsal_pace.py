"""A rehearsal on a machine that is too slow for it."""

from __future__ import annotations

import pytest

from florence_bt.app.bringup.rehearsal import TOO_SLOW_ADVICE, RehearsalPace


def told_at(pace, seconds=60):
    """Return the wall seconds at which something is said, of a world that makes so many seconds a second."""
    rehearsal = RehearsalPace()
    said = {wall: rehearsal.look({"time": pace(wall), "monotonic": 100.0 + wall}) for wall in range(seconds)}
    assert rehearsal.look({}) == ""
    assert all(TOO_SLOW_ADVICE in text for text in said.values() if text)
    return [wall for wall, text in said.items() if text]


@pytest.mark.parametrize(
    ("pace", "expected"),
    [
        (lambda wall: wall, 0),
        (lambda wall: 0.5 * wall, 1),
        (lambda wall: wall if wall < 30 else 30 + 0.6 * (wall - 30), 1),
        (lambda wall: wall - (2.0 if 11 <= wall <= 13 else 0.0), 0),  # a delay that is made up for
    ],
)
def test_it_is_said_once_when_the_world_falls_behind(pace, expected):
    assert len(told_at(pace)) == expected
