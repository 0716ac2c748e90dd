"""Called missions that are mocked whole: a mission whose tree is one skill of the same name."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.core.plain_yaml import Position
from florence_bt.mission_testing.paths import MissionMap, Pattern
from florence_bt.trees.checks.outcomes import mission_outcomes
from florence_bt.trees.language import model
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Literal, Mission, Reference

_NOWHERE = Position(0, 0)
"""Where the nodes of a stub stand: nothing of a file, so that nothing in it counts as seen."""
_DEADLINE_S = 1e9
"""A mission has no deadline of its own."""


def mocked_missions(
    patterns: Iterable[Pattern], mission_map: MissionMap, skills: Collection[str]
) -> tuple[str, ...]:
    """Return the called missions that mocks name instead of skills.

    Args:
        patterns: Whom the mocks are for.
        mission_map: The nodes of the mission that is tested.
        skills: The names of all skills; a skill goes before a mission of the same name.
    """
    calls = [ref for ref in mission_map.nodes.values() if ref.origin is not None]
    names: dict[str, None] = {}
    for pattern in patterns:
        last = pattern.text.rsplit("/", 1)[-1].strip()
        if last in skills or any(pattern.matches(ref) for ref in mission_map.uses()):
            continue
        for ref in calls:
            node = ref.origin.node if ref.origin is not None else None
            if isinstance(node, model.CallMission) and node.mission.text == last and pattern.matches(ref):
                names[last] = None
    return tuple(names)


def put_stubs(
    names: Iterable[str], library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> None:
    """Let stubs stand for missions of a library.

    Args:
        names: The missions.
        library: Holds the stubs afterwards, and what they take, give and can fail with as declared skills.
        declarations: The skills by name.
    """
    missions = [library.get(name) for name in names]
    # What a mission can fail with is read from what it calls: all are declared before the first is replaced.
    declared = {mission.name: _declared(mission, library, declarations) for mission in missions}
    library.declarations.update(declared)
    for mission in missions:
        library.put(_stub(mission))


def copied(library: MissionLibrary) -> MissionLibrary:
    """Copy a library, so that the copy can be changed without harm to the first one."""
    copy = MissionLibrary()
    copy.folders = list(library.folders)
    copy.declarations.update(library.declarations)
    for mission in library:
        copy.put(mission)
    return copy


def _declared(
    mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> SkillDeclaration:
    codes = sorted(mission_outcomes(mission, library, declarations).codes - COMMON_CODES.keys())
    return SkillDeclaration(
        mission.name,
        mission.description,
        inputs=mission.inputs,
        outputs=mission.outputs,
        failures={code: f"{mission.name} failed with {code}" for code in codes},
        deadline_s=_DEADLINE_S,
    )


def _stub(mission: Mission) -> Mission:
    def literal(name: str) -> Literal:
        return Literal(name, False, _NOWHERE)

    tree = model.RunSkill(
        position=_NOWHERE,
        skill=mission.name,
        inputs=tuple((literal(name), Reference(name, _NOWHERE)) for name in mission.inputs),
        outputs=tuple((literal(name), literal(name)) for name in mission.outputs),
    )
    return replace(mission, tree=tree, keys={})
