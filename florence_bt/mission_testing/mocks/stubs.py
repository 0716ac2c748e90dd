"""Called missions that are mocked whole: a mission whose tree is one skill of the same name."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import COMMON_CODES
from florence_bt.core.plain_yaml import Position
from florence_bt.mission_testing.paths import MissionMap, Pattern
from florence_bt.trees import kinds
from florence_bt.trees.checks.outcomes import mission_outcomes
from florence_bt.trees.language.code_groups import groups_of
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Literal, Mission, Reference

_NOWHERE = Position(0, 0)
"""Position of the nodes of a stub: nothing of a file, so that nothing in it counts as seen."""
_DEADLINE_S = 1e9
"""A mission has no deadline of its own."""


@dataclass(frozen=True, slots=True)
class MockedMission:
    """A called mission that is mocked whole.

    Attributes:
        name: The mission.
        taken: Its outputs that calls take; no others need be given.
    """

    name: str
    taken: frozenset[str]


def mocked_missions(
    patterns: Iterable[Pattern], mission_map: MissionMap, skills: Collection[str]
) -> tuple[MockedMission, ...]:
    """Return the called missions that mocks name instead of skills.

    Args:
        patterns: Whom the mocks are for.
        mission_map: The nodes of the mission that is tested.
        skills: The names of all skills; a skill goes before a mission of the same name.
    """
    calls = [
        (ref, node)
        for ref in mission_map.nodes.values()
        if ref.origin is not None and isinstance(node := ref.origin.node, kinds.CallMission)
    ]
    names: dict[str, None] = {}
    for pattern in patterns:
        last = pattern.text.rsplit("/", 1)[-1].strip()
        if last in skills or any(pattern.matches(ref) for ref in mission_map.uses()):
            continue
        if any(node.mission.text == last and pattern.matches(ref) for ref, node in calls):
            names[last] = None
    taken = [(node.mission.text, output.text) for _, node in calls for output, _ in node.outputs]
    return tuple(MockedMission(name, frozenset(o for called, o in taken if called == name)) for name in names)


def put_stubs(
    mocked: Iterable[MockedMission], library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> None:
    """Let stubs stand for missions of a library.

    Args:
        mocked: The missions.
        library: Holds the stubs afterwards, and what they take, give and can fail with as declared skills.
        declarations: The skills by name.
    """
    missions = {library.get(each.name): each.taken for each in mocked}
    # What a mission can fail with is read from what it calls: all are declared before the first is replaced.
    declared = {mission.name: _declared(mission, library, declarations) for mission in missions}
    library.declarations.update(declared)
    for mission, taken in missions.items():
        library.put(_stub(mission, taken))


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
    groups = [replace(each, codes=each.codes & {*codes}) for each in groups_of(declarations).values()]
    return SkillDeclaration(
        mission.name,
        mission.description,
        inputs=mission.inputs,
        outputs=mission.outputs,
        failures={code: f"{mission.name} failed with {code}" for code in codes},
        deadline_s=_DEADLINE_S,
        groups=tuple(group for group in groups if group.codes),
    )


def _stub(mission: Mission, taken: Collection[str]) -> Mission:
    def literal(name: str) -> Literal:
        return Literal(name, False, _NOWHERE)

    tree = kinds.RunSkill(
        position=_NOWHERE,
        skill=mission.name,
        inputs=tuple((literal(name), Reference(name, _NOWHERE)) for name in mission.inputs),
        outputs=tuple((literal(name), literal(name)) for name in mission.outputs if name in taken),
    )
    return replace(mission, tree=tree, keys={})
