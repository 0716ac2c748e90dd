"""``florence check --live``: do the missions fit the system that runs now?

Asks the mission server which missions it has, the locator for hotspots, and the ROS graph for a server of
each skill that the missions use, those of called missions included.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from florence_interfaces.srv import GetHotspot

from florence_bt.app.bringup.options import STARTS
from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.app.runs.client import MissionClient, SystemNotThere
from florence_bt.core.errors import DeviceTimeout, closest_first
from florence_bt.core.plain_yaml import Position
from florence_bt.core.skill import Skill
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.served_skill import ServedSkill
from florence_bt.trees.kinds import CallMission, RunSkill
from florence_bt.trees.language.findings import ERROR, WARNING, Finding
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.message_mappings import MessageMapping
from florence_bt.trees.language.model import Mission

STATES_S = 2.0
"""Wall seconds in which managed nodes must tell their state."""
SEARCH_S = 5.0
"""Wall seconds in which the mission server, and then the servers of the skills, must be discovered."""
_HOTSPOT_SERVICE = "florenceLocator/getHotspot"


@dataclass(frozen=True, slots=True)
class _Need:
    """Something that a mission needs, and the place in a checked file that says so."""

    name: str
    mission: Mission
    position: Position
    through: str = ""

    def finding(self, message: str, valid: Iterable[str] = (), severity: str = ERROR) -> Finding:
        through = f" (in the mission {self.through})" if self.through else ""
        place = self.position
        file = str(self.mission.file)
        return Finding(file, place.line, place.column, severity, message + through, tuple(valid))


def compare_with_system(
    missions: Iterable[Mission],
    library: MissionLibrary,
    labels: Callable[[Mission], Iterable[tuple[str, Position]]],
    skills: Callable[[FlorenceNode], Mapping[str, Skill]] | None = None,
) -> list[Finding]:
    """Hold missions against the system that runs now.

    Args:
        missions: The missions that are checked.
        library: Where the missions that they call are found.
        labels: The labels of hotspots that are written in a mission, and where.
        skills: Builds the skills of the system over a node; all of this installation when not given.

    Returns:
        What does not fit: skills without a server, missions that the server lacks or has otherwise, and
        hotspots that the locator lacks.

    Raises:
        SystemNotThere: There is no mission server.
        DeviceTimeout: The mission server does not answer.
    """
    missions = list(missions)
    build = skills or partial(make_skills, mappings=library.mappings)
    with MissionClient("florence_check") as client:
        # A client that is brand new needs a moment to see who is there.
        client.spin_until(lambda: client.servers() > 0, client.patience(SEARCH_S))
        served = {info.name: info for info in client.missions().missions}
        findings = [finding for mission in missions for finding in _compare_mission(mission, served)]
        findings += _compare_skills(
            client, _skills_of(missions, library), build(client.node), library.mappings
        )
        return findings + _compare_hotspots(client, missions, labels)


# ---- missions -------------------------------------------------------------------------------------------


def _compare_mission(mission: Mission, served: Mapping[str, Any]) -> Iterator[Finding]:
    """Yield what is wrong with one mission, and with those that it calls, on the mission server."""
    here = _Need(mission.name, mission, mission.tree.position if mission.tree is not None else Position(1, 1))
    there = served.get(mission.name)
    if there is None:
        valid = (
            "florence up --missions FOLDER, with the folder of this file",
            *closest_first(mission.name, served),
        )
        yield here.finding(f"the running mission server has no mission {mission.name!r}", valid)
    elif there.version != mission.version:
        message = f"the running mission server has another version of {mission.name!r}, from {there.file}"
        yield here.finding(message, ("reloading the missions, or starting the system again",))
    elif there.problem:
        yield here.finding(f"the running mission server cannot run {mission.name!r}: {there.problem}")
    for node in mission.nodes():
        if isinstance(node, CallMission) and node.mission.text not in served:
            name = node.mission.text
            message = f"the running mission server has no mission {name!r}"
            yield _Need(name, mission, node.mission.position).finding(message, closest_first(name, served))


# ---- skills ---------------------------------------------------------------------------------------------


def _skills_of(missions: Iterable[Mission], library: MissionLibrary) -> list[_Need]:
    """Return every skill that missions use, with the place in each mission from which it is first reached."""
    needs = []
    for mission in missions:
        seen: set[str] = set()
        for node in mission.nodes():
            if isinstance(node, RunSkill):
                found = [(node.skill, "")]
            elif isinstance(node, CallMission):
                found = list(library.skills_below(node.mission.text))
            else:
                continue
            for skill, through in found:
                if skill not in seen:
                    seen.add(skill)
                    needs.append(_Need(skill, mission, node.position, through))
    return needs


def search(client: MissionClient, skills: Collection[ServedSkill], search_s: float) -> None:
    """Serve the client until the servers of some skills are there, or it is known why not.

    Args:
        client: Sees the graph.
        skills: The skills.
        search_s: Wall seconds in which servers are looked for.
    """
    client.spin_until(lambda: all(skill.server_is_there() for skill in skills), search_s)
    if skills:
        client.spin_until(lambda: not client.node.server_graph.waits_for_states(), STATES_S)


def _compare_skills(
    client: MissionClient,
    needs: list[_Need],
    skills: Mapping[str, Skill],
    mappings: Mapping[str, MessageMapping],
) -> list[Finding]:
    findings: list[Finding] = []
    waiting: dict[str, ServedSkill] = {}
    for need in needs:
        skill = skills.get(need.name)
        if skill is None:
            message = f"the robot has no skill {need.name!r}: nothing connects it to a server"
            findings.append(need.finding(message, closest_first(need.name, skills)))
        elif isinstance(skill, ServedSkill):
            waiting[need.name] = skill
    search(client, waiting.values(), SEARCH_S)
    found = ((need, waiting[need.name]) for need in needs if need.name in waiting)
    about = (_about(need, skill, theirs=need.name in mappings) for need, skill in found)
    return findings + [finding for finding in about if finding is not None]


def _about(need: _Need, skill: ServedSkill, *, theirs: bool) -> Finding | None:
    """Say that a skill has no server, or one that does not work, and why; None when all is well."""
    lack = skill.lack()
    if skill.server_is_there():
        message = f"the server of the skill {need.name!r} is not active: {lack.problem}"
        valid = ["configuring and activating it"]
        return need.finding(message, valid, WARNING) if lack.problem else None
    start = ["starting the program that serves it"] if theirs else STARTS
    message = f"the skill {need.name!r} has no server: no {skill.label} was found"
    if lack.wrong_type:
        return need.finding(f"{message}: {lack.problem}", lack.valid)
    return need.finding(f"{message}: {lack.problem}" if lack.problem else message, [*lack.valid, *start])


# ---- hotspots -------------------------------------------------------------------------------------------


def _compare_hotspots(
    client: MissionClient,
    missions: Iterable[Mission],
    labels: Callable[[Mission], Iterable[tuple[str, Position]]],
) -> list[Finding]:
    findings: list[Finding] = []
    known: dict[str, str] = {}
    for mission in missions:
        for label, position in labels(mission):
            need = _Need(label, mission, position)
            if label not in known:
                try:
                    answer = client.call(
                        GetHotspot, _HOTSPOT_SERVICE, GetHotspot.Request(label=label), repeat=True
                    )
                except (SystemNotThere, DeviceTimeout) as error:
                    message = f"the hotspots cannot be compared: {error}"
                    return [*findings, need.finding(message, STARTS, WARNING)]
                known[label] = "" if answer.valid else answer.message or f"there is no hotspot {label!r}"
            if known[label]:
                problem, _, valid = known[label].partition(" (would have worked: ")
                choices = valid.removesuffix(")").split(", ") if valid else ()
                findings.append(need.finding(f"the running locator says: {problem}", choices))
    return findings
