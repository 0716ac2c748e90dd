"""Logs that nobody outside can fill: so many lines a minute, each of one line, none with a traceback."""

from __future__ import annotations

import logging
import math
import re
import sys
import time
import traceback
from collections.abc import Callable

MOST_LINES, LINES_S = 20, 60.0
"""So many lines of what others cause are written in so many seconds; how many more there were is told
after."""
LONGEST_LINE = 400
"""Characters of a line."""
SAID = LONGEST_LINE // 2
"""Characters of an error's own words: the rest of the line is for its place."""
_FRAMES = 3
"""So many places of an error are named, the innermost last."""
_NOT_PRINTED = re.compile(r"[^\x20-\x7e\u00a0-\u200a\u2010-\u2027\u2030-\ud7ff\ue000-\ufefe\uff00-\ufffd]+")

LOGGERS = ("uvicorn", "nicegui", "engineio", "socketio", "websockets", "asyncio", "florence_bt.guard")
"""Those that speak about what comes from outside, with all below them."""


def one_line(text: str) -> str:
    """Bring what somebody else may have written into one line that can be printed."""
    line = _NOT_PRINTED.sub(" ", text).strip()
    return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 1]}…"


def told(error: BaseException) -> str:
    """Tell an error in one line: what it is, and where it came from."""
    frames = traceback.extract_tb(error.__traceback__)[-_FRAMES:]
    places = " > ".join(f"{each.filename.rpartition('/')[2]}:{each.lineno} {each.name}" for each in frames)
    return f"{type(error).__name__}: {str(error)[:SAID]} ({places or 'no place'})"


class Seldom:
    """Passes on so many lines in a span of time; of the others, how many there were.

    Args:
        say: Takes a line.
        now: Gives the seconds of a clock that only goes forward.
    """

    def __init__(self, say: Callable[[str], object], now: Callable[[], float] = time.monotonic) -> None:
        self._say = say
        self._now = now
        self._end = -math.inf
        self._count = 0

    def __call__(self, text: str) -> None:
        """Say a line, if there is room for it."""
        now = self._now()
        if now >= self._end:
            more = self._count - MOST_LINES
            self._end = now + LINES_S
            self._count = 0
            if more > 0:
                self._say(f"{more} more lines like these were left out")
        self._count += 1
        if self._count <= MOST_LINES:
            self._say(one_line(text))


class BoundedHandler(logging.Handler):
    """Writes to the standard error what a library logs about what comes from outside."""

    def __init__(self, say: Callable[[str], object] | None = None) -> None:
        super().__init__(logging.WARNING)
        self._seldom = Seldom(say or (lambda line: print(line, file=sys.stderr, flush=True)))

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record in one line, or count it."""
        text = record.getMessage()
        if record.exc_info and record.exc_info[1] is not None:
            text = f"{one_line(text)[:SAID]}: {told(record.exc_info[1])}"
        self._seldom(f"{record.name}: {text}")


def bound_logs() -> None:
    """Let each of :data:`LOGGERS` write no more than :class:`BoundedHandler` does."""
    known = [name for name in logging.root.manager.loggerDict if isinstance(name, str)]
    for top in LOGGERS:
        handler = BoundedHandler()
        for name in {top, *(each for each in known if each.startswith(f"{top}."))}:
            logger = logging.getLogger(name)
            logger.handlers = [handler] if name == top else []
            logger.propagate = name != top
            logger.setLevel(logging.WARNING)
