"""Names of topics, services and actions as people write them; without ROS, so that the check knows them."""

from __future__ import annotations

import re

from florence_bt.core.errors import ConfigError

_NAME = re.compile(r"(?:~/|/)?[A-Za-z_]\w*(?:/[A-Za-z_]\w*)*", re.ASCII)


def check_ros_name(name: str) -> None:
    """Refuse what is not the name of a topic, service or action.

    Args:
        name: The name, whole or not; ``~/`` is the namespace of the node itself.

    Raises:
        ConfigError: It is none; with what may be meant.

    Source: https://design.ros2.org/articles/topic_and_service_names.html, ROS 2 names.
    """
    if _NAME.fullmatch(name):
        return
    parts = [re.sub(r"\W+", "_", part, flags=re.ASCII) for part in name.split("/") if part]
    known = "/".join(f"n{part}" if part[0].isdigit() else part for part in parts)
    problem = f"{name!r} is not a name of ROS: letters, digits and _ between /, no digit at first"
    raise ConfigError(problem, valid=[known] if _NAME.fullmatch(known) else ["robot/arm"])
