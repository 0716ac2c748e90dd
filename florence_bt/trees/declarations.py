"""Collects what the skills say about themselves, without loading the skills."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from collections.abc import Iterable
from types import ModuleType

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.trees.kinds import IDENTIFIER, RESERVED


def collect_declarations() -> dict[str, SkillDeclaration]:
    """Every declaration in ``florence_bt.skills.*.declaration``, by name, in alphabetical order.

    Raises:
        ConfigError: Two skills have one name, or a name that the mission language needs for itself.
    """
    skills = importlib.import_module("florence_bt.skills")
    names = [
        f"{skills.__name__}.{module.name}.declaration" for module in pkgutil.iter_modules(skills.__path__)
    ]
    found = [name for name in sorted(names) if importlib.util.find_spec(name) is not None]
    return declarations_in(importlib.import_module(name) for name in found)


def declarations_in(modules: Iterable[ModuleType]) -> dict[str, SkillDeclaration]:
    """Every declaration in some modules, by name, in alphabetical order.

    Raises:
        ConfigError: As :func:`collect_declarations`.
    """
    declared: dict[str, SkillDeclaration] = {}
    homes: dict[str, str] = {}
    for module in modules:
        for value in vars(module).values():
            if not isinstance(value, SkillDeclaration) or declared.get(value.name) is value:
                continue
            if value.name in declared:
                raise ConfigError(
                    f"two skills are called {value.name!r}: in {homes[value.name]} and in {module.__name__}"
                )
            if value.name in RESERVED or not IDENTIFIER.fullmatch(value.name):
                raise ConfigError(
                    f"a skill cannot be called {value.name!r}", file=getattr(module, "__file__", None)
                )
            declared[value.name], homes[value.name] = value, module.__name__
    return dict(sorted(declared.items()))
