"""Collects what the skills say about themselves, without loading the skills."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable, Iterator
from types import ModuleType

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.third_party import ThirdParty
from florence_bt.trees.language.vocabulary import IDENTIFIER, RESERVED


class Declarations(dict[str, SkillDeclaration]):
    """Skills by name, in alphabetical order.

    Attributes:
        findings: The skills of installed packages that do not count, and why.
        owners: Skill of an installed package -> who brought it.
    """

    def __init__(
        self,
        skills: Iterable[SkillDeclaration] = (),
        findings: Iterable[Finding] = (),
        owners: Iterable[tuple[str, str]] = (),
    ) -> None:
        super().__init__(sorted((skill.name, skill) for skill in skills))
        self.findings = tuple(findings)
        self.owners = dict(owners)


def collect_declarations(*, third_party: bool = True) -> Declarations:
    """Collect every declaration of our own skills, and those of installed packages.

    Our own stand in ``florence_bt.skills.*.*.declaration``; those of a package in the module that its entry
    point in the group ``florence_bt.skills`` names. What is wrong with a package is in the findings.

    Args:
        third_party: Whether to look at installed packages.

    Raises:
        ConfigError: Two of our own skills have one name, or one that the mission language needs for itself.
    """
    skills = importlib.import_module("florence_bt.skills")
    modules = pkgutil.walk_packages(skills.__path__, f"{skills.__name__}.")
    found = [module.name for module in modules if module.name.endswith(".declaration")]
    own = declarations_in(importlib.import_module(name) for name in sorted(found))
    if not third_party:
        return Declarations(own.values())
    packages = ThirdParty()
    further: dict[str, SkillDeclaration] = {}
    owners: dict[str, str] = {}
    for owner, module in packages.skill_modules():
        for skill in skills_in(module):
            if skill.name in own or further.get(skill.name, skill) is not skill:
                other = owners.get(skill.name, "Florence BT itself")
                packages.refuse(owner, f"its skill {skill.name!r} is ignored: {other} has one of that name")
            elif not _nameable(skill.name):
                packages.refuse(owner, f"a skill cannot be called {skill.name!r}", "verb_noun")
            else:
                further[skill.name], owners[skill.name] = skill, owner
    return Declarations([*own.values(), *further.values()], packages.findings, owners.items())


def declarations_in(modules: Iterable[ModuleType]) -> Declarations:
    """Collect every declaration in some modules, by name, in alphabetical order.

    Raises:
        ConfigError: As :func:`collect_declarations`.
    """
    declared: dict[str, SkillDeclaration] = {}
    homes: dict[str, str] = {}
    for module in modules:
        for skill in skills_in(module):
            if declared.get(skill.name) is skill:
                continue
            if skill.name in declared:
                raise ConfigError(
                    f"two skills are called {skill.name!r}: in {homes[skill.name]} and in {module.__name__}"
                )
            if not _nameable(skill.name):
                raise ConfigError(
                    f"a skill cannot be called {skill.name!r}", file=getattr(module, "__file__", None)
                )
            declared[skill.name], homes[skill.name] = skill, module.__name__
    return Declarations(declared.values())


def skills_in(module: ModuleType) -> Iterator[SkillDeclaration]:
    """Yield the skills that a module declares."""
    return (value for value in vars(module).values() if isinstance(value, SkillDeclaration))


def _nameable(name: str) -> bool:
    return name not in RESERVED and IDENTIFIER.fullmatch(name) is not None
