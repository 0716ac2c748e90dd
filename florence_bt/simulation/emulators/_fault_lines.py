"""Lines of text that make things go wrong with an emulated device: what the devices share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypeAlias

from florence_bt.core.errors import ConfigError, FlorenceError, closest_first

Verb: TypeAlias = Callable[[Sequence[str]], str | None]
"""Takes the words after the first one; gives the answer, nothing for ``ok``."""


class Plug(Protocol):
    """The plug of the device's line."""

    @property
    def plugged(self) -> bool:
        """Whether the line is there."""

    def plug(self) -> None:
        """Put it in."""

    def unplug(self) -> None:
        """Pull it out."""


class FaultLines:
    """Obeys lines of text: the first word says what to do, the others how.

    Attributes:
        ended: Whether ``quit`` was said.
    """

    def __init__(self, verbs: Mapping[str, Verb], plug: Plug, help_text: str) -> None:
        """Take the device's own verbs; ``unplug``, ``plug``, ``help`` and ``quit`` are added.

        Args:
            verbs: By their first word.
            plug: The plug of the device's line.
            help_text: The answer to ``help``.
        """
        self.ended = False
        self._plug = plug
        self._verbs: dict[str, Verb] = {
            **verbs,
            "unplug": lambda _words: plug.unplug(),
            "plug": lambda _words: plug.plug(),
            "help": lambda _words: help_text,
            "quit": self._quit,
        }

    def run(self, line: str) -> str:
        """Obey one line.

        Returns:
            ``ok``, what was asked for, or ``error:`` and what would have worked.
        """
        words = line.split()
        if not words:
            return "ok"
        verb = self._verbs.get(words[0])
        try:
            if verb is None:
                raise ConfigError(
                    f"there is no command {words[0]!r}", valid=closest_first(words[0], self._verbs)
                )
            return verb(words[1:]) or "ok"
        except FlorenceError as error:
            return f"error: {error}"

    def _quit(self, _words: Sequence[str]) -> None:
        self.ended = True


def switch(words: Sequence[str]) -> bool:
    """``on`` or ``off``.

    Raises:
        ConfigError: It is neither.
    """
    if list(words) not in (["on"], ["off"]):
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=("on", "off"))
    return words[0] == "on"


def number(words: Sequence[str], lowest: float, highest: float) -> float:
    """One number.

    Raises:
        ConfigError: It is no number, or out of the range.
    """
    try:
        value = float(words[0]) if len(words) == 1 else None
    except ValueError:
        value = None
    if value is None or not lowest <= value <= highest:
        raise ConfigError(f"a number from {lowest:g} to {highest:g} is needed, not {' '.join(words)!r}")
    return value


def integer(words: Sequence[str], lowest: int, highest: int) -> int:
    """One whole number.

    Raises:
        ConfigError: It is no whole number, or out of the range.
    """
    value = number(words, lowest, highest)
    if value != int(value):
        raise ConfigError(f"a whole number is needed, not {words[0]!r}")
    return int(value)


def some_of(words: Sequence[str], known: Sequence[str] | Mapping[str, int]) -> Sequence[str]:
    """The words, each of them known; ``none`` stands for no word.

    Raises:
        ConfigError: A word is not known, or there is none.
    """
    if list(words) == ["none"]:
        return ()
    wrong = [word for word in words if word not in known]
    if wrong or not words:
        raise ConfigError(f"cannot understand {' '.join(words)!r}", valid=(*known, "none"))
    return words
