"""A snapshot of everything that changes while a tree is ticked; it is put back into the very same objects.

A tree cannot be copied: its callbacks, watchers and closures refer to each other. So the objects stay, and
what they hold is written down and put back. Objects that came later are simply let go.
"""

from __future__ import annotations

import enum
import types
import uuid
from collections.abc import Callable, Iterable
from functools import partial
from itertools import count
from typing import Any

from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import ListFromItems, PoseFromParts, TextTemplate
from florence_bt.behaviours.ticking.ticker import Ticker, TickTable
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Result

_FIXED_PARTS = ("florence_bt.trees.", "florence_bt.core.declaration", "py_trees.common", "logging")
"""Modules whose objects do not change."""


class Unchanging:
    """A base of classes whose objects a snapshot leaves alone, with what can be reached only through them."""

    __slots__ = ()


_FIXED: tuple[type, ...] = (
    Unchanging,
    *(str, int, float, bool, bytes, type(None), type, enum.Enum, uuid.UUID, count, types.ModuleType),
    *(types.BuiltinFunctionType, types.GeneratorType, Pose2, Result, SkillDeclaration, CompiledExpression),
    *(TextTemplate, PoseFromParts, ListFromItems, Ticker, TickTable, frozenset),
)
Restore = tuple[Callable[[Any, Any], None], Any, Any]


class Snapshot:
    """The values that some objects hold now, and all that can be reached from them.

    Args:
        roots: Where to begin.
    """

    def __init__(self, roots: Iterable[Any]) -> None:
        self._saved: list[Restore] = []
        seen: set[int] = set()
        todo = list(roots)
        saved = self._saved
        while todo:
            each = todo.pop()
            read = _READERS.get(each.__class__)
            if read is None:
                read = _READERS[each.__class__] = _reader_of(each.__class__)
                if read is _skip:
                    _SKIPPED.add(each.__class__)
            if read is _skip or id(each) in seen:
                continue
            seen.add(id(each))
            read(each, saved, todo)

    def restore(self) -> None:
        """Put back what the objects held."""
        for put, each, held in self._saved:
            put(each, held)


Reader = Callable[[Any, list[Restore], list[Any]], None]
_READERS: dict[type, Reader] = {}
"""What writes down an object of a class, and says where to go on."""
_SKIPPED: set[type] = set()
"""The classes that are known to be left out."""


def _skip(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    """Leave out what does not change."""


def _reader_of(cls: type) -> Reader:
    if issubclass(cls, _FIXED) or cls.__module__.startswith(_FIXED_PARTS):
        return _skip
    for kind, reader in _CONTAINERS.items():
        if issubclass(cls, kind):
            return reader
    slots = _slots_of(cls)
    if not cls.__dictoffset__:
        return partial(_read_named, slots) if slots else _skip
    return partial(_read_instance, slots) if slots else _read_dict_of


def _slots_of(cls: type) -> tuple[str, ...]:
    return tuple(
        name
        for base in cls.__mro__
        for name in getattr(base, "__slots__", ())
        if name not in ("__dict__", "__weakref__")
    )


def _read_list(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    held = list(each)
    saved.append((_put_list, each, held))
    todo += [x for x in held if x.__class__ not in _SKIPPED]


def _put_list(each: Any, held: Any) -> None:
    each[:] = held


def _read_dict(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    held = dict(each)
    saved.append((_put_dict, each, held))
    todo += [x for x in held.values() if x.__class__ not in _SKIPPED]
    todo += [x for x in held if x.__class__ not in _SKIPPED]


def _put_dict(each: Any, held: Any) -> None:
    each.clear()
    each.update(held)


def _read_dict_of(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    held = dict(each.__dict__)
    saved.append((_put_instance, each, held))
    todo += [x for x in held.values() if x.__class__ not in _SKIPPED]


def _put_instance(each: Any, held: Any) -> None:
    own = each.__dict__
    if len(own) != len(held):
        own.clear()
    own.update(held)


def _read_instance(slots: tuple[str, ...], each: Any, saved: list[Restore], todo: list[Any]) -> None:
    _read_dict_of(each, saved, todo)
    _read_named(slots, each, saved, todo)


def _read_named(names: tuple[str, ...], each: Any, saved: list[Restore], todo: list[Any]) -> None:
    held = [(name, getattr(each, name)) for name in names if hasattr(each, name)]
    saved.append((_put_named, each, held))
    todo += [x for _, x in held if x.__class__ not in _SKIPPED]


def _put_named(each: Any, held: Any) -> None:
    for name, value in held:
        object.__setattr__(each, name, value)


def _read_set(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    held = set(each)
    saved.append((_put_set, each, held))
    todo += [x for x in held if x.__class__ not in _SKIPPED]


def _put_set(each: Any, held: Any) -> None:
    each.clear()
    each.update(held)


def _read_tuple(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    todo += [x for x in each if x.__class__ not in _SKIPPED]


def _read_function(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    if each.__closure__:
        todo += [x for x in each.__closure__ if x.__class__ not in _SKIPPED]


def _read_cell(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    try:
        held = each.cell_contents
    except ValueError:  # it is empty
        return
    saved.append((_put_cell, each, held))
    todo.append(held)


def _put_cell(each: Any, held: Any) -> None:
    each.cell_contents = held


def _read_method(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    todo.append(each.__self__)


def _read_partial(each: Any, saved: list[Restore], todo: list[Any]) -> None:
    todo.append(each.func)
    todo += [x for x in each.args if x.__class__ not in _SKIPPED]
    todo += [x for x in each.keywords.values() if x.__class__ not in _SKIPPED]


_CONTAINERS: dict[type, Reader] = {
    list: _read_list,
    dict: _read_dict,
    set: _read_set,
    tuple: _read_tuple,
    types.FunctionType: _read_function,
    types.CellType: _read_cell,
    types.MethodType: _read_method,
    types.MappingProxyType: lambda each, saved, todo: todo.extend(each.values()),
    partial: _read_partial,
}
