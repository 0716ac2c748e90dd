"""Who may use the page: roles and tokens."""

from __future__ import annotations

import enum
import hashlib
import hmac
import json
import os
import secrets
import socket
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.guard.guard import COOKIE as COOKIE
from florence_bt.app.guard.guard import ROLE as ROLE
from florence_bt.app.guard.rules import is_loopback
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.text_files import decode, read_bytes, replace_text


class Role(enum.IntEnum):
    """A level of rights; each includes those before."""

    LOOK = 1
    RUN = 2
    EDIT = 3


def tokens_file() -> Path:
    """Return the file with the fingerprints of the tokens of this user."""
    base = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(base) / "florence" / "page_tokens.json"


def make_token(role: str, file: Path) -> str:
    """Make a token and add its fingerprint to a file.

    Args:
        role: ``look``, ``run`` or ``edit``.
        file: The file; made when needed.

    Returns:
        The token; it is kept nowhere.

    Raises:
        ConfigError: There is no such role, or the file cannot be read or written.
    """
    names = [each.name.lower() for each in Role]
    if role not in names:
        raise ConfigError(f"there is no role {role!r}", valid=closest_first(role, names))
    known = read_tokens(file) if file.exists() else {}
    token = secrets.token_urlsafe(24)
    known[_fingerprint(token)] = Role[role.upper()]
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        replace_text(file, json.dumps({key: value.name.lower() for key, value in known.items()}, indent=1))
    except OSError as error:
        raise ConfigError(
            f"the tokens cannot be kept: {error.strerror}", file=file, valid=["a file that can be written to"]
        ) from error
    return token


def read_tokens(file: Path) -> dict[str, Role]:
    """Read the fingerprints of the tokens.

    Raises:
        ConfigError: The file cannot be read, or is none of these.
    """
    try:
        found = json.loads(decode(read_bytes(file), file))
        return {key: Role[value.upper()] for key, value in found.items()}
    except (ValueError, KeyError, AttributeError) as error:
        raise ConfigError(
            "this is no file of tokens", file=file, valid=["florence page --token run, after removing it"]
        ) from error


def user_access() -> Access:
    """Return who may do what by the tokens of this user.

    Raises:
        ConfigError: Their file cannot be read, or is none.
    """
    file = tokens_file()
    return Access(read_tokens(file) if file.exists() else {})


def _fingerprint(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()


def address_of(host: str, port: int) -> str:
    """Return the address of the page, for people."""
    return f"http://{'localhost' if is_loopback(host) else host}:{port}"


@dataclass(frozen=True, slots=True)
class Access:
    """The tokens, and the role of each.

    Attributes:
        tokens: Fingerprint of each token -> its role; without any, whoever is on this machine may do all.
    """

    tokens: Mapping[str, Role]

    def role_of(self, token: str) -> Role | None:
        """Return the role of a token; None when it is none of ours."""
        if not self.tokens:
            return Role.EDIT
        mark = _fingerprint(token)
        return next((role for known, role in self.tokens.items() if hmac.compare_digest(known, mark)), None)


def check_page(host: str, port: int, access: Access) -> None:
    """Check whether the page can be served.

    Raises:
        ConfigError: Others could reach the page without a token, or the port is taken.
    """
    if not is_loopback(host) and not access.tokens:
        raise ConfigError(
            f"with the host {host} anybody on the network could drive the robot: the page needs tokens there",
            valid=["florence page --token run", "the host 127.0.0.1"],
        )
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        socket.create_server((host, port), family=family).close()
    except OSError as error:
        raise ConfigError(
            f"the page cannot be served at {host}, port {port}: {error.strerror}", valid=["another port"]
        ) from error
