"""Processes of ``florence up`` that installed packages bring, such as the page, by Python entry points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

from florence_bt.core.errors import ConfigError
from florence_bt.trees.language.third_party import PROCESSES, ThirdParty

if TYPE_CHECKING:
    from florence_bt.app.bringup.config import Parameters
    from florence_bt.app.bringup.options import BringUp


@dataclass(frozen=True, slots=True, kw_only=True)
class PackageProcess:
    """A process with one node, an observer: when it hangs or dies, nothing stops, and nothing waits for it.

    An entry point of the group ``florence_bt.processes`` names one. Its module is loaded before anything
    starts, so it imports its node only by the name that is given here.

    Attributes:
        name: Of the process.
        node: The node's name.
        node_class: ``module:Class`` of the node, which takes ``parameters``.
        is_wanted: Tells whether a bring-up has it.
        parameters: Returns what the bring-up adds to the configuration of the node.
        check: Reads all that it will read; raises ConfigError for what is wrong.
        told: Returns what is said when the system is up.
    """

    name: str
    node: str
    node_class: str
    is_wanted: Callable[[BringUp], bool]
    parameters: Callable[[BringUp], Parameters]
    check: Callable[[BringUp], None]
    told: Callable[[BringUp], str]


@cache
def package_processes() -> tuple[PackageProcess, ...]:
    """Return the processes that installed packages bring, in the order of their entry points' names.

    Raises:
        ConfigError: A package's process cannot be loaded, or is none.
    """
    packages = ThirdParty()
    found = tuple(process for _, process in packages.processes())
    for finding in packages.findings:
        raise ConfigError(f"{finding.file}: {finding.message}")
    for each in found:
        if not isinstance(each, PackageProcess):
            raise ConfigError(f"an entry point of {PROCESSES} is {each!r}", valid=["a PackageProcess"])
    return found


def wanted_processes(options: BringUp) -> list[PackageProcess]:
    """Return those that a bring-up has."""
    return [each for each in package_processes() if each.is_wanted(options)]
