"""The keys of a mission: a plain dictionary per mission call, and the values that refer to it.

A key that was never written is an expected failure of the node that reads it (code ``missing_key``),
not a crash.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from florence_bt.core.declaration import SHOWN_UNITS, Kind, Port, quantity_text
from florence_bt.core.errors import FlorenceError, closest_first
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result, failure
from florence_bt.core.units import unit_size

_STORABLE = (str, bool, int, float, Pose2)
_UNIT = re.compile(
    r" ?(?:[cmk]?m|c?m/s|km/h|m?s|min|h|deg|rad|°"
    r"|(?:centi|kilo)?met(?:er|re)s?|seconds?|minutes?|hours?|degrees?)(?!\w)"
)
"""A unit that an author may have written behind a value."""
HIDDEN = "_"
"""First letter of a key that no author has written, and none can write: nobody is offered it."""
NOTHING = object()
"""Stands for the value of a key that has none."""


class ValueProblem(FlorenceError):
    """A value cannot be had, or not be kept: an expected failure of the node that wanted it."""

    code = "bad_input"
    """The code of the failure."""

    def as_result(self) -> Result:
        """Return the failure of the node that wanted the value."""
        return failure(self.code, str(self))


class MissingKey(ValueProblem):
    """A key was read that nothing has written.

    Attributes:
        key: The key.
        known: The keys that have a value.
    """

    code = "missing_key"

    def __init__(self, key: str, known: Mapping[str, Any]) -> None:
        self.key = key
        self.known = tuple(sorted(name for name in known if not name.startswith(HIDDEN)))
        has = ", ".join(closest_first(key, self.known)) if self.known else "none at all"
        super().__init__(f"the key {key!r} has no value yet (keys with a value: {has})")


class WrongValue(ValueProblem):
    """A key was given what its declaration does not allow.

    Attributes:
        key: The key.
    """

    code = "bad_output"

    def __init__(self, key: str, problem: str) -> None:
        self.key = key
        super().__init__(f"the key {key!r} cannot hold this: {problem}")


Watcher = Callable[[str], None]
"""Called with the name of the key that changed."""


class KeyStore:
    """The keys and values of one call of a mission; two calls never share one."""

    def __init__(self, values: Mapping[str, Any] | None = None) -> None:
        self._values: dict[str, Any] = {}
        self._declared: Mapping[str, Port] = {}
        self._kinds: Callable[[], Mapping[str, Kind]] | None = None
        self._watchers: dict[str, tuple[Watcher, ...]] = {}
        self.reset(values or {})

    def declare(
        self, ports: Mapping[str, Port], kinds: Callable[[], Mapping[str, Kind]] | None = None
    ) -> None:
        """Say what some keys hold.

        Args:
            ports: What each declared key holds; a default is its value after every reset.
            kinds: Gives the kinds of all keys, as far as they are known; called when a value is shown.
        """
        self._declared = dict(ports)
        self._kinds = kinds

    def shown(self, key: str, value: Any, unit: str = "") -> str:
        """Return a value for people, with the unit of the key that holds it.

        Args:
            key: The key.
            value: Its value.
            unit: A unit that is written behind the value: then it is the number of them alone.
        """
        kind = self._kinds().get(key) if self._kinds is not None else None
        if not unit or isinstance(value, bool) or not isinstance(value, (int, float)):
            return readable(value, kind)
        size = unit_size(unit, kind) if kind is not None else None
        return readable(value / size if size is not None else value)

    def reset(self, values: Mapping[str, Any]) -> None:
        """Forget everything and begin with these values, and with the defaults of declared keys."""
        defaults = {key: port.default for key, port in self._declared.items() if not port.required}
        values = {**defaults, **values}
        for key, value in values.items():
            _check_storable(key, value)
        before, self._values = self._values, dict(values)
        for key in tuple(self._watchers):
            self._notify(key, before.get(key, NOTHING), values.get(key, NOTHING))

    def watch(self, keys: Iterable[str], callback: Watcher) -> Callable[[], None]:
        """Call back with the name of a key whenever its value has changed, was first written or is gone.

        Writing the value that a key has already is not a change. The callback comes inside ``write`` or
        ``reset``, after the value was stored; it should only take a note.

        Args:
            keys: What is watched; names that nothing has written yet too.
            callback: Takes the name of the key.

        Returns:
            A function that ends the watch.
        """
        names = tuple(dict.fromkeys(keys))
        for key in names:
            self._watchers[key] = (*self._watchers.get(key, ()), callback)

        def end() -> None:
            nonlocal names
            for key in names:
                left = list(self._watchers[key])
                left.remove(callback)
                self._watchers[key] = tuple(left)
                if not left:
                    del self._watchers[key]
            names = ()

        return end

    def peek(self, keys: Iterable[str]) -> tuple[Any, ...]:
        """Return the values of some keys, :data:`NOTHING` where a key has none."""
        get = self._values.get
        return tuple([get(key, NOTHING) for key in keys])

    def read(self, key: str) -> Any:
        """Return the value of a key.

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
            WrongValue: The key is declared to hold something else.
        """
        _check_storable(key, value)
        self.check(key, value)
        old = self._values.get(key, NOTHING) if key in self._watchers else value
        self._values[key] = value
        self._notify(key, old, value)

    def check(self, key: str, value: Any) -> None:
        """See whether a key may be given a value, without giving it.

        Raises:
            WrongValue: The key is declared to hold something else.
        """
        port = self._declared.get(key)
        problem = port.problem_with(value) if port is not None else None
        if problem:
            raise WrongValue(key, problem)

    def is_own(self, key: str) -> bool:
        """Tell whether a part of the mission has a key for itself: these are the keys of all."""
        return False

    def _notify(self, key: str, old: Any, new: Any) -> None:
        # 1, 1.0 and True are equal, but a text that shows them is not the same.
        if old is not new and (type(old) is not type(new) or old != new):
            for callback in self._watchers.get(key, ()):
                callback(key)

    def __contains__(self, key: object) -> bool:
        return key in self._values

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def with_values(self, values: Mapping[str, Any]) -> KeyStore:
        """Return a copy in which some keys have other values."""
        copy = KeyStore({**self.as_dict(), **values})
        copy.declare(self._declared, self._kinds)
        return copy

    def as_dict(self) -> dict[str, Any]:
        """Copy all keys and values, for dumps and journals."""
        return dict(self._values)


class OwnKeys(KeyStore):
    """The keys as a part of a mission sees them that has some of its own, such as the names of a loop.

    What others write to a key of such a name is not seen here. What is written here is seen outside too,
    unless a part further out has a key of this name for itself.

    Args:
        outer: The keys outside.
        own: The names of its own.
    """

    def __init__(self, outer: KeyStore, own: Iterable[str]) -> None:
        self._outer = outer
        self._own = frozenset(own)
        super().__init__()
        self._declared, self._kinds = outer._declared, outer._kinds

    def watch(self, keys: Iterable[str], callback: Watcher) -> Callable[[], None]:
        """Call back as :meth:`KeyStore.watch` does; each key is watched where it is kept."""
        names = tuple(dict.fromkeys(keys))
        ends = (
            super().watch([key for key in names if key in self._own], callback),
            self._outer.watch([key for key in names if key not in self._own], callback),
        )

        def end() -> None:
            for each in ends:
                each()

        return end

    def peek(self, keys: Iterable[str]) -> tuple[Any, ...]:
        """Return the values of some keys, :data:`NOTHING` where a key has none."""
        own, values, outer = self._own, self._values, self._outer
        return tuple([values.get(k, NOTHING) if k in own else outer.peek((k,))[0] for k in keys])

    def read(self, key: str) -> Any:
        """Return the value of a key.

        Raises:
            MissingKey: Nothing has written the key.
        """
        return super().read(key) if key in self._own else self._outer.read(key)

    def write(self, key: str, value: Any) -> None:
        """Give a key a value, as :meth:`KeyStore.write` does."""
        if key in self._own:
            super().write(key, value)
            if self._outer.is_own(key):
                return
        self._outer.write(key, value)

    def is_own(self, key: str) -> bool:
        """Tell whether this part, or one around it, has a key for itself."""
        return key in self._own or self._outer.is_own(key)

    def __contains__(self, key: object) -> bool:
        return super().__contains__(key) if key in self._own else key in self._outer

    def __iter__(self) -> Iterator[str]:
        return iter(self.as_dict())

    def as_dict(self) -> dict[str, Any]:
        """Copy all keys and values as they are seen here."""
        return {**self._outer.as_dict(), **self._values}


def _check_storable(key: str, value: Any) -> None:
    items = value if isinstance(value, tuple) else (value,)
    if not all(isinstance(item, _STORABLE) for item in items):
        held = "text, numbers, booleans, poses and tuples of them"
        raise TypeError(f"the key {key!r} cannot hold {value!r}; {held} can be held")


@runtime_checkable
class ValueSource(Protocol):
    """A value that is known only when the mission runs."""

    def resolve(self, keys: KeyStore) -> Any:
        """Return the value now.

        Raises:
            ValueProblem: It needs a key that has no value, or cannot be computed.
        """


@dataclass(frozen=True, slots=True)
class KeyReference:
    """The value of a key.

    Attributes:
        key: The key's name.
    """

    key: str

    def resolve(self, keys: KeyStore) -> Any:
        """Return the key's value now."""
        return keys.read(self.key)


@dataclass(frozen=True, slots=True)
class ValueInWords:
    """The value of an expression as people write it.

    Attributes:
        value: Where to find it.
        kind: What it is; None when that is not known.
    """

    value: ValueSource
    kind: Kind | None

    def resolve(self, keys: KeyStore) -> str:
        """Return it with its unit."""
        return readable(self.value.resolve(keys), self.kind)


@dataclass(frozen=True, slots=True)
class TextTemplate:
    """A text with keys in it, whose values stand there as people write them: ``0.3 m/s``, ``90 deg``.

    Attributes:
        parts: Pieces of text, and the keys whose values stand between them. A value whose unit the author has
            written behind it is only the number.
    """

    parts: tuple[str | ValueSource, ...]

    def resolve(self, keys: KeyStore) -> str:
        """Return the text with the values of its keys."""
        following = (*self.parts[1:], "")
        return "".join(
            part if isinstance(part, str) else _in_text(part, keys, behind)
            for part, behind in zip(self.parts, following, strict=True)
        )


def _in_text(part: ValueSource, keys: KeyStore, behind: str | ValueSource) -> str:
    value = part.resolve(keys)
    if isinstance(value, tuple):
        shown = keys.shown(part.key, value) if isinstance(part, KeyReference) else readable(value)
        return shown[1:-1]  # "kitchen, hall" is said, and not its brackets
    if not isinstance(part, KeyReference):
        return readable(value)
    written = _UNIT.match(behind) if isinstance(behind, str) else None
    return keys.shown(part.key, value, written[0].strip() if written is not None else "")


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
        """Return the pose in the map frame."""
        x, y, yaw = (float(resolve(part, keys)) for part in (self.x, self.y, self.yaw))
        return Pose2(x, y, yaw)


@dataclass(frozen=True, slots=True)
class ListFromItems:
    """A list that is put together from values and keys.

    Attributes:
        items: Values, or where to find them.
    """

    items: tuple[Any, ...]

    def resolve(self, keys: KeyStore) -> tuple[Any, ...]:
        """Return the list."""
        return tuple(resolve(item, keys) for item in self.items)


def resolve(value: Any, keys: KeyStore) -> Any:
    """Resolve a value: a literal as it is, a value source as it stands now.

    Raises:
        ValueProblem: A key that is needed has no value, or the value cannot be computed.
    """
    return value.resolve(keys) if is_source(value) else value


def is_source(value: Any) -> bool:
    """Tell whether a value is a :class:`ValueSource`; asking the protocol itself takes ten times as long."""
    return hasattr(value, "resolve")


def readable(value: Any, kind: Kind | None = None) -> str:
    """Write a value for people, short and the same every time; with its unit when its kind is given."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)) and kind is not None and kind in SHOWN_UNITS:
        return quantity_text(value, kind, 4)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Pose2):
        return f"(x {value.x:.2f} m, y {value.y:.2f} m, yaw {math.degrees(value.yaw):.4g} deg)"
    if isinstance(value, tuple):
        item = kind.item if kind is not None else None
        return f"[{', '.join(readable(each, item) for each in value)}]"
    return str(value)
