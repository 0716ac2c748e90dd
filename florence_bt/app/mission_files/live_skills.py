"""What of the ROS graph serves skills now, and of which type a name in it is."""

from __future__ import annotations

from collections.abc import Mapping

from rclpy.action import get_action_names_and_types
from rclpy.qos import DurabilityPolicy

from florence_bt.app.bringup.skills_ros import make_skills
from florence_bt.app.mission_files.live_check import SEARCH_S
from florence_bt.app.runs.client import MissionClient
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.ros.served_skill import ServedSkill
from florence_bt.trees.language.loader import MissionLibrary


def servers_now(library: MissionLibrary) -> Mapping[str, str]:
    """Return for each skill whether its server is there now, for people."""
    with MissionClient("florence_skills") as client:
        skills = make_skills(client.node, mappings=library.mappings)
        served = {name: skill for name, skill in skills.items() if isinstance(skill, ServedSkill)}
        client.spin_until(lambda: all(skill.server_is_there() for skill in served.values()), SEARCH_S)
        return {
            name: f"{'there' if skill.server_is_there() else 'NOT THERE'}: {skill.label}"
            for name, skill in served.items()
        }


def type_in_graph(way: str, name: str) -> tuple[str, bool]:
    """Return the type of an action, service or topic of the running system, and whether a topic is latched.

    Raises:
        ConfigError: There is none of that name now; with names that are near.
    """
    with MissionClient("florence_skills") as client:
        node = client.node

        def found() -> dict[str, str]:
            listed = {
                "action": lambda: get_action_names_and_types(node),
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
    latched = any(one.qos_profile.durability is DurabilityPolicy.TRANSIENT_LOCAL for one in publishers)
    return names[whole], latched
