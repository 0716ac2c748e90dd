"""The definition of a message type with those of its fields, as recordings carry it.

Source: MCAP specification, well-known message encodings and schema encodings, ``ros2msg``.
"""

from __future__ import annotations

from functools import cache

from florence_bt.app.interfaces.installed import FIELD, InstalledPackage, installed_packages
from florence_bt.core.errors import ConfigError

_BETWEEN = "=" * 80 + "\nMSG: "


@cache
def _packages() -> dict[str, InstalledPackage]:
    return installed_packages()


def message_schema(name: str) -> str:
    """Return the definition of a message type, followed by those of the types that it consists of.

    Args:
        name: ``sensor_msgs/msg/LaserScan``.

    Raises:
        ConfigError: The package or the type is not installed here.
    """
    owner, _, last = name.partition("/msg/")
    text = _definition(owner, last)
    parts = {(owner, last): text}
    _collect(owner, text, parts)
    (_, first), *others = parts.items()
    return "\n".join([first, *(f"{_BETWEEN}{package}/{kind}\n{body}" for (package, kind), body in others)])


def _collect(owner: str, text: str, parts: dict[tuple[str, str], str]) -> None:
    """Add the definitions of the fields of a definition, each once."""
    for line in text.splitlines():
        field = FIELD.match(line)
        if field is None:
            continue
        package, _, last = field[1].rpartition("/")
        key = (package or owner, last)
        if key in parts or key[0] not in _packages() or f"msg/{last}" not in _packages()[key[0]].types:
            continue
        parts[key] = _definition(*key)
        _collect(key[0], parts[key], parts)


def _definition(owner: str, last: str) -> str:
    package = _packages().get(owner)
    if package is None or f"msg/{last}" not in package.types:
        raise ConfigError(
            f"the message type {owner}/msg/{last} is not installed here", valid=["florence interfaces add"]
        )
    return package.file("msg", last).read_text(encoding="utf-8")
