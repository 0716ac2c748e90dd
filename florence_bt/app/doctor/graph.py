"""The ROS graph of a running system: what is there, what is there twice, and what the drivers say."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from florence_bt.app.bringup.options import STARTS
from florence_bt.app.bringup.topology import (
    DEVICE_NODES,
    MAPPING,
    NODES,
    OPTIONAL,
    RECORDER,
    WITHOUT_MAPPING,
)
from florence_bt.app.doctor.finding import (
    HealthFinding,
    HealthLevel,
    charge_of_battery,
    good,
    note,
    problem,
    warning,
)
from florence_bt.core.topic_names import CLOCK
from florence_bt.ros.arguments import where_else
from florence_bt.ros.environment import PROFILES, RANGE, reach_of

GROUP = "ROS"
_LEVELS = {0: HealthLevel.OK, 1: HealthLevel.WARNING, 2: HealthLevel.PROBLEM, 3: HealthLevel.PROBLEM}


@dataclass(frozen=True, slots=True)
class GraphView:
    """A view of ROS, taken in a few seconds.

    Attributes:
        nodes: Full names, one entry per node of our namespace.
        clocks: How many nodes publish ``/clock``.
        charge: Share of the battery's charge, 0 to 1; None when it is not published.
        diagnostics: Name -> (level of diagnostic_msgs, message), the newest of each.
        elsewhere: Other namespaces in which a mission server is.
    """

    nodes: tuple[str, ...] = ()
    clocks: int = 0
    charge: float | None = None
    diagnostics: Mapping[str, tuple[int, str]] = field(default_factory=dict)
    elsewhere: tuple[str, ...] = ()


NAV2 = frozenset({"bt_navigator", "controller_server", "planner_server"})
"""Nodes of a Nav2 that drives in place of Florence's navigation (``--nav nav2``)."""


def has_only_missions(view: GraphView) -> bool:
    """Tell whether nothing is there but the mission server and the places, as with ``--missions-only``."""
    seen = _names(view)
    rest = {name for group, names in NODES.items() if group != "missions" for name in names}
    beside = {"florenceLocator", "home_sensors", RECORDER}
    return bool(seen & {*NODES["missions"]}) and not seen & (rest - beside)


def absent_groups(view: GraphView) -> set[str]:
    """Return the processes that a running system does without, such as the simulator on a robot."""
    seen = _names(view)
    if has_only_missions(view):
        return {*NODES} - {"missions"}
    absent = {group for group in ("simulator", "navigation", "hardware") if not seen & set(NODES[group])}
    return absent if seen & NAV2 else absent & {"simulator"}


def wanted_nodes(view: GraphView) -> list[str]:
    """Return the names, without namespace, of the nodes that such a running system has."""
    absent, seen = absent_groups(view), _names(view)
    others = WITHOUT_MAPPING if seen & {*MAPPING} else MAPPING
    return [
        name
        for group, names in NODES.items()
        if group not in absent
        for name in names
        if name not in OPTIONAL and name not in others
    ]


def missing_nodes(view: GraphView) -> list[str]:
    """Return those of :func:`wanted_nodes` that a view lacks, in their order."""
    seen = _names(view)
    return [name for name in wanted_nodes(view) if name not in seen]


def silent_drivers(view: GraphView) -> list[str]:
    """Return the drivers that are there and say nothing of how they do."""
    heard = {name.partition(":")[0] for name in view.diagnostics}
    return [name for name in DEVICE_NODES if name in _names(view) and name not in heard]


def _names(view: GraphView) -> set[str]:
    return {name.rsplit("/", 1)[-1] for name in view.nodes}


def why_devices_are_not_used(view: GraphView) -> str | None:
    """Tell why the configured devices do not concern the running system; None when they do."""
    if _names(view) & set(NODES["simulator"]):
        return "a simulation or rehearsal is running, on devices of its own"
    if "hardware" in absent_groups(view):
        return "the base and the sensors of the running system have drivers of their own"
    return None


def is_partial(view: GraphView) -> bool:
    """Tell whether a system is there of which something has not been seen: looking longer may show it."""
    if has_only_missions(view):
        return True  # or the other processes have not been discovered yet
    missing = len(missing_nodes(view))
    if missing == len(wanted_nodes(view)):
        return False
    silent = view.charge is None or not view.diagnostics or silent_drivers(view)
    return missing > 0 or (bool(silent) and "hardware" not in absent_groups(view))


def check_settings(environment: Mapping[str, str]) -> Iterator[HealthFinding]:
    """Check the environment variables of ROS."""
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
    """Report what a view of the graph means."""
    missing = missing_nodes(view)
    if len(missing) == len(wanted_nodes(view)):
        advice = where_else(view.elsewhere) or ", or ".join(STARTS)
        yield note(GROUP, "system", "is not running", advice)
        return
    if missing:
        yield problem(
            GROUP, "system", f"these nodes are missing: {', '.join(missing)}", "end it and start it again"
        )
    else:
        yield good(GROUP, "system", "is running, with every node")
    yield from _twice(view)
    if view.charge is not None or "hardware" not in absent_groups(view):
        yield _battery(view.charge)
    for name in silent_drivers(view):
        advice = "see its log in the folder of --out; end the system and start it again"
        yield problem("drivers", name, "is there and says nothing: it hangs, or does not get through", advice)
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
                "end one of the two systems, or give each its own --namespace or ROS_DOMAIN_ID",
            )
    if view.clocks > 1:
        yield problem(
            GROUP, CLOCK, f"{view.clocks} nodes set the simulated time", "end all simulators but one"
        )


def _battery(charge: float | None) -> HealthFinding:
    if charge is None:
        advice = "see the findings about turtlebot_node"
        return warning("battery", "base", "the charge is not published, or not known", advice)
    return charge_of_battery(charge, f"{charge:.0%} of its charge")
