"""Rules of admission: what a request says about itself, and what speaks against it. No port, no clock.

A browser tells by ``Origin`` and ``Sec-Fetch-Site`` which site a request comes from, and by ``Host`` under
which name it got here; a page of another site can neither leave these out nor choose them. Other programs
say what they like: against them there are tokens, and the bounds of the connections.

Sources: RFC 9112 (request target, Host), RFC 6454 (Origin), W3C Fetch Metadata Request Headers.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Any

LARGEST_REQUEST = 1_000_000
"""Bytes of a request, and of a message on a WebSocket."""
TOO_LARGE = "the request is too large"
SHOWN = 80
"""Characters of what came from outside that are said again."""

SHIELD = {
    b"content-security-policy": (
        b"frame-ancestors 'none'; base-uri 'self'; form-action 'self'; object-src 'none'"
    ),
    b"x-frame-options": b"DENY",
    b"x-content-type-options": b"nosniff",
    b"referrer-policy": b"same-origin",
    b"cross-origin-opener-policy": b"same-origin",
    b"cross-origin-resource-policy": b"same-origin",
}
"""Headers of every answer: no other site may frame it, embed it, hold its window, or learn its address."""

_HOST = re.compile(r"(\[[0-9a-f:.]+\]|[a-z0-9_](?:[a-z0-9._-]*[a-z0-9_-])?)\.?(:[0-9]{1,5})?")
_LENGTH = re.compile(r"[0-9]{1,9}")
_UNSAFE = re.compile(r"[\x00-\x1f\x7f\\]")
_PREFIX = re.compile(r"(?:/[A-Za-z0-9_-]+)*")
_ONCE = ("host", "origin", "content-length", "x-forwarded-prefix")
"""Headers that are believed, and therefore may not come twice: who is behind might believe the other one."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """The reason for which somebody is not let in.

    Attributes:
        why: For people; says what would have worked.
        status: Of HTTP.
    """

    why: str
    status: int = 403


class Request:
    """An HTTP request, or that for a WebSocket, as it describes itself.

    Args:
        scope: Of ASGI.
    """

    def __init__(self, scope: Mapping[str, Any]) -> None:
        self.is_websocket = scope["type"] == "websocket"
        self.method: str = scope.get("method", "GET")
        self.path: str = scope["path"]
        self.headers: dict[str, str] = {}
        self.doubles: set[str] = set()
        for name, value in scope["headers"]:
            key = name.decode("latin-1").lower()
            if key in self.headers:
                self.doubles.add(key)
            self.headers[key] = value.decode("latin-1")

    @property
    def host(self) -> str:
        """The name and port that it was sent to, in small letters; empty when there is none."""
        return self.headers.get("host", "").lower()

    @property
    def origin(self) -> str | None:
        """The site whose page has sent it; None when it does not say."""
        origin = self.headers.get("origin")
        return None if origin is None else origin.lower()

    @property
    def is_of_another_site(self) -> bool:
        """Tell whether another site is behind it, as the browser says: an address, a picture, frame or link.

        Another port of this machine is another site, too. Browsers from before 2023 have no
        ``Sec-Fetch-Site``, and tell the page that it comes from.
        """
        site = self.headers.get("sec-fetch-site")
        if site is not None:
            return site.lower() not in ("same-origin", "none")
        page = self.headers.get("referer", "").lower()
        return bool(page) and page.partition("://")[2].partition("/")[0] != self.host

    @property
    def opens_a_page(self) -> bool:
        """Tell whether a person has followed a link to it, in a window of its own: nothing of it is told
        elsewhere.
        """
        if self.is_websocket or self.method not in ("GET", "HEAD"):
            return False
        if "sec-fetch-site" not in self.headers:
            return "text/html" in self.headers.get("accept", "")
        purpose = self.headers.get("sec-purpose", "") + self.headers.get("purpose", "")
        kind = (self.headers.get("sec-fetch-mode"), self.headers.get("sec-fetch-dest"))
        return kind == ("navigate", "document") and "prefetch" not in purpose


def is_loopback(host: str) -> bool:
    """Tell whether only this machine can reach an address."""
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def refusal_of(
    request: Request, *, only_here: bool, with_token: bool, origins: frozenset[str], hint: str = ""
) -> Refusal | None:
    """Look for what speaks against a request.

    Args:
        request: The request.
        only_here: Whether it must have been sent to a name of this machine.
        with_token: Whether its address has a token: nobody but the person themselves may open such a one.
        origins: Other origins that are let in, in small letters.
        hint: What else would have worked where an origin is refused.

    Returns:
        Why it is refused; None when nothing speaks against it.
    """
    twice = request.doubles.intersection(_ONCE)
    name = _HOST.fullmatch(request.host)
    length = request.headers.get("content-length", "0")
    if twice:
        return Refusal(f"{min(twice)} is there twice", 400)
    if not request.path.startswith("/") or request.path.startswith("//") or _UNSAFE.search(request.path):
        return Refusal("this is no path: ask for /", 400)
    if name is None:
        return Refusal("the request says no host: open http://localhost")
    if only_here and not is_loopback(name[1]):
        return Refusal("this page is for this machine: open http://localhost")
    if not _PREFIX.fullmatch(request.headers.get("x-forwarded-prefix", "")):
        return Refusal("x-forwarded-prefix is no path", 400)
    if not (_LENGTH.fullmatch(length) and int(length) <= LARGEST_REQUEST):
        return Refusal(TOO_LARGE)
    return _foreign(request, with_token, origins, hint)


def _foreign(request: Request, with_token: bool, origins: frozenset[str], hint: str) -> Refusal | None:
    """Look for another site behind a request."""
    origin = request.origin
    if origin is not None and origin in origins:
        return None
    if origin is not None and origin not in (f"http://{request.host}", f"https://{request.host}"):
        return Refusal(f"pages of another origin ({origin[:SHOWN]}) are not served{hint}")
    if not request.is_of_another_site:
        return None
    if not request.opens_a_page:
        return Refusal("pages of another site are not served: open this one by its own address")
    if with_token:
        return Refusal("a token is not taken from a link of another site: copy its address into the browser")
    return None
