"""The door for names from the graph, which other people's programs give, in a domain that is not ours alone.

DDS lets a name be anything; rcl raises for one that ROS does not allow (``//double``, ``/1abc``), wherever it
is used next. So names are looked at where they come in: what is odd is left out, and told once.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable

from rclpy.exceptions import (
    InvalidNamespaceException,
    InvalidNodeNameException,
    InvalidTopicNameException,
)
from rclpy.validate_full_topic_name import validate_full_topic_name
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

_TYPE = re.compile(r"[A-Za-z]\w*/(msg|srv|action)/[A-Za-z]\w*", re.ASCII)


class GraphNames:
    """Lets in what has a name that ROS allows.

    Args:
        say: Is told of each odd name, once.
    """

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say = say
        self._told: set[tuple[str, str]] = set()

    def typed(self, what: str, found: Iterable[tuple[str, list[str]]]) -> list[tuple[str, list[str]]]:
        """Return the topics, services or actions among those found, with their types; each has at least one.

        Args:
            what: What they are, for people, e.g. ``topic``.
            found: Names and types, as rclpy gives them.
        """
        let_in = []
        for name, types in found:
            problem = _problem_with_name(name)
            known = [each for each in types if _TYPE.fullmatch(each)]
            if not problem and not known:
                problem = f"of the type {', '.join(map(repr, types)) or 'nobody knows'}"
            if problem:
                self._leave_out(what, name, problem)
            else:
                let_in.append((name, known))
        return let_in

    def nodes(self, found: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
        """Return the nodes among those found: names and namespaces."""
        let_in = []
        for name, namespace in found:
            try:
                validate_node_name(name)
                validate_namespace(namespace)
            except (InvalidNodeNameException, InvalidNamespaceException) as error:
                self._leave_out("node", f"{namespace}/{name}", _reason_of(error))
            else:
                let_in.append((name, namespace))
        return let_in

    def _leave_out(self, what: str, name: str, problem: str) -> None:
        if (what, name) not in self._told:
            self._told.add((what, name))
            self._say(f"the {what} {name!r} of another program is left out: {problem}")


def _problem_with_name(name: str) -> str:
    try:
        validate_full_topic_name(name)
    except InvalidTopicNameException as error:
        return _reason_of(error)
    return ""


def _reason_of(error: Exception) -> str:
    """Return why rclpy refuses a name; its next lines show the place."""
    return str(error).partition("\n")[0].rstrip(":")
