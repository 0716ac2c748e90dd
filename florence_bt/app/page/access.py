"""Who may use the page: roles, tokens, and what a browser may send."""

from __future__ import annotations

import enum
import hashlib
import hmac
import json
import math
import os
import re
import secrets
import socket
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlencode

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.text_files import decode, read_bytes, replace_text

COOKIE = "florence_token"
ROLE = "florence_role"
"""Key of the role in an ASGI scope."""
LARGEST_REQUEST = 1_000_000
"""Bytes of a request, and of a message on a WebSocket."""
MOST_MESSAGES, MOST_BYTES = 100, 2 * LARGEST_REQUEST
"""What one WebSocket may bring in a second: a text of 100 kB three times, a pad that is dragged, and more."""
MOST_PAGES, PAGES_S = 50, 10.0
"""How often somebody may open a page, and in how many seconds: making one takes some 0.05 s."""
MOST_WORDS = 200
"""How often somebody may ask for words in that time: the editor asks while they type, ten times a second at
most, which takes up to 0.015 s each."""
_WORDS = "/edit/complete"
_PARTS = ("/_nicegui", "/picture/", "/edit/picture/")
"""Where what belongs to a page begins: files and pictures, which cost little."""
_PORT, _LENGTH = re.compile(r":[0-9]*$"), re.compile(r"[0-9]{1,9}")
_TOO_LARGE = "the request is too large"
_MONTH_S = 30 * 86_400

Scope = MutableMapping[str, Any]
Send = Callable[[Mapping[str, Any]], Awaitable[None]]
Receive = Callable[[], Awaitable[Mapping[str, Any]]]
App = Callable[[Scope, Any, Send], Awaitable[None]]


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


def is_loopback(host: str) -> bool:
    """Tell whether only this machine can reach an address."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


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


class Guard:
    """Lets only those through to an ASGI application who may see it, and tells it their role.

    A page of another origin gets nothing, whatever its cookies: neither an answer nor a WebSocket. Without
    tokens a name that leads here by a trick (DNS rebinding) is refused, too.

    Args:
        app: The application.
        access: Who may do what.
    """

    def __init__(self, app: App, access: Access) -> None:
        self._app = app
        self._access = access
        self._opened = _Span(PAGES_S)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or WebSocket."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = {
            name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]
        }
        token = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]
        problem = self._problem_with(headers)
        role = self._access.role_of(token or _cookie(headers))
        if problem or role is None:
            await _refuse(scope, send, problem or "a token is needed: open the page as …/?token=TOKEN")
        elif token and self._access.tokens and scope["type"] == "http":
            await _keep_token(scope, send, token)
        elif scope["type"] == "http" and self._opens_too_much(scope, _cookie(headers)):
            await _refuse(scope, send, f"so much in {PAGES_S:g} s is enough: wait a moment", 429)
        else:
            scope[ROLE] = role
            bounded = _bounded(receive) if scope["type"] == "http" else _metered(receive, send)
            await self._app(scope, bounded, send)

    def _opens_too_much(self, scope: Scope, token: str) -> bool:
        """Count the pages that somebody opens; who that is says the token, and the address."""
        if scope["path"].startswith(_PARTS):
            return False
        host, _ = scope.get("client") or ("", 0)
        known = token if self._access.tokens else ""
        what, most = ("words", MOST_WORDS) if scope["path"] == _WORDS else ("pages", MOST_PAGES)
        return self._opened.add(f"{what} {host} {known}") > most

    def _problem_with(self, headers: Mapping[str, str]) -> str:
        host = headers.get("host", "")
        origin = headers.get("origin")
        if origin is not None and origin.partition("://")[2] != host:
            return "pages of another origin are not served"
        if not self._access.tokens and not is_loopback(_PORT.sub("", host.lower())):
            return "this page is for this machine: open http://localhost"
        length = headers.get("content-length", "0")
        return "" if _LENGTH.fullmatch(length) and int(length) <= LARGEST_REQUEST else _TOO_LARGE


def _cookie(headers: Mapping[str, str]) -> str:
    from starlette.requests import cookie_parser  # of an extra, like the page

    return cookie_parser(headers.get("cookie", "")).get(COOKIE, "")


def _bounded(receive: Receive) -> Receive:
    """Refuse a request that turns out to be too large: it need not have said how long it is."""
    from fastapi import HTTPException

    received = 0

    async def receive_more() -> Mapping[str, Any]:
        nonlocal received
        message = await receive()
        received += len(message.get("body", b""))
        if received > LARGEST_REQUEST:
            raise HTTPException(413, _TOO_LARGE)
        return message

    return receive_more


def _metered(receive: Receive, send: Send) -> Receive:
    """Close a WebSocket that brings more in a second than it may, before any of it is decoded."""
    second = _Span(1.0)

    async def receive_more() -> Mapping[str, Any]:
        message = await receive()
        if message["type"] != "websocket.receive":
            return message
        size = len(message.get("text") or message.get("bytes") or b"")
        if second.add("messages") <= MOST_MESSAGES and second.add("bytes", size) <= MOST_BYTES:
            return message
        await send({"type": "websocket.close", "code": 1008, "reason": "too much at once"})
        return {"type": "websocket.disconnect", "code": 1008}

    return receive_more


class _Span:
    """Counts what comes in a span of time; after it, counting begins anew."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._end = -math.inf
        self._counts: Counter[str] = Counter()

    def add(self, what: str, amount: int = 1) -> int:
        """Count; gives how much there is of it in this span."""
        now = time.monotonic()
        if now >= self._end:
            self._end = now + self._seconds
            self._counts.clear()
        self._counts[what] += amount
        return self._counts[what]


async def _refuse(scope: Scope, send: Send, why: str, status: int = 403) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008, "reason": why})
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8")]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": f"{why}\n".encode()})


async def _keep_token(scope: Scope, send: Send, token: str) -> None:
    """Let the browser keep the token in a cookie, and take it out of the address."""
    query = {key: value for key, value in parse_qs(scope["query_string"].decode()).items() if key != "token"}
    rest = f"?{urlencode(query, doseq=True)}" if query else ""
    cookie = f"{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/; Max-Age={_MONTH_S}"
    headers = [(b"location", f"{scope['path']}{rest}".encode()), (b"set-cookie", cookie.encode())]
    await send({"type": "http.response.start", "status": 303, "headers": headers})
    await send({"type": "http.response.body", "body": b""})
