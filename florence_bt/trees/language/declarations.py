"""Collects what the skills say about themselves, without loading the skills."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from types import ModuleType

import florence_bt
from florence_bt.core.declaration import SkillDeclaration
from florence_bt.trees.kinds.words import RESERVED
from florence_bt.trees.language.declared_skills import ENDING, read_skills_file
from florence_bt.trees.language.findings import Finding
from florence_bt.trees.language.third_party import ThirdParty
from florence_bt.trees.language.vocabulary import IDENTIFIER


class Declarations(dict[str, SkillDeclaration]):
    """Skills by name, in alphabetical order.

    Attributes:
        findings: What is wrong with the files, and the skills of installed packages that do not count.
    """

    def __init__(self, skills: Iterable[SkillDeclaration] = (), findings: Iterable[Finding] = ()) -> None:
        super().__init__(sorted((skill.name, skill) for skill in skills))
        self.findings = tuple(findings)


@cache
def own_declarations() -> Declarations:
    """Read the files of our own skills, ``florence_bt/skills/**/NAME.skills.yaml``, once in a process.

    The folder is read and not imported: the language needs none of its code.
    """
    declared: dict[str, SkillDeclaration] = {}
    findings: list[Finding] = []
    for path in sorted((Path(florence_bt.__file__).parent / "skills").rglob(f"*{ENDING}")):
        read = read_skills_file(path)
        declared |= read.declarations
        findings += read.findings
    return Declarations(declared.values(), findings)


def collect_declarations() -> Declarations:
    """Collect every declaration of our own skills, and those of installed packages.

    Those of a package stand in the module that its entry point in the group ``florence_bt.skills`` names.
    What is wrong is in the findings.
    """
    own = own_declarations()
    packages = ThirdParty()
    further: dict[str, SkillDeclaration] = {}
    owners: dict[str, str] = {}
    for owner, module in packages.skill_modules():
        for skill in skills_in(module):
            if skill.name in own or further.get(skill.name, skill) is not skill:
                other = owners.get(skill.name, "Florence BT itself")
                packages.refuse(owner, f"its skill {skill.name!r} is ignored: {other} has one of that name")
            elif skill.name in RESERVED or not IDENTIFIER.fullmatch(skill.name):
                packages.refuse(owner, f"a skill cannot be called {skill.name!r}", "verb_noun")
            else:
                further[skill.name], owners[skill.name] = skill, owner
    return Declarations([*own.values(), *further.values()], [*own.findings, *packages.findings])


def skills_in(module: ModuleType) -> Iterator[SkillDeclaration]:
    """Yield the skills that a module declares."""
    return (value for value in vars(module).values() if isinstance(value, SkillDeclaration))
