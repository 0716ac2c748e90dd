"""Skills that the ROS graph serves now, and the type of a name in it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from rclpy.qos import DurabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.app.mission_files.live_check import SEARCH_S, search
from florence_bt.app.mission_files.skill_draft import Offer
from florence_bt.app.runs.client import MissionClient
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.ros.served_skill import ServedSkill, server_text
from florence_bt.trees.language.loader import MissionLibrary

NODES_SEARCH_S = 3.0
"""So long other nodes are looked for, when any may be there."""
_EVERYWHERE = re.compile(
    r" /(rosout|parameter_events|clock) |/_action/| (rcl|type_description)_interfaces/| /florence_"
)
"""Names that every node has, the parts of actions, and the mission server itself."""


def servers_now(library: MissionLibrary) -> Mapping[str, str]:
    """Return for each skill whether its server is there now, for people: those of files first.

    Of what comes with Florence only those with a server are named: nobody asked for the others.
    """
    with MissionClient("florence_skills") as client:
        skills = make_skills(client.node, mappings=library.mappings)
        served = {name: skill for name, skill in skills.items() if isinstance(skill, ServedSkill)}
        theirs = {name for name, mapping in library.mappings.items() if not mapping.stock}
        search(client, [served[name] for name in theirs & served.keys()], SEARCH_S)
        now: dict[str, str] = {}
        for name in sorted(served, key=lambda name: (name not in theirs, name)):
            if served[name].server_is_there():
                now[name] = f"there: {server_text(served[name])}"
            elif name in theirs:
                wrong = served[name].lack().wrong_type
                now[name] = f"{'WRONG TYPE' if wrong else 'NOT THERE'}: {server_text(served[name])}"
        return now


def offered() -> list[Offer]:
    """Return what the running system has for skills."""
    with MissionClient("florence_skills") as client:
        node = client.node
        client.spin_until(lambda: False, NODES_SEARCH_S)
        found = [Offer("action", name, types[0]) for name, types in node.get_action_names_and_types()]
        found += [Offer("service", name, types[0]) for name, types in node.get_service_names_and_types()]
        for name, types in node.get_topic_names_and_types():
            theirs = [
                each for each in node.get_publishers_info_by_topic(name) if each.node_name != node.get_name()
            ]
            found.append(Offer("condition" if theirs else "publish", name, types[0], _is_latched(theirs)))
    return sorted(
        (offer for offer in found if not _EVERYWHERE.search(str(offer))), key=lambda offer: str(offer)
    )


def _is_latched(publishers: Iterable[TopicEndpointInfo]) -> bool:
    return any(one.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL for one in publishers)


def type_in_graph(way: str, name: str) -> tuple[str, bool]:
    """Return the type of an action, service or topic of the running system, and whether a topic is latched.

    Raises:
        ConfigError: There is none of that name now; with names that are near.
    """
    with MissionClient("florence_skills") as client:
        node = client.node

        def found() -> dict[str, str]:
            listed = {
                "action": node.get_action_names_and_types,
                "service": node.get_service_names_and_types,
            }.get(way, node.get_topic_names_and_types)()
            return {each: types[0] for each, types in listed}

        whole = node.resolve_topic_name(name)
        client.spin_until(lambda: whole in found(), SEARCH_S)
        names = found()
        publishers = [] if way in ("action", "service") else node.get_publishers_info_by_topic(whole)
    if whole not in names:
        what = way if way in ("action", "service") else "topic"
        problem = f"there is no {what} {whole} now; its type can be given too"
        raise ConfigError(problem, valid=[*closest_first(whole, names), f"{name} nav2_msgs/action/Spin"])
    return names[whole], _is_latched(publishers)
