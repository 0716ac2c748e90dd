"""The line of the page that says how things stand, as a browser shows it: what is old says so."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

nicegui = pytest.importorskip("nicegui")
playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
CHROMIUM = shutil.which("chromium")
if CHROMIUM is None:
    pytest.skip("there is no chromium", allow_module_level=True)

from florence_bt.app.page import parts  # noqa: E402

FILES = {
    "/vue.js": Path(nicegui.__file__).with_name("static") / "vue.esm-browser.prod.js",
    "/status_view.js": Path(parts.__file__).with_name("components") / "status_view.js",
}
LIVE = """export const live = { listen(take) { window.send = take; return () => {}; },
  on_age(take) { window.age = take; return () => {}; } };"""
PAGE = """<html><script type="importmap">{"imports": {"vue": "/vue.js", "florence-live": "/live.js"}}</script>
<body><div id="app"></div><script type="module">
import { createApp } from "vue"; import StatusView from "/status_view.js";
createApp(StatusView).mount("#app");
</script>"""
STATE = {"stop": "", "battery": 90, "battery_was": None, "said": "", "sure": None, "trouble": None}
"""The part ``state`` while all is well."""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture
def screen(browser: Any) -> Iterator[Any]:
    opened = browser.new_page()
    texts = {"/": PAGE, "/live.js": LIVE} | {name: path.read_text() for name, path in FILES.items()}
    opened.route(
        "**/*",
        lambda route: route.fulfill(
            body=texts[route.request.url.removeprefix("http://page.test")],
            content_type="text/html" if route.request.url.endswith("/") else "text/javascript",
        ),
    )
    opened.goto("http://page.test/")
    opened.wait_for_function("() => window.send && window.age")
    yield opened
    opened.close()


@pytest.mark.parametrize(
    ("sent", "says", "says_not"),
    [
        ({"state": STATE}, "battery 90 %", "not known"),
        (
            {"state": STATE | {"battery": None, "battery_was": "90 % 12 s ago"}},
            "battery not known (90 % 12 s ago)",
            "battery 90 %",
        ),
        ({"state": STATE | {"battery": None}}, "battery not known", "ago"),
        (
            {"state": STATE | {"trouble": "the process of busy is 3.2 s behind"}},
            "busy is 3.2 s behind",
            "null",
        ),
        ({"override": {"on": True}, "silent": {}}, "manual override: the base", "was on"),
        (
            {"override": {"on": True}, "silent": {"base": 7}},
            "manual override was on 7 s ago",
            "override: the",
        ),
        ({"override": {"on": False}, "silent": {"base": 7}}, "battery", "override"),
        ({"state": STATE | {"stop": "it touches"}, "silent": {"base": 7}}, "7 s ago: it touches", "null"),
        ({"state": STATE | {"stop": "it touches"}, "silent": {}}, "it touches", "ago"),
        ({"run": {}}, "no mission has run yet", "nothing"),
        ({"run": {}, "silent": {"missions": 4}}, "the mission server has said nothing for 4 s", "no mission"),
        ({"run": {"mission": "greet", "state": "ACTIVE", "paused": True}}, "greet is paused", "runs"),
        (
            {"run": {"mission": "greet", "state": "ACTIVE"}, "silent": {"missions": 4}},
            "the mission server has said nothing for 4 s: greet runs",
            "old",
        ),
    ],
)
def test_what_is_shown_is_of_now_or_says_how_old_it_is(
    screen: Any, sent: dict[str, Any], says: str, says_not: str
) -> None:
    screen.evaluate("news => window.send(news)", sent)
    line = screen.get_by_role("status")
    playwright.expect(line).to_contain_text(says)
    assert says_not not in line.inner_text()


@pytest.mark.parametrize("sent", [{"silent": {"missions": 4}}, {"silent": {"base": 4}}, {"silent": {}}])
def test_nothing_old_has_its_full_colour(screen: Any, sent: dict[str, Any]) -> None:
    run = {"run": {"mission": "greet", "state": "ABORTED", "reason": "no way", "run_id": "R-1"}}
    screen.evaluate("news => window.send(news)", run | {"state": STATE | {"stop": "it touches"}} | sent)
    colours = {
        said: screen.get_by_text(said).last.evaluate("each => getComputedStyle(each).color")
        for said in ("greet", "failed", "no way", "it touches")
    }
    grey = "rgb(119, 119, 119)"
    old = {"missions": ("greet", "failed", "no way"), "base": ("it touches",)}
    told = {said for who in sent["silent"] for said in old[who]}
    assert {said for said, colour in colours.items() if colour == grey} == told
