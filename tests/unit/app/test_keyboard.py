from __future__ import annotations

import os
import sys

import pytest

from florence_bt.app.runs.keyboard import Keyboard, in_front, keys_in


@pytest.mark.parametrize(
    ("pressed", "keys"),
    [
        ("aA/ ", ["a", "A", "/", " "]),
        ("\x1b[A\x1bOB\x1b[5~", ["up", "down", "page up"]),
        ("\x1b[C\x1bOD", ["right", "left"]),
        ("\x1b", ["escape"]),
        ("\r\x7f", ["enter", "backspace"]),
        ("ü", ["ü"]),
        ("\x1b[1;5C\x1b[200~\x00\x1aq", ["q"]),
        ("", []),
    ],
)
def test_what_was_pressed(pressed, keys):
    assert keys_in(pressed) == keys


def test_without_a_terminal_there_are_no_keys(monkeypatch):
    end, other = os.pipe()
    with os.fdopen(end) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        assert not in_front()
        with Keyboard() as keyboard:
            os.write(other, b"q")
            assert keyboard.read(end, 0.0) == []
    os.close(other)
