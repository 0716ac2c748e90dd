"""Whose servers are missing: of the skills that a robot's own missions use, by skill, server and type."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from florence_bt.core.serving import (
    ActionBinding,
    ConditionBinding,
    PublicationBinding,
    ServiceBinding,
    WaitBinding,
)
from florence_bt.ros.node import FlorenceNode
from florence_bt.skills.served import BINDINGS
from florence_bt.trees.language.loader import MissionLibrary

FIRST_LOOK_S = 5.0
"""Discovery takes up to so long; and so often is looked again."""

_WAYS = {
    ActionBinding: "action",
    ServiceBinding: "service",
    ConditionBinding: "topic",
    WaitBinding: "topic",
    PublicationBinding: "topic",
}


@dataclass(frozen=True, slots=True)
class _Server:
    skill: str
    way: str
    name: str
    interface: str

    def __str__(self) -> str:
        return f"{self.skill} ({self.way} {self.name}, {self.interface})"


class MissingServers:
    """Tells which servers the missions of some folders lack, after 5 s and whenever that changes.

    Args:
        node: Sees the graph.
        folders: Folders of missions; those that they call count, too.
        report: Told a line.
    """

    def __init__(self, node: FlorenceNode, folders: Iterable[Path], report: Callable[[str], None]) -> None:
        self._node = node
        self._report = report
        self._needed = tuple(_servers_of(list(folders)))
        self._told: tuple[_Server, ...] = ()
        self._due = node.steady.now() + FIRST_LOOK_S

    def look(self) -> None:
        """Look when it is time; call it often."""
        now = self._node.steady.now()
        if now < self._due:
            return
        self._due = now + FIRST_LOOK_S
        missing = tuple(server for server in self._needed if not self._is_there(server))
        if missing != self._told:
            self._told = missing
            self._report(
                f"nobody serves: {'; '.join(map(str, missing))}; missions that need it fail with server_lost"
                if missing
                else "everything that these missions need is served now"
            )

    def _is_there(self, server: _Server) -> bool:
        name = self._node.resolve_topic_name(server.name)
        if server.way == "topic":
            return self._node.count_publishers(name) + self._node.count_subscribers(name) > 1
        suffix = "/_action/send_goal" if server.way == "action" else ""
        return self._node.count_services(f"{name}{suffix}") > 0


def _servers_of(folders: list[Path]) -> Iterator[_Server]:
    library = MissionLibrary.load(folders)
    served = {
        each.skill.name: _Server(each.skill.name, _WAYS[type(each)], each.name, each.interface)
        for each in BINDINGS
        if type(each) in _WAYS
    }
    for name, mapping in library.mappings.items():
        way = mapping.way if mapping.way in ("action", "service") else "topic"
        served.setdefault(name, _Server(name, way, mapping.name, mapping.interface))
    own = [mission.name for mission in library if mission.file.parent in folders]
    for skill in sorted({skill for name in own for skill, _ in library.skills_below(name)}):
        if skill in served:
            yield served[skill]
