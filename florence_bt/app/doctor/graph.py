"""The ROS graph of a running system: what is there, what is there twice, and what the drivers say."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from florence_bt.app.bringup.topology import NODES, OPTIONAL
from florence_bt.app.doctor.finding import (
    HealthFinding,
    HealthLevel,
    charge_of_battery,
    good,
    note,
    problem,
    warning,
)
from florence_bt.ros.environment import PROFILES, RANGE, reach_of

GROUP = "ROS"
_LEVELS = {0: HealthLevel.OK, 1: HealthLevel.WARNING, 2: HealthLevel.PROBLEM, 3: HealthLevel.PROBLEM}


@dataclass(frozen=True, slots=True)
class GraphView:
    """What was seen of ROS in a few seconds.

    Attributes:
        nodes: Full names, one entry per node.
        clocks: How many nodes publish ``/clock``.
        charge: Share of the battery's charge, 0 to 1; None when it is not published.
        diagnostics: Name -> (level of diagnostic_msgs, message), the newest of each.
    """

    nodes: tuple[str, ...] = ()
    clocks: int = 0
    charge: float | None = None
    diagnostics: Mapping[str, tuple[int, str]] = field(default_factory=dict)


def wanted_nodes() -> list[str]:
    """The names, without namespace, of the nodes that a running system has (of a simulator only it has)."""
    return [
        name
        for group, names in NODES.items()
        if group != "simulator"
        for name in names
        if name not in OPTIONAL
    ]


def missing_nodes(view: GraphView) -> list[str]:
    """Those of :func:`wanted_nodes` that a view lacks, in their order."""
    seen = {name.rsplit("/", 1)[-1] for name in view.nodes}
    return [name for name in wanted_nodes() if name not in seen]


def is_partial(view: GraphView) -> bool:
    """Whether a system is there of which something has not been seen: looking longer may show it."""
    missing = len(missing_nodes(view))
    if missing == len(wanted_nodes()):
        return False
    return missing > 0 or view.charge is None or not view.diagnostics


def check_settings(environment: Mapping[str, str]) -> Iterator[HealthFinding]:
    """The environment variables of ROS."""
    domain = environment.get("ROS_DOMAIN_ID", "0") or "0"
    if not domain.isdigit() or int(domain) > 232:
        yield problem(
            GROUP, "ROS_DOMAIN_ID", f"{domain!r} is not a domain", "export ROS_DOMAIN_ID=0 (0 to 101)"
        )
    else:
        yield good(GROUP, "ROS_DOMAIN_ID", domain)
    reach = reach_of(environment)
    if reach.this_machine:
        yield good(GROUP, "open to", reach.text)
    else:
        yield note(
            GROUP,
            "open to",
            f"{reach.text}: other machines may see and command this robot",
            f"unset {RANGE} {PROFILES} RMW_IMPLEMENTATION, unless that is wanted",
        )


def check_graph(view: GraphView) -> Iterator[HealthFinding]:
    """What a view of the graph means."""
    wanted, missing = wanted_nodes(), missing_nodes(view)
    if len(missing) == len(wanted):
        yield note(GROUP, "system", "is not running", "florence up --sim, or florence up --robot CONFIG")
        return
    if missing:
        yield problem(
            GROUP, "system", f"these nodes are missing: {', '.join(missing)}", "end it and start it again"
        )
    else:
        yield good(GROUP, "system", f"all {len(wanted)} nodes are there")
    yield from _twice(view)
    yield _battery(view.charge)
    for name, (level, message) in sorted(view.diagnostics.items()):
        severity = _LEVELS.get(level, HealthLevel.PROBLEM)
        well = severity is HealthLevel.OK
        advice = "" if well else "see the driver's README.md and its log in the folder of --out"
        yield HealthFinding("drivers", name, severity, message, advice)


def _twice(view: GraphView) -> Iterator[HealthFinding]:
    for name, count in sorted(Counter(view.nodes).items()):
        if count > 1:
            yield problem(
                GROUP,
                name,
                f"there are {count} nodes with this name",
                "end one of the two systems, or give each its own ROS_DOMAIN_ID",
            )
    if view.clocks > 1:
        yield problem(
            GROUP, "/clock", f"{view.clocks} nodes set the simulated time", "end all simulators but one"
        )


def _battery(charge: float | None) -> HealthFinding:
    if charge is None:
        advice = "see the findings about turtlebot_node"
        return warning("battery", "base", "the charge is not published", advice)
    return charge_of_battery(charge, f"{charge:.0%} of its charge")
