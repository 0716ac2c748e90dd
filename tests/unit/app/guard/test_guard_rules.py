"""What a browser says for another site gets nothing; what the page's own viewers send goes through."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import Any

import pytest
from florence_page.access import COOKIE, Access, make_token, read_tokens

from florence_bt.app.guard.guard import MOST_LINKS, MOST_PAGES, MOST_PARTS, Guard, NoTokens
from florence_bt.app.guard.rules import SHIELD

LINK = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
PICTURE = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors", "sec-fetch-dest": "image"}


class Asked:
    """An application behind a guard, and what it was asked.

    Args:
        access: Who may do what.
        options: Of the guard.
    """

    def __init__(self, access: Any = None, **options: Any) -> None:
        self.paths: list[str] = []
        self.guard = Guard(self._app, access or NoTokens(), **options)

    async def _app(self, scope: Any, receive: Any, send: Any) -> None:
        self.paths.append(scope["path"])
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
        else:
            await send(
                {"type": "http.response.start", "status": 200, "headers": [(b"X-Frame-Options", b"no")]}
            )
            await send({"type": "http.response.body", "body": b""})

    def ask(
        self,
        headers: Mapping[str, str] | list[tuple[str, str]] = (),  # type: ignore[assignment]
        path: str = "/",
        query: str = "",
        kind: str = "http",
        method: str = "GET",
    ) -> tuple[int, dict[bytes, bytes], bytes]:
        """Send a request; give status, headers and body of the answer. A host is added when none is given."""
        pairs = list(headers.items()) if isinstance(headers, Mapping) else list(headers)
        if not any(name == "host" for name, _ in pairs):
            pairs.append(("host", "localhost:8080"))
        scope = {
            "type": kind,
            "method": method,
            "path": path,
            "query_string": query.encode(),
            "headers": [(name.encode(), value.encode("latin-1")) for name, value in pairs if value != "-"],
            "client": ("127.0.0.1", 5),
            "extensions": {"websocket.http.response": {}},
        }
        sent: list[Any] = []

        async def send(message: Any) -> None:
            sent.append(message)

        asyncio.run(self.guard(scope, None, send))  # type: ignore[arg-type]
        first, last = sent[0], sent[-1]
        return first.get("status", 101), dict(first.get("headers", ())), last.get("body", b"")


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "headers",
    [
        PICTURE,
        {**PICTURE, "sec-fetch-site": "same-site"},
        {**PICTURE, "sec-fetch-site": "CROSS-SITE"},
        {**PICTURE, "sec-fetch-site": "something new"},
        {"sec-fetch-site": "cross-site"},
        {**LINK, "sec-fetch-dest": "iframe"},
        {**LINK, "sec-fetch-dest": "embed"},
        {**LINK, "sec-purpose": "prefetch;prerender"},
        {"referer": "http://evil.example/page", "accept": "image/png"},
        {"referer": "http://localhost:9999/", "accept": "*/*"},
        {"origin": "http://LOCALHOST:8080.evil.example"},
        {"origin": "http://localhost:8080@evil.example"},
        {"origin": "file://"},
        {"origin": ""},
        {"origin": "ftp://localhost:8080"},
        [("origin", "http://localhost:8080"), ("origin", "http://evil.example")],
        [("host", "localhost:8080"), ("host", "evil.example")],
        {"host": "-"},
        {"host": "localhost:8080, evil.example"},
        {"host": "localhost:8080/evil"},
        {"host": "evil.example#localhost"},
        {"host": "localhost@evil.example"},
        {"host": "localhost:abc"},
        {"host": "localhost.evil.example"},
        {"host": "2130706433"},
        {"host": "[::1"},
        {"host": "[2001:db8::1]:8080"},
        {"host": "10.0.0.1:8080"},
        {"x-forwarded-prefix": "//evil.example"},
        {"x-forwarded-prefix": "/a\\evil"},
    ],
)
def test_what_another_site_sends_gets_nothing(kind: str, headers: Any) -> None:
    asked = Asked()
    status, answer, why = asked.ask(headers, kind=kind)
    assert 400 <= status < 500 and not asked.paths
    assert why and SHIELD.items() <= answer.items()


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"origin": "http://localhost:8080"},
        {"origin": "http://LocalHost:8080", "sec-fetch-site": "same-origin"},
        {"host": "LOCALHOST:8080", "origin": "http://localhost:8080"},
        {"host": "localhost.:8080", "origin": "http://localhost.:8080"},
        {"host": "127.0.0.1:8080"},
        {"host": "127.0.0.2"},
        {"host": "[::1]:8080", "origin": "http://[::1]:8080"},
        {"sec-fetch-site": "none", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"},
        {"referer": "http://localhost:8080/edit/"},
        LINK,
        {"referer": "http://evil.example/", "accept": "text/html,application/xml"},
        {"x-forwarded-prefix": "/robot"},
    ],
)
def test_the_pages_own_requests_and_links_that_a_person_follows_go_through(headers: Any) -> None:
    asked = Asked()
    assert asked.ask(headers)[0] == 200 and asked.paths == ["/"]


def test_a_link_opens_a_page_and_does_nothing_else() -> None:
    asked = Asked()
    assert asked.ask(LINK, method="POST")[0] == asked.ask(LINK, kind="websocket")[0] == 403
    assert not asked.paths


def test_every_answer_says_that_nobody_may_frame_it() -> None:
    _, headers, _ = Asked().ask()
    assert SHIELD.items() <= headers.items() and b"X-Frame-Options" not in headers


@pytest.mark.parametrize(
    "path",
    [
        *("//evil.example/", "//evil.example", "/\\evil.example", "\\\\evil.example", "/\t/evil"),
        *("/\r\nx: 1", "/a\nb", "/\0", "http://evil.example/", "*", "", "evil"),
    ],
)
def test_what_is_no_path_is_refused_with_and_without_a_token(tmp_path: Any, path: str) -> None:
    access = Access(read_tokens_with("run", tmp_path)[1])
    token = read_tokens_with("run", tmp_path)[0]
    status, headers, _ = Asked(access).ask({"host": "robot"}, path=path, query=f"token={token}")
    assert status == 400 and b"location" not in headers
    assert Asked().ask(path=path)[0] == 400


def read_tokens_with(role: str, folder: Any) -> tuple[str, Mapping[str, Any]]:
    token = make_token(role, folder / "tokens.json")
    return token, read_tokens(folder / "tokens.json")


@pytest.mark.parametrize(
    ("path", "query", "location"),
    [
        ("/", "", b"/"),
        ("/edit/", "", b"/edit/"),
        ("/a b?/\u00e9", "", b"/a%20b%3F/%C3%A9"),
        ("/runs", "run=a%0d%0ab", b"/runs?run=a%0D%0Ab"),
        ("/runs", "next=//evil.example", b"/runs?next=%2F%2Fevil.example"),
        ("/runs", "x=%ff", b"/runs?x=%EF%BF%BD"),
    ],
)
def test_a_token_leads_to_the_same_page_and_nowhere_else(
    tmp_path: Any, path: str, query: str, location: bytes
) -> None:
    token, known = read_tokens_with("run", tmp_path)
    full = f"token={token}&{query}" if query else f"token={token}"
    status, headers, _ = Asked(Access(known)).ask({"host": "robot"}, path=path, query=full)
    assert (status, headers[b"location"]) == (303, location)
    assert SHIELD.items() <= headers.items()


def test_a_link_with_a_token_is_not_followed_from_another_site(tmp_path: Any) -> None:
    token, known = read_tokens_with("run", tmp_path)
    status, headers, why = Asked(Access(known)).ask({**LINK, "host": "robot"}, query=f"token={token}")
    assert status == 403 and b"set-cookie" not in headers and b"copy its address" in why


# ---- who counts for whom --------------------------------------------------------------------------------


def test_pictures_of_another_site_use_up_nobodys_pages() -> None:
    asked = Asked(parts=("/picture/",))
    for _ in range(10 * MOST_PAGES):
        assert asked.ask(PICTURE)[0] == asked.ask(PICTURE, path="/picture/map")[0] == 403
    assert {asked.ask()[0] for _ in range(MOST_PAGES)} == {200}
    assert asked.ask()[0] == 429


def test_another_site_that_opens_windows_has_a_count_of_its_own() -> None:
    asked = Asked()
    assert [asked.ask(LINK)[0] for _ in range(MOST_LINKS + 1)] == [200] * MOST_LINKS + [429]
    assert asked.ask()[0] == 200


def test_files_are_counted_too_and_what_is_none_counts_as_a_page() -> None:
    asked = Asked(parts=("/_nicegui/3/static/",))
    got = [asked.ask(path="/_nicegui/3/static/x.js")[0] for _ in range(MOST_PARTS + 1)]
    assert got == [200] * MOST_PARTS + [429]
    assert [asked.ask(path="/_nicegui/none")[0] for _ in range(MOST_PAGES + 1)][-2:] == [200, 429]


def test_what_stops_the_robot_is_never_told_to_wait() -> None:
    asked = Asked(urgent=("/robot/",))
    got = {asked.ask(path="/robot/stop", method="POST")[0] for _ in range(10 * MOST_PAGES)}
    assert got == {200} and asked.ask()[0] == 200
    assert asked.ask({"origin": "http://evil.example"}, path="/robot/stop", method="POST")[0] == 403
    assert asked.ask(LINK, path="/robot/stop", method="POST")[0] == 403


def test_the_counts_of_tokens_are_apart(tmp_path: Any) -> None:
    first = make_token("look", tmp_path / "tokens.json")
    second, known = read_tokens_with("look", tmp_path)
    asked = Asked(Access(known))

    def opened(token: str) -> int:
        return asked.ask({"host": "robot", "cookie": f"{COOKIE}={token}"})[0]

    assert [opened(first) for _ in range(MOST_PAGES + 1)][-1] == 429
    assert opened(second) == 200


# ---- other origins --------------------------------------------------------------------------------------


def test_an_origin_that_was_allowed_gets_in_and_others_hear_what_would_have_worked() -> None:
    asked = Asked(origins=frozenset({"file://", "https://App.example"}), hint="; allow it with x")
    for origin in ("file://", "https://app.example", "HTTPS://APP.EXAMPLE"):
        assert asked.ask({"origin": origin, "sec-fetch-site": "cross-site"}, kind="websocket")[0] == 101
    status, _, why = asked.ask({"origin": "https://app.example.evil"}, kind="websocket")
    assert status == 403 and b"https://app.example.evil" in why and b"allow it with x" in why
    assert asked.ask({"origin": "file://", "host": "evil.example"}, kind="websocket")[0] == 403


def test_a_long_origin_is_not_said_again_whole() -> None:
    assert len(Asked().ask({"origin": "http://" + "e" * 20_000})[2]) < 300
