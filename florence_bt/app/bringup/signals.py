"""Ctrl-C and similar signals while the system starts, runs and ends: nothing is left half done.

Python runs signal handlers in the main thread only; on other threads all of this does nothing.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FrameType
from typing import Any

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, a plain ``kill``, and a terminal that was closed."""
AGAIN_AFTER_S = 0.05
"""Time after which a signal comes again whose exception was lost."""
_onces: list[list[int]] = []
"""For each block of :func:`once`, the outermost first, the signal that interrupted it."""


@contextmanager
def as_keyboard_interrupt() -> Iterator[None]:
    """Let every signal that asks for the end raise KeyboardInterrupt; one that is ignored stays so.

    Where Python lets no exception out (callbacks of weak references, as imports have them, and ``__del__``)
    it comes a moment later.
    """
    came: list[int] = []
    report_lost = sys.unraisablehook

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _onces and _onces[-1]:
            return  # the end has begun
        for block in (came, *_onces[-1:]):
            block.append(number)
        raise KeyboardInterrupt

    def come_again(lost: Any) -> None:
        if came and lost.exc_type is KeyboardInterrupt:
            for block in _onces[-1:]:
                block.clear()
            later = threading.Timer(AGAIN_AFTER_S, os.kill, (os.getpid(), came[-1]))
            later.daemon = True
            later.start()
        else:
            report_lost(lost)

    with _handlers({number: interrupt for number in ENDING if not _is_ignored(number)}):
        sys.unraisablehook = come_again
        try:
            yield
        finally:
            sys.unraisablehook = report_lost


@contextmanager
def once() -> Iterator[None]:
    """Let one signal interrupt the block (within :func:`as_keyboard_interrupt`); later ones change nothing.

    For what must be taken down when it is interrupted: people press Ctrl-C again before that has begun.
    """
    _onces.append([])
    try:
        yield
    finally:
        _onces.pop()


@contextmanager
def ignored() -> Iterator[None]:
    """Ignore the signals for a while."""
    with _handlers(dict.fromkeys(ENDING, signal.SIG_IGN)):
        yield


@contextmanager
def held_back() -> Iterator[Callable[[], bool]]:
    """Deliver the signals only when the block is over.

    Needed where an exception must not break in: between the start of a process and the note of it, and in
    callbacks that C++ code calls, which would end the process.

    Yields:
        A function that says whether a signal came.
    """
    came: list[int] = []
    try:
        with _handlers({number: lambda n, _: came.append(n) for number in ENDING if not _is_ignored(number)}):
            yield lambda: bool(came)
    finally:
        if came:
            signal.raise_signal(came[0])


@contextmanager
def _handlers(wanted: Mapping[signal.Signals, Any]) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, handler) for number, handler in wanted.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _is_ignored(number: signal.Signals) -> bool:
    return signal.getsignal(number) is signal.SIG_IGN
