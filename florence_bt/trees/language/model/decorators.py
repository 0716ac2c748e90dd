"""Nodes with one node below."""

from __future__ import annotations

from dataclasses import dataclass

from florence_bt.trees.language.model.node import Wrapper
from florence_bt.trees.language.model.values import Literal, Value, show


@dataclass(frozen=True, slots=True, kw_only=True)
class Retry(Wrapper):
    """``retry``: again after a failure."""

    attempts: Value
    on: tuple[Literal, ...] = ()
    attempt_key: Literal | None = None

    @property
    def default_title(self) -> str:
        """Such as ``retry up to 8 times``."""
        return f"retry up to {show(self.attempts)} times"


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeat(Wrapper):
    """``repeat``: again after a success."""

    rounds: Value

    @property
    def default_title(self) -> str:
        """Such as ``repeat 3 times``."""
        return f"repeat {show(self.rounds)} times"


@dataclass(frozen=True, slots=True, kw_only=True)
class Timeout(Wrapper):
    """``timeout``: stopped when it takes too long."""

    duration: Value

    @property
    def default_title(self) -> str:
        """Such as ``within 30 s``."""
        return f"within {show(self.duration)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Delay(Wrapper):
    """``delay``: a pause before the start."""

    duration: Value

    @property
    def default_title(self) -> str:
        """Such as ``after 2 s``."""
        return f"after {show(self.duration)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cooldown(Wrapper):
    """``cooldown``: no new start within a time after a success."""

    duration: Value

    @property
    def default_title(self) -> str:
        """Such as ``at most every 30 s``."""
        return f"at most every {show(self.duration)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Once(Wrapper):
    """``once``: its first result stays."""

    @property
    def default_title(self) -> str:
        """Such as ``once say hello``."""
        return f"once {self.child.title}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Invert(Wrapper):
    """``invert``: success becomes failure and failure success."""

    @property
    def default_title(self) -> str:
        """Such as ``not robot in room``."""
        return f"not {self.child.title}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Succeed(Wrapper):
    """``succeed``: a failure counts as success."""

    @property
    def default_title(self) -> str:
        """Such as ``try say hello``."""
        return f"try {self.child.title}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Force(Wrapper):
    """``force``: always ends one way, whatever becomes of the node below."""

    success: bool

    @property
    def default_title(self) -> str:
        """Such as ``fail after say hello``."""
        return f"{'try' if self.success else 'fail after'} {self.child.title}"
