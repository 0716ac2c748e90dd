"""The errors of Florence. Each carries its data, and its message says what would have worked.

Expected failures of a skill are values (:class:`florence_bt.core.outcome.Result`); exceptions are for
wrong configuration, broken protocols, lost devices and bugs.
"""

from __future__ import annotations

import difflib
import re
from bisect import bisect
from collections.abc import Iterable
from pathlib import Path

_BETWEEN_WORDS = re.compile(r"[\s_-]+")
MAX_COMPARED = 200
"""With how many names a wrong one is compared; of more, those beside it in alphabetical order."""


class FlorenceError(Exception):
    """Base class of every error that Florence raises on purpose."""


class ConfigError(FlorenceError):
    """A file or a parameter that a person wrote is wrong.

    Attributes:
        problem: What is wrong, in one sentence.
        file: The file, or None when the value came from elsewhere (a service call, the command line).
        line: 1-based line, or None.
        column: 1-based column, or None.
        valid: What would have worked, most likely first.
        parameters: The names of the parameters that are wrong, where it is about parameters.
        mistakes: The error itself, or those that :func:`raise_all` made it of.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: str | Path | None = None,
        line: int | None = None,
        column: int | None = None,
        valid: Iterable[str] = (),
        parameters: Iterable[str] = (),
    ) -> None:
        self.problem = problem
        self.parameters = tuple(parameters)
        self.file = str(file) if file is not None else None
        self.line = line
        self.column = column
        self.valid = tuple(valid)
        self.mistakes: tuple[ConfigError, ...] = (self,)
        super().__init__(str(self))

    def __str__(self) -> str:
        """Format as ``file:line:column: problem (would have worked: ...)``."""
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part is not None)
        text = f"{place}: {self.problem}" if place else self.problem
        return f"{text} (would have worked: {', '.join(self.valid)})" if self.valid else text


def raise_all(wrong: Iterable[ConfigError]) -> None:
    """Raise everything that is wrong with an input at once; nothing when nothing is.

    Args:
        wrong: The errors, in the order in which people are to read them.

    Raises:
        ConfigError: The only one, or one whose message has a line for each.
    """
    mistakes = tuple(mistake for error in wrong for mistake in error.mistakes)
    if not mistakes:
        return
    if len(mistakes) == 1:
        raise mistakes[0]
    names = dict.fromkeys(name for mistake in mistakes for name in mistake.parameters)
    told = "\n".join([f"{len(mistakes)} mistakes:", *map(str, mistakes)])
    error = ConfigError(told, parameters=names)
    error.mistakes = mistakes
    raise error


class SimulationError(FlorenceError):
    """The simulated world has come into a state that cannot be."""


class ProtocolError(FlorenceError):
    """Bytes from a device do not follow its protocol."""


class FrameError(ProtocolError):
    """A frame has the wrong length, header or layout."""


class ChecksumError(ProtocolError):
    """A frame's checksum does not fit its bytes."""


class DeviceError(FlorenceError):
    """A device does not work as it should."""


class DeviceLost(DeviceError):
    """The device went away: its port vanished or was closed by the peer."""


class DeviceTimeout(DeviceError, TimeoutError):
    """The device did not answer in time."""


class CommandRejected(DeviceError):
    """The device answered that it will not do what was asked.

    Attributes:
        command: The command as sent.
        status: The device's own status text or code.
    """

    def __init__(self, command: str, status: str, explanation: str = "") -> None:
        self.command = command
        self.status = status
        super().__init__(
            f"{command!r} was refused with status {status!r}" + (f": {explanation}" if explanation else "")
        )


def closest_first(wanted: str, names: Iterable[str]) -> tuple[str, ...]:
    """Order the names that exist, those that look like ``wanted`` first.

    Args:
        wanted: The name that was not found.
        names: All names that exist.

    Returns:
        The close matches, best first, or all names (at most :data:`MAX_COMPARED`) when none is close: those
        that share a word with ``wanted``, then the others in alphabetical order. A name of several words is
        close when it has all the words that were wanted: ``front_door`` for ``door``. One that differs in
        capitals and in the signs between words alone is the only one: ``look_for_user`` for ``lookForUser``.
    """
    known = _neighbours(wanted, names)
    alike = tuple(name for name in known if spelling(name) == spelling(wanted))
    if alike:
        return alike
    close = difflib.get_close_matches(wanted, known, n=3, cutoff=0.6)
    words = _words(wanted)
    longer = [name for name in known if words <= _words(name)] if len(wanted) > 2 else []
    closest = difflib.get_close_matches(wanted, close, n=3, cutoff=0.8)
    sharing = [name for name in known if any(len(word) > 2 for word in words & _words(name))]
    return tuple(dict.fromkeys((*closest, *longer, *close)))[:3] or tuple(dict.fromkeys((*sharing, *known)))


def spelling(name: str) -> str:
    """Strip a name of what people write differently: capitals, and what stands between its words."""
    return _BETWEEN_WORDS.sub("", name).lower()


def close_matches(wanted: str, names: Iterable[str]) -> list[str]:
    """Return the names that look like ``wanted``, best first, at most three."""
    return difflib.get_close_matches(wanted, _neighbours(wanted, names), n=3)


def _neighbours(wanted: str, names: Iterable[str]) -> list[str]:
    """Return at most :data:`MAX_COMPARED` names, in alphabetical order: a comparison is slow."""
    known = sorted(names)
    first = max(0, bisect(known, wanted.lower()) - MAX_COMPARED // 2) if len(known) > MAX_COMPARED else 0
    return known[first : first + MAX_COMPARED]


def _words(name: str) -> set[str]:
    return set(name.lower().replace("-", "_").replace(" ", "_").split("_"))
