"""The keys of a mission: a plain dictionary per mission call, and the values that refer to it.

A key that was never written is an expected failure of the node that reads it (code ``missing_key``),
not a crash.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from florence_bt.core.errors import FlorenceError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure

_STORABLE = (str, bool, int, float, Pose2)


class MissingKey(FlorenceError):
    """A key was read that nothing has written.

    Attributes:
        key: The key.
        known: The keys that have a value.
    """

    def __init__(self, key: str, known: Mapping[str, Any]) -> None:
        self.key = key
        self.known = tuple(sorted(known))
        has = ", ".join(closest_first(key, known)) or "none at all"
        super().__init__(f"the key {key!r} has no value yet (keys with a value: {has})")

    def as_result(self) -> Result:
        """The failure of the node that read the key."""
        return failure("missing_key", str(self))


class KeyStore:
    """The keys and values of one call of a mission; two calls never share one."""

    def __init__(self, values: Mapping[str, Any] | None = None) -> None:
        self._values: dict[str, Any] = {}
        self.reset(values or {})

    def reset(self, values: Mapping[str, Any]) -> None:
        """Forget everything and begin with these values."""
        self._values.clear()
        for key, value in values.items():
            self.write(key, value)

    def read(self, key: str) -> Any:
        """The value of a key.

        Raises:
            MissingKey: Nothing has written the key.
        """
        try:
            return self._values[key]
        except KeyError:
            raise MissingKey(key, self._values) from None

    def write(self, key: str, value: Any) -> None:
        """Give a key a value.

        Raises:
            TypeError: The value is of none of the types that flow between skills.
        """
        if not isinstance(value, _STORABLE):
            raise TypeError(
                f"the key {key!r} cannot hold {value!r}; text, numbers, booleans and poses can be held"
            )
        self._values[key] = value

    def __contains__(self, key: object) -> bool:
        return key in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def as_dict(self) -> dict[str, Any]:
        """A copy of all keys and values, for dumps and journals."""
        return dict(self._values)


@runtime_checkable
class ValueSource(Protocol):
    """A value that is known only when the mission runs."""

    def resolve(self, keys: KeyStore) -> Any:
        """The value now.

        Raises:
            MissingKey: It needs a key that has no value.
        """


@dataclass(frozen=True, slots=True)
class KeyReference:
    """The value of a key.

    Attributes:
        key: The key's name.
    """

    key: str

    def resolve(self, keys: KeyStore) -> Any:
        """The key's value now."""
        return keys.read(self.key)


@dataclass(frozen=True, slots=True)
class TextTemplate:
    """A text with keys in it.

    Attributes:
        parts: Pieces of text, and the keys whose values stand between them.
    """

    parts: tuple[str | KeyReference, ...]

    def resolve(self, keys: KeyStore) -> str:
        """The text with the values of its keys."""
        return "".join(p if isinstance(p, str) else readable(p.resolve(keys)) for p in self.parts)


@dataclass(frozen=True, slots=True)
class PoseFromParts:
    """A pose that is put together from numbers or keys.

    Attributes:
        x: Metres, or where to find them.
        y: Metres, or where to find them.
        yaw: Radians, or where to find them.
    """

    x: Any
    y: Any
    yaw: Any

    def resolve(self, keys: KeyStore) -> Pose2:
        """The pose in the map frame."""
        x, y, yaw = (float(resolve(part, keys)) for part in (self.x, self.y, self.yaw))
        return Pose2(x, y, yaw)


def resolve(value: Any, keys: KeyStore) -> Any:
    """A literal as it is; a value source as it stands now.

    Raises:
        MissingKey: A key that is needed has no value.
    """
    return value.resolve(keys) if isinstance(value, ValueSource) else value


def readable(value: Any) -> str:
    """A value for people, short and the same every time."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Pose2):
        return f"(x {value.x:.2f} m, y {value.y:.2f} m, yaw {value.yaw:.2f} rad)"
    return str(value)
