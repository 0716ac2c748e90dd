"""The guard: what a request must pass before an application sees it, and what every answer carries."""

from __future__ import annotations

import logging
import math
import time
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from typing import Any, Protocol
from urllib.parse import parse_qs, quote, urlencode

from florence_bt.app.guard.rules import (
    LARGEST_REQUEST,
    SHIELD,
    SHOWN,
    TOO_LARGE,
    Refusal,
    Request,
    refusal_of,
)

COOKIE = "florence_token"
ROLE = "florence_role"
"""Key of the role in an ASGI scope."""
MOST_MESSAGES, MOST_BYTES = 100, 2 * LARGEST_REQUEST
"""Limits of one WebSocket in a second: a text of 100 kB three times, a pad that is dragged, and more."""
SPAN_S = 10.0
"""Seconds in which is counted what somebody asks for."""
MOST_PAGES = 50
"""Pages that somebody may open in that time: making one takes some 0.05 s."""
MOST_WORDS = 200
"""Questions for words that somebody may ask: the editor asks while they type, ten times a second at most,
which takes up to 0.015 s each."""
MOST_PARTS = 1_500
"""Files and pictures that somebody may get: a page has some 30 of them, and keeps most."""
MOST_LINKS = 10
"""Visits by a link of another site: a site that opens windows has a count of its own."""
MOST_HANDSHAKES = 200
"""WebSockets that somebody may ask for: a page has two, which come again and again after a break."""
MOST_SOCKETS = 150
"""WebSockets that are open at once, of all: those of 50 viewers, and of the editor."""
_MONTH_S = 30 * 86_400
_LOG = logging.getLogger("florence_bt.guard")

Scope = MutableMapping[str, Any]
Send = Callable[[Mapping[str, Any]], Awaitable[None]]
Receive = Callable[[], Awaitable[Mapping[str, Any]]]
App = Callable[[Scope, Any, Send], Awaitable[None]]
Check = Callable[[str, Mapping[str, Any]], str]
"""Takes the path of a WebSocket and a message on it, and tells what is wrong with it; nothing gives no
text."""


class Roles(Protocol):
    """The rights of each viewer; those of the page are ``Access`` of florence_page."""

    @property
    def tokens(self) -> Mapping[str, Any]:
        """The role of each token; without any, whoever is on this machine may do all."""

    def role_of(self, token: str) -> Any:
        """Return the role of a token; None when it is none of ours."""


class NoTokens:
    """Of a port that has no tokens: whoever is on this machine may do what can be done there."""

    tokens: Mapping[str, Any] = {}

    def role_of(self, token: str) -> str:
        """Return a role."""
        return "anybody"


class Guard:
    """Lets only those through to an ASGI application who may see it, and tells it their role.

    A page of another site gets nothing, whatever its cookies, and counts for nobody's bounds; without
    tokens a name that leads here by a trick (DNS rebinding) is refused, too.

    Args:
        app: The application.
        access: Who may do what.
        origins: Other origins that are let in, such as ``file://``.
        hint: What else would have worked, for those whose origin is not let in.
        parts: How the paths begin of what belongs to a page: files and pictures, which cost little.
        words: The path that gives words while somebody types.
        urgent: How the paths begin of what stops something: whoever may ask for that is never told to wait.
        check: Looks at each message of a WebSocket.
        most_messages: How many messages a WebSocket may bring in a second.
    """

    def __init__(
        self,
        app: App,
        access: Roles,
        *,
        origins: frozenset[str] = frozenset(),
        hint: str = "",
        parts: tuple[str, ...] = (),
        words: str = "",
        urgent: tuple[str, ...] = (),
        check: Check = lambda path, message: "",
        most_messages: int = MOST_MESSAGES,
    ) -> None:
        self._app = app
        self._access = access
        self._origins = frozenset(each.lower() for each in origins)
        self._hint = hint
        self._parts = parts
        self._words = words
        self._urgent = urgent
        self._check = check
        self._most_messages = most_messages
        self._asked = Span(SPAN_S)
        self._sockets = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request or WebSocket."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        answer = Answer(scope, send)
        request = Request(scope)
        token = parse_qs(scope["query_string"].decode("latin-1")).get("token", [""])[0]
        refusal = refusal_of(
            request,
            only_here=not self._access.tokens,
            with_token=bool(token and self._access.tokens),
            origins=self._origins,
            hint=self._hint,
        )
        shown = token or _cookie(request, self._access)
        role = None if refusal else self._access.role_of(shown)
        if refusal is None and role is None:
            refusal = Refusal("a token is needed: open the page as …/?token=TOKEN")
        if refusal is None and self._asks_too_much(scope, request, shown):
            refusal = Refusal(f"so much in {SPAN_S:g} s is enough: wait a moment", 429)
        if refusal is not None:
            _LOG.warning("%s was refused: %s", request.path[:SHOWN], refusal.why)
            await answer.refuse(refusal)
        elif token and self._access.tokens and not request.is_websocket:
            await _keep_token(scope, answer, token)
        else:
            scope[ROLE] = role
            await self._serve(scope, receive, answer)

    async def _serve(self, scope: Scope, receive: Receive, answer: Answer) -> None:
        """Let somebody through, within bounds."""
        is_websocket = scope["type"] == "websocket"
        self._sockets += is_websocket
        try:
            if self._sockets > MOST_SOCKETS and is_websocket:
                await answer.refuse(Refusal(f"{MOST_SOCKETS} connections are open already", 503))
                return
            bounded = self._metered(scope, receive, answer) if is_websocket else _bounded(receive)
            await self._app(scope, bounded, answer)
        finally:
            self._sockets -= is_websocket

    def _asks_too_much(self, scope: Scope, request: Request, shown: str) -> bool:
        """Count what somebody asks for; who that is says the token, and the address."""
        host, _ = scope.get("client") or ("", 0)
        known = f"{host[:SHOWN]} {shown if self._access.tokens else ''}"
        if request.is_websocket:
            what, most = "sockets", MOST_HANDSHAKES
        elif request.is_of_another_site:
            what, most = "links", MOST_LINKS
        elif request.path.startswith(self._urgent):
            return False
        elif request.path.startswith(self._parts):
            what, most = "parts", MOST_PARTS
        elif request.path == self._words:
            what, most = "words", MOST_WORDS
        else:
            what, most = "pages", MOST_PAGES
        return self._asked.add(f"{what} {known}") > most

    def _metered(self, scope: Scope, receive: Receive, answer: Answer) -> Receive:
        """End a WebSocket that brings more in a second than it may, or what nobody can mean, before it is
        decoded.
        """
        second = Span(1.0)
        path = scope["path"]  # which mounted applications change

        async def receive_more() -> Mapping[str, Any]:
            message = await receive()
            if message["type"] != "websocket.receive":
                return message
            size = len(message.get("text") or message.get("bytes") or b"")
            within = second.add("messages") <= self._most_messages and second.add("bytes", size) <= MOST_BYTES
            problem = self._check(path, message) if within else "too much at once"
            if not problem:
                return message
            await answer({"type": "websocket.close", "code": 1008, "reason": problem})
            return {"type": "websocket.disconnect", "code": 1008}

        return receive_more


class Answer:
    """The answer to one request: with the headers of every answer, whoever gives it.

    Args:
        scope: The request.
        send: Takes what is answered.
    """

    def __init__(self, scope: Scope, send: Send) -> None:
        self._send = send
        self._is_websocket = scope["type"] == "websocket"
        self._says_why = "websocket.http.response" in scope.get("extensions", ())

    async def __call__(self, message: Mapping[str, Any]) -> None:
        """Send a part of the answer."""
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            own = [pair for pair in message.get("headers", ()) if pair[0].lower() not in SHIELD]
            message = {**message, "headers": [*own, *SHIELD.items()]}
        await self._send(message)

    async def refuse(self, refusal: Refusal) -> None:
        """Say why somebody is not let in."""
        if self._is_websocket and not self._says_why:
            await self({"type": "websocket.close", "code": 1008, "reason": refusal.why})
            return
        kind = "websocket.http.response" if self._is_websocket else "http.response"
        headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
        await self({"type": f"{kind}.start", "status": refusal.status, "headers": headers})
        await self({"type": f"{kind}.body", "body": f"{refusal.why}\n".encode()})


class Span:
    """Counts what comes in a span of time; after it, counting begins anew.

    Args:
        seconds: How long a span is.
    """

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


def _cookie(request: Request, access: Roles) -> str:
    if not access.tokens:
        return ""
    from starlette.requests import cookie_parser  # of an extra, like the page

    return cookie_parser(request.headers.get("cookie", "")).get(COOKIE, "")


def _bounded(receive: Receive) -> Receive:
    """Refuse a request that turns out to be too large: it need not have said how long it is."""
    received = 0

    async def receive_more() -> Mapping[str, Any]:
        nonlocal received
        message = await receive()
        received += len(message.get("body", b""))
        if received > LARGEST_REQUEST:
            from fastapi import HTTPException  # what reads a body is of FastAPI

            raise HTTPException(413, TOO_LARGE)
        return message

    return receive_more


async def _keep_token(scope: Scope, answer: Answer, token: str) -> None:
    """Let the browser keep the token in a cookie, and take it out of the address."""
    query = parse_qs(scope["query_string"].decode("latin-1"))
    rest = urlencode({key: value for key, value in query.items() if key != "token"}, doseq=True)
    path = quote(scope["path"])  # which begins with one slash: refusal_of has looked
    cookie = f"{COOKIE}={token}; HttpOnly; SameSite=Strict; Path=/; Max-Age={_MONTH_S}"
    headers = [(b"location", f"{path}{'?' if rest else ''}{rest}".encode()), (b"set-cookie", cookie.encode())]
    await answer({"type": "http.response.start", "status": 303, "headers": headers})
    await answer({"type": "http.response.body", "body": b""})
