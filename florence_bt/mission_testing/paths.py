"""The nodes of a mission by path, and the patterns by which a test names them.

A path is made of the names that a dump shows, joined with ``/``: ``goto_user/run approach_user/.../navigate
to``. In a pattern a called mission may stand by its own name and a skill by its own name, ``_`` and a space
are the same, ``*`` stands for anything within a name and ``**`` for any number of names. A pattern matches
the end of a path, unless it begins with ``/``.
"""

from __future__ import annotations

import difflib
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache

from py_trees.behaviour import Behaviour

from florence_bt.behaviours.context import TreeContext
from florence_bt.behaviours.run_skill import RunSkill
from florence_bt.behaviours.why import path_of
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Port, SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.trees import kinds
from florence_bt.trees.checks.outcomes import PossibleOutcomes, mission_outcomes
from florence_bt.trees.language.compile import Origin, compile_mission, origin_of
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission

MAX_PATHS_LISTED = 5
"""Paths that an error lists at most."""

FIRST = " (1)"
"""Ending of the name of a node whose twin beside it has a "(2)"."""
MAX_INDEX = 1_000_000
"""The place in the order of the tree of a node that is not in the tree."""

Segments = tuple[frozenset[str], ...]
"""A path for matching: of each name everything that may be written for it."""


@dataclass(frozen=True, slots=True)
class NodeRef:
    """A node of a mission.

    Attributes:
        path: The names from the root down, joined with ``/``, as in events and dumps.
        shown: The same with the names of missions and skills, for people.
        short: The shortest part that names no other node, as a pattern.
        segments: The same for matching.
        skill: The skill that it runs, None for every other node.
        outputs: The outputs of the skill that the mission uses.
        index: Where it stands in the order of the tree.
        origin: The node of the mission file that it came from, None for parts of one.
        call: Of a node that runs a skill: the node of the file that says so, also when it is a part of it.
        leaf: Whether nothing is below it.
    """

    path: str
    shown: str
    short: str
    segments: Segments
    skill: str | None
    outputs: tuple[str, ...]
    index: int
    origin: Origin | None
    call: Origin | None
    leaf: bool


class MissionMap:
    """Every node of a mission, those of called missions and of clean-ups included.

    Attributes:
        mission: The name of the mission.
        outputs: What it gives when it succeeds.
        outcomes: What can come of it.
        nodes: Every node by path, in the order of the tree.
    """

    def __init__(self, mission: Mission, root: Behaviour, outcomes: PossibleOutcomes) -> None:
        self.mission = mission.name
        self.outputs: Mapping[str, Port] = mission.outputs
        self.outcomes = outcomes
        self.nodes: dict[str, NodeRef] = {}
        head = () if _plain(root.name) == _plain(mission.name) else (frozenset({_plain(mission.name)}),)
        self._add(root, head, "" if not head else mission.name)
        self._shorten()

    def uses(self) -> list[NodeRef]:
        """Return the nodes that run a skill."""
        return [node for node in self.nodes.values() if node.skill is not None]

    def find(self, path: str) -> NodeRef:
        """Return the node of a path; one that is not in the tree is made up from its names."""
        return self.nodes.get(path) or made_up_node(path)

    def _add(self, node: Behaviour, above: Segments, shown_above: str, near: Origin | None = None) -> None:
        origin = origin_of(node)
        near = origin or near
        names, shown = [node.name], node.name
        if isinstance(node, RunSkill):
            names.append(node.skill)
            title = node.skill.replace("_", " ")
            if node.name.startswith(title):
                shown = node.skill + node.name[len(title) :]
            if _has_twin(node):
                # The name of the skill is that of both; only with a number can the first be named alone.
                names.append(f"{node.name}{FIRST}")
                shown += FIRST
        elif origin is not None and isinstance(origin.node, kinds.CallMission):
            names += [origin.node.mission.text, origin.node.default_title]
            shown = origin.node.mission.text
        segments = (*above, frozenset(_plain(name) for name in names))
        shown = f"{shown_above}/{shown}" if shown_above else shown
        path = path_of(node)
        self.nodes[path] = NodeRef(
            path=path,
            shown=shown,
            short=shown,
            segments=segments,
            skill=node.skill if isinstance(node, RunSkill) else None,
            outputs=tuple(node.outputs) if isinstance(node, RunSkill) else (),
            index=len(self.nodes),
            origin=origin,
            call=near if isinstance(node, RunSkill) else None,
            leaf=not node.children,
        )
        for child in node.children:
            self._add(child, segments, shown, near)

    def _shorten(self) -> None:
        called = [ref.origin.node for ref in self.nodes.values() if ref.origin is not None]
        missions = {node.mission.text for node in called if isinstance(node, kinds.CallMission)}
        wanted = {path: _shorter(ref.shown, missions) for path, ref in self.nodes.items()}
        count = Counter(_plain(text) for texts in wanted.values() for text in texts)
        for ref in self.nodes.values():
            # Its other names mean it, too: that of its skill, and of a call that is guarded the guard's.
            *above, last = ref.shown.split("/")
            for name in ref.segments[-1] - {_plain(last)}:
                count.update(_plain(text) for text in _shorter("/".join([*above, name]), missions))
        for path, texts in wanted.items():
            short = next((text for text in texts if count[_plain(text)] == 1), texts[-1])
            self.nodes[path] = replace(self.nodes[path], short=short)


def _has_twin(node: Behaviour) -> bool:
    """Tell whether a node is the first of several of one name; the compiler numbers the others."""
    beside = node.parent.children if node.parent is not None else []
    return any(other.name == f"{node.name} (2)" for other in beside)


def _shorter(shown: str, missions: Collection[str]) -> tuple[str, ...]:
    """Return what may stand for a path, the best first: the last name, with a called mission before it, with
    any name above it, with the one right above it too, and all of it.
    """
    *above, last = shown.split("/")
    above.reverse()
    near = f"{above[0]}/{last}" if above else last
    calls = [name for name in above[:-1] if name in missions]
    forms = [last, *(f"{name}/**/{last}" for name in calls), near, *(f"{name}/**/{last}" for name in above)]
    return tuple(dict.fromkeys([*forms, *(f"{name}/**/{near}" for name in above[1:]), shown]))


def made_up_node(path: str) -> NodeRef:
    """Make up a node of which only the path is known."""
    segments = tuple(frozenset({_plain(name)}) for name in path.split("/"))
    return NodeRef(path, path, path, segments, None, (), MAX_INDEX, None, None, True)


def map_mission(
    mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
) -> MissionMap:
    """Build the tree of a mission and note its nodes.

    Raises:
        ConfigError: The mission has errors that ``florence check`` would have found.
    """
    context = TreeContext(ManualClock(), lambda: None, {}, declarations)
    root = compile_mission(mission, library, {}, context).root
    return MissionMap(mission, root, mission_outcomes(mission, library, declarations))


@cache
def all_declarations() -> Mapping[str, SkillDeclaration]:
    """Return every declared skill; read once."""
    return collect_declarations()


class MissionMaps:
    """The maps of missions, made once for each."""

    def __init__(self) -> None:
        self._maps: dict[str, tuple[Mission, MissionMap]] = {}

    def of(
        self, mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
    ) -> MissionMap:
        """Return the map of a mission.

        Raises:
            ConfigError: The mission has errors.
        """
        known = self._maps.get(mission.name)
        if known is None or known[0] is not mission:
            known = self._maps[mission.name] = (mission, map_mission(mission, library, declarations))
        return known[1]


@dataclass(frozen=True, slots=True)
class Pattern:
    """A pattern of paths.

    Attributes:
        text: As written.
        parts: Its names; None stands for ``**``.
    """

    text: str
    parts: tuple[re.Pattern[str] | None, ...]

    @property
    def plain(self) -> bool:
        """Tell whether it is a single name without wildcards."""
        return "/" not in self.text and "*" not in self.text

    @property
    def rank(self) -> tuple[int, int]:
        """Weigh how much it says: names without a wildcard, then letters. The higher of two patterns wins."""
        names = [name for name in self.text.split("/") if name and name != "**"]
        return sum("*" not in name for name in names), sum(len(name.replace("*", "")) for name in names)

    def matches(self, node: NodeRef) -> bool:
        """Tell whether the pattern matches a node."""
        return _matches(self.parts, node.segments)


@lru_cache(maxsize=1024)
def read_pattern(text: str) -> Pattern:
    """Read a pattern.

    Raises:
        ConfigError: It is empty or has an empty name.
    """
    names = text.strip().removeprefix("/").split("/")
    if not all(name.strip() for name in names):
        raise ConfigError(
            f"{text!r} is not a pattern of paths", valid=["navigate_to", "approach_user/**/navigate_to", "*"]
        )
    parts: list[re.Pattern[str] | None] = [None if name == "**" else _name_pattern(name) for name in names]
    if not text.strip().startswith("/"):
        parts.insert(0, None)
    return Pattern(text.strip(), tuple(parts))


def matching(pattern: str, nodes: Iterable[NodeRef]) -> list[NodeRef]:
    """Return the nodes that a pattern means, in order."""
    read = read_pattern(pattern)
    return [node for node in nodes if read.matches(node)]


def closest_paths(pattern: str, nodes: Iterable[NodeRef]) -> list[str]:
    """Return the short forms of paths that resemble a pattern without a match, the closest first."""
    nodes = list(nodes)
    wanted = [_plain(name) for name in pattern.strip("/").split("/") if "*" not in name] or [""]

    def likeness(node: NodeRef) -> float:
        names = [max(_alike(name, written) for written in node.segments) for name in wanted]
        return 2.0 * _alike(wanted[-1], node.segments[-1]) + sum(names) / len(names)

    ordered = sorted(nodes, key=lambda node: (-likeness(node), node.index))
    return list(dict.fromkeys(node.short for node in ordered))[:MAX_PATHS_LISTED]


def _alike(name: str, written: frozenset[str]) -> float:
    return max(difflib.SequenceMatcher(None, name, each).ratio() for each in sorted(written))


@lru_cache(maxsize=100_000)
def _matches(parts: tuple[re.Pattern[str] | None, ...], segments: Segments) -> bool:
    """Tell whether name patterns cover a path exactly, from the left with all open positions."""
    open_at = {0}
    for part in parts:
        if part is None:
            open_at = set(range(min(open_at), len(segments) + 1)) if open_at else open_at
        else:
            open_at = {
                at + 1
                for at in open_at
                if at < len(segments) and any(part.fullmatch(name) for name in segments[at])
            }
    return len(segments) in open_at


def _name_pattern(name: str) -> re.Pattern[str]:
    return re.compile(".*".join(re.escape(piece) for piece in _plain(name).split("*")), re.DOTALL)


def _plain(name: str) -> str:
    """Return a name as it is compared: lower case, underscores and slashes as spaces."""
    return " ".join(name.replace("_", " ").replace("/", " ").lower().split())


def unmatched(
    text: str, mission_map: MissionMap, skills: Collection[str], *, skills_only: bool, what: str = ""
) -> ConfigError:
    """Make the error for a pattern that matches nothing.

    Args:
        text: The pattern.
        mission_map: The nodes of the mission.
        skills: The names of all skills.
        skills_only: Whether only nodes that run a skill count.
        what: What the pattern is for, such as ``the mock ``; for messages.
    """
    candidates = mission_map.uses() if skills_only else list(mission_map.nodes.values())
    if text in skills:
        used = dict.fromkeys(node.skill for node in mission_map.uses() if node.skill)
        valid = closest_first(text, used) or ("no skills",)
        return ConfigError(f"{what}{text!r} is a skill that {mission_map.mission} does not use", valid=valid)
    others = matching(text, mission_map.nodes.values()) if skills_only else []
    if others:
        origin = others[0].origin
        called = isinstance(origin.node, kinds.CallMission) if origin is not None else False
        inside = [
            params for params in candidates if any(params.path.startswith(f"{o.path}/") for o in others)
        ]
        kind = "a mission that is called" if called else "a node of the tree"
        return ConfigError(
            f"{what}{text!r} is not a skill but {kind}",
            valid=list(dict.fromkeys(params.short for params in inside))[:MAX_PATHS_LISTED],
        )
    kind = "skill" if skills_only else "node"
    close = dict.fromkeys([*_named_like(text, mission_map), *closest_paths(text, candidates)])
    message = f"{what}{text!r} matches no {kind} of {mission_map.mission}"
    return ConfigError(message, valid=list(close)[:MAX_PATHS_LISTED])


def _named_like(text: str, mission_map: MissionMap) -> list[str]:
    """Return the skill, or the called mission, whose name looks like this; either may be mocked."""
    nodes = [node.origin.node for node in mission_map.nodes.values() if node.origin is not None]
    missions = [node.mission.text for node in nodes if isinstance(node, kinds.CallMission)]
    names = dict.fromkeys([*missions, *(node.skill for node in mission_map.uses() if node.skill)])
    return difflib.get_close_matches(text, names, n=1, cutoff=0.8)
