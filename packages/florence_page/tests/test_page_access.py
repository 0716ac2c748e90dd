"""Who gets through to the page, and who does not."""

from __future__ import annotations

import asyncio
import contextlib
import json

import pytest
from florence_page.access import COOKIE, ROLE, Access, Role, make_token, read_tokens, tokens_file
from florence_page.parts import LiveParts

from florence_bt.app.guard.guard import MOST_MESSAGES, MOST_PAGES, MOST_WORDS, Guard
from florence_bt.app.guard.rules import is_loopback
from florence_bt.core.errors import ConfigError


def ask(access, headers=(), query="", kind="http", path="/"):
    """Send one request; give the status, the headers of the answer, and the role that the page was told."""
    told, sent = [], []

    async def app(scope, receive, send):
        told.append(scope[ROLE])

    async def send(message):
        sent.append(message)

    scope = {
        "type": kind,
        "path": path,
        "query_string": query.encode(),
        "headers": [(name.encode(), value.encode("latin-1")) for name, value in headers],
    }
    asyncio.run(Guard(app, access)(scope, None, send))
    answer = dict(sent[0].get("headers", ())) if sent else {}
    return (sent[0].get("status", sent[0].get("code")) if sent else 200), answer, told[0] if told else None


OPEN = Access({})
HERE = ("host", "localhost:8080")


@pytest.fixture
def tokens(tmp_path):
    file = tmp_path / "tokens.json"
    return {role: make_token(role, file) for role in ("look", "run", "edit")}, Access(read_tokens(file)), file


def test_on_this_machine_everything_is_allowed_without_a_token():
    assert ask(OPEN, [HERE]) == (200, {}, Role.EDIT)
    assert ask(OPEN, [HERE, ("origin", "http://localhost:8080")])[2] is Role.EDIT


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "headers",
    [
        [HERE, ("origin", "http://evil.example")],
        [HERE, ("origin", "http://localhost:9999")],
        [HERE, ("origin", "null")],
        [("host", "evil.example")],
        [("host", "evil.example"), ("origin", "http://evil.example")],
        [HERE, ("origin", "http://[")],
        [("host", "[")],
        [],
    ],
)
def test_pages_of_another_origin_and_other_names_get_nothing(kind, headers):
    status, _, role = ask(OPEN, headers, kind=kind)
    assert role is None and status == (403 if kind == "http" else 1008)


@pytest.mark.parametrize("length", ["2000000", "-1", "many", "\u00b2", "9" * 5000])
def test_requests_that_are_too_large_are_refused(length):
    assert ask(OPEN, [HERE, ("content-length", length)])[0] == 403


def test_a_request_that_does_not_say_how_long_it_is_is_counted():
    fastapi = pytest.importorskip("fastapi")
    testing = pytest.importorskip("starlette.testclient")
    app = fastapi.FastAPI()

    @app.post("/words")
    async def words(text: str = fastapi.Body()):
        return len(text)

    async def guarded(scope, receive, send):
        await Guard(app, OPEN)(scope, receive, send)

    client = testing.TestClient(guarded, base_url="http://localhost")
    assert client.post("/words", content=iter([b"x" * 400_000] * 2)).json() == 800_000
    assert client.post("/words", content=iter([b"x" * 400_000] * 3)).status_code == 413


def heard(messages):
    """Send messages on one WebSocket; give how many the application got, and what was said to the end."""
    got, sent = [], []
    left = iter(messages)

    async def receive():
        return {"type": "websocket.receive", **next(left)}

    async def app(scope, receive, send):
        while (message := await receive())["type"] == "websocket.receive":
            got.append(message)

    async def send(message):
        sent.append(message)

    scope = {"type": "websocket", "path": "/", "query_string": b"", "headers": [(b"host", b"localhost")]}
    with contextlib.suppress(StopIteration, RuntimeError):  # nothing is left to be sent
        asyncio.run(Guard(app, OPEN)(scope, receive, send))
    return len(got), [(each["type"], each.get("code")) for each in sent]


CLOSED = [("websocket.close", 1008)]


def test_a_websocket_that_brings_too_much_at_once_is_closed():
    assert heard([{"text": "ok"}] * MOST_MESSAGES) == (MOST_MESSAGES, [])
    assert heard([{"text": "ok"}] * 10_000) == (MOST_MESSAGES, CLOSED)
    assert heard([{"bytes": b"x" * 900_000}] * 3) == (2, CLOSED)
    assert heard([{"text": "x" * 900_000}] * 3) == (2, CLOSED)


def test_who_opens_pages_without_end_is_told_to_wait_and_nobody_else_is(tokens):
    given, access, _ = tokens

    async def app(scope, receive, send):
        await send({"type": "http.response.start", "status": 200})

    parts = ("/_nicegui/static/", "/picture/", "/edit/picture/")
    guard = Guard(app, access, parts=parts, words="/edit/complete")

    def opened(role, path="/"):
        sent = []

        async def send(message):
            sent.append(message)

        headers = [(b"host", b"robot"), (b"cookie", f"{COOKIE}={given[role]}".encode())]
        scope = {"type": "http", "path": path, "query_string": b"", "headers": headers, "client": ("::1", 5)}
        asyncio.run(guard(scope, None, send))
        return sent[0]["status"]

    assert {opened("look") for _ in range(MOST_PAGES)} == {200}
    assert opened("look") == opened("look", "/edit/") == 429
    assert opened("look", "/_nicegui/static/x.js") == opened("look", "/picture/map") == 200
    assert opened("look", "/edit/picture/map") == 200
    assert opened("edit") == 200
    # The words that the editor asks for while somebody types are no pages, and are not without end either.
    assert {opened("edit", "/edit/complete") for _ in range(2 * MOST_PAGES)} == {200}
    assert opened("edit") == 200
    assert 429 in {opened("edit", "/edit/complete") for _ in range(MOST_WORDS)}


def test_with_tokens_everybody_needs_one(tokens):
    _, access, _ = tokens
    there = ("host", "robot.local:8080")
    assert ask(access, [there])[2] is None
    assert ask(access, [there, ("cookie", f"{COOKIE}=guess")])[2] is None
    assert ask(access, [there], query="token=guess", kind="websocket")[0] == 1008


def test_a_token_in_the_address_becomes_a_cookie_that_scripts_cannot_read(tokens):
    given, access, _ = tokens
    there = ("host", "robot.local:8080")
    status, answer, role = ask(access, [there], query=f"token={given['run']}&room=hall")
    assert status == 303 and role is None and answer[b"location"] == b"/?room=hall"
    cookie = answer[b"set-cookie"].decode()
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    assert ask(access, [there, ("cookie", cookie.partition(";")[0])])[2] is Role.RUN
    assert ask(access, [there, ("cookie", f"{COOKIE}={given['look']}")], kind="websocket")[2] is Role.LOOK
    others = f"odd[name]=1; {cookie.partition(';')[0]}; also odd"
    assert ask(access, [there, ("cookie", others)])[2] is Role.RUN, "cookies of others on this host"


def test_tokens_are_not_kept_themselves(tokens):
    given, _, file = tokens
    text = file.read_text()
    assert not any(token in text for token in given.values())
    assert sorted(json.loads(text).values()) == ["edit", "look", "run"]


def test_wrong_roles_and_files_are_told(tmp_path):
    with pytest.raises(ConfigError, match="look"):
        make_token("watch", tmp_path / "tokens.json")
    (tmp_path / "other.json").write_text("[1, 2]")
    with pytest.raises(ConfigError, match="no file of tokens"):
        read_tokens(tmp_path / "other.json")


@pytest.mark.parametrize(
    ("host", "here"),
    [
        ("127.0.0.1", True),
        ("localhost", True),
        ("::1", True),
        ("[::1]", True),
        ("0.0.0.0", False),
        ("robot", False),
    ],
)
def test_what_only_this_machine_can_reach(host, here):
    assert is_loopback(host) is here


def test_a_viewer_gets_what_it_has_not_got_and_only_that():
    parts = LiveParts()
    parts.put("map", {"size": [1, 2]})
    parts.put("scene", {"pose": None})
    frame, seen = parts.since({})
    assert json.loads(frame) == {"map": {"size": [1, 2]}, "scene": {"pose": None}}
    assert parts.since(seen)[0] == ""
    for x in range(3):
        parts.put("scene", {"pose": [x, 0, 0]})
    parts.put("map", {"size": [1, 2]})
    frame, _ = parts.since(seen)
    assert json.loads(frame) == {"scene": {"pose": [2, 0, 0]}}, "the newest state alone, and no part twice"


@pytest.mark.parametrize(
    ("given", "folder"), [("elsewhere", "elsewhere"), ("", "home/.config"), (None, "home/.config")]
)
def test_the_tokens_lie_in_the_user_s_folder_for_configuration(tmp_path, monkeypatch, given, folder):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    if given is None:
        monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    else:
        monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / given) if given else "")
    assert tokens_file() == tmp_path / folder / "florence" / "page_tokens.json"
