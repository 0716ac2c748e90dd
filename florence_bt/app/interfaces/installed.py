"""The packages of ROS interfaces that are installed here, and what their types define."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.interfaces.building import ADDED, KINDS, SET_UP, Environment
from florence_bt.core.errors import ConfigError, closest_first

_INDEX = Path("share") / "ament_index" / "resource_index" / "rosidl_interfaces"
_NAME = re.compile(r"([a-z][a-z0-9_]*)/(?:(msg|srv|action)/)?([A-Z][A-Za-z0-9]*)")
FIELD = re.compile(r"\s*([A-Za-z][A-Za-z0-9_/]*)[^\s#]*\s+[a-z]")
"""A line that defines a field, with its type in the group."""


@dataclass(frozen=True)
class InstalledPackage:
    """A package of interfaces that is installed.

    Attributes:
        name: Its name.
        prefix: The folder that it is installed in, with ``lib`` and ``share``.
        types: Its types, such as ``msg/String``.
    """

    name: str
    prefix: Path
    types: tuple[str, ...]

    def file(self, kind: str, last: str) -> Path:
        """Return the definition of a type."""
        return self.prefix / "share" / self.name / kind / f"{last}.{kind}"

    @property
    def origin(self) -> str:
        """Say where it comes from, for people."""
        here = Environment(self.prefix, self.prefix, ADDED)
        if here.files_list(self.name).is_file():
            return "florence interfaces add"
        if Environment(self.prefix, self.prefix, SET_UP).files_list(self.name).is_file():
            return "make setup"
        return "Python package" if self.prefix == Path(sys.prefix) else str(self.prefix)


def sourced() -> list[Path]:
    """Return the folders of the ROS 2 that is sourced in this shell, the first one first."""
    return [Path(place) for place in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if place]


def installed_packages() -> dict[str, InstalledPackage]:
    """Return the packages of interfaces by name; a sourced ROS 2 comes before the environment."""
    found: dict[str, InstalledPackage] = {}
    for prefix in [*sourced(), Path(sys.prefix)]:
        for entry in sorted((prefix / _INDEX).glob("*")):
            words = (Path(line) for line in entry.read_text(encoding="utf-8").split())
            types = sorted({str(word.with_suffix("")) for word in words if word.parent.name in KINDS})
            found.setdefault(entry.name, InstalledPackage(entry.name, prefix, tuple(types)))
    return dict(sorted(found.items()))


def list_packages() -> str:
    """Return a table of the installed packages: how many types each has, and where it comes from."""
    lines = [f"{'package':<30} {'msg':>4} {'srv':>4} {'action':>6}  from"]
    for package in installed_packages().values():
        count = [sum(each.startswith(f"{kind}/") for each in package.types) for kind in KINDS]
        numbers = " ".join(
            f"{number or '-':>{width}}" for number, width in zip(count, (4, 4, 6), strict=True)
        )
        lines.append(f"{package.name:<30} {numbers}  {package.origin}")
    return "\n".join(lines)


def show_package(package: InstalledPackage) -> str:
    """Return the types of a package, as they are written elsewhere."""
    return "\n".join(f"{package.name}/{each}" for each in package.types)


def show(name: str) -> str:
    """Return the definition of a type with the fields of its fields, or the types of a package.

    Args:
        name: ``nav2_msgs/action/Spin``, ``nav2_msgs/Spin`` or ``nav2_msgs``.

    Raises:
        ConfigError: There is no such package or type, or the name has another form.
    """
    packages = installed_packages()
    if name in packages:
        return show_package(packages[name])
    match = _NAME.fullmatch(name)
    if match is None:
        valid = [*closest_first(name, packages), "nav2_msgs/action/Spin"]
        raise ConfigError(f"{name!r} is neither an installed package nor a type", valid=valid)
    owner, kind, last = match.groups()
    if owner not in packages:
        valid = [*closest_first(owner, packages), "florence interfaces add FOLDER"]
        raise ConfigError(f"the interface package {owner!r} is not installed", valid=valid)
    types = packages[owner].types
    fitting = [each for each in types if each == f"{kind}/{last}" or (not kind and each.endswith(f"/{last}"))]
    if not fitting:
        close = closest_first(last, [each.partition("/")[2] for each in types])
        near = [f"{owner}/{each}" for each in types if each.partition("/")[2] in close]
        raise ConfigError(f"{owner} has no type {last!r}", valid=near)
    return "\n".join(
        f"# {owner}/{each}\n" + "\n".join(_definition(packages, owner, *each.split("/"))) for each in fitting
    )


def _definition(
    packages: dict[str, InstalledPackage], owner: str, kind: str, last: str, indent: str = ""
) -> Iterator[str]:
    """Yield the lines of a definition; below a field of another type, indented, those of that type."""
    text = packages[owner].file(kind, last).read_text(encoding="utf-8")
    for line in text.rstrip().splitlines():
        if indent and (not line.strip() or line.lstrip().startswith("#")):
            continue
        yield f"{indent}{line.rstrip()}"
        field = FIELD.match(line)
        if field is None:
            continue
        package, _, message = field[1].rpartition("/")
        package = package or owner
        if package in packages and f"msg/{message}" in packages[package].types:
            yield from _definition(packages, package, "msg", message, f"{indent}    ")
