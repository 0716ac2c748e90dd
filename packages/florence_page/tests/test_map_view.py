"""The map of the page as a browser draws it: the component alone, with the parts that a test sends."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

nicegui = pytest.importorskip("nicegui")
playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
CHROMIUM = shutil.which("chromium")
if CHROMIUM is None:
    pytest.skip("there is no chromium", allow_module_level=True)

from florence_page import parts  # noqa: E402

from florence_bt.skills.navigation.map_server.image import encode_image  # noqa: E402

FILES = {
    "/vue.js": Path(nicegui.__file__).with_name("static") / "vue.esm-browser.prod.js",
    "/map_view.js": Path(parts.__file__).with_name("components") / "map_view.js",
}
LIVE = "export const live = { listen(take) { window.send = take; return () => {}; }, want: () => () => {} };"
PAGE = """<html><script type="importmap">{"imports": {"vue": "/vue.js", "florence-live": "/live.js"}}</script>
<body style="margin:0"><div id="app" style="width:400px;height:300px"></div><script type="module">
import { createApp, h } from "vue"; import MapView from "/map_view.js";
createApp({ render: () => h(MapView, { plain: location.hash !== "#layers", footprint: [] }) }).mount("#app");
</script>"""
COLOURS = """async ([x, y, width, height]) => {
  await new Promise((done) => setTimeout(() => requestAnimationFrame(done), 50));
  const { data } = document.querySelector("canvas").getContext("2d").getImageData(x, y, width, height);
  const found = new Set();
  for (let i = 0; i < data.length; i += 4) found.add([data[i], data[i + 1], data[i + 2]].join());
  return [...found];
}"""
"""The colours of a part of the screen when all is drawn."""
EVERYWHERE, CORNER = (0, 0, 400, 300), (2, 2, 1, 1)
TRAIL, GROUND, BLACK = "155,188,230", "214,214,214", "0,0,0"
GOAL, WAY, OLD = "42,157,63", "74,155,232", "153,153,153"


class MapOnScreen:
    """The map in a browser.

    Attributes:
        late: Pictures whose answer the test gives, by their version.
    """

    def __init__(self, page: Any, variant: str = "") -> None:
        self._page = page
        self.late: dict[str, Any] = {}
        page.route("**/*", self._answer)
        page.goto(f"http://page.test/{variant}")
        page.wait_for_function("() => window.send")

    def _answer(self, route: Any) -> None:
        path, _, version = route.request.url.removeprefix("http://page.test").partition("?v=")
        if path == "/":
            route.fulfill(body=PAGE, content_type="text/html")
        elif path == "/live.js":
            route.fulfill(body=LIVE, content_type="text/javascript")
        elif path in FILES:
            route.fulfill(path=FILES[path], content_type="text/javascript")
        elif version in self.late:
            self.late[version] = route
        else:
            self.give(route)

    def give(self, route: Any) -> None:
        """Answer with a black picture."""
        route.fulfill(body=encode_image(np.zeros((3, 4), np.uint8), None, "png"), content_type="image/png")

    def send(self, **news: Any) -> None:
        """Send parts as the live stream does."""
        self._page.evaluate("news => window.send(news)", news)

    def send_map(self, version: str, x: float, y: float, width: float, height: float) -> None:
        self.send(map={"origin": [x, y, 0.0], "size": [width, height], "version": [version]})

    def colours(self, part: tuple[int, int, int, int]) -> list[str]:
        found: list[str] = self._page.evaluate(COLOURS, part)
        return found

    def wait_for(self, colour: str, part: tuple[int, int, int, int] = EVERYWHERE) -> None:
        for _ in range(200):
            if colour in self.colours(part):
                return
        raise AssertionError(f"nothing is drawn in {colour}")

    def choose(self, title: str) -> None:
        """Use a button in the corner of the map."""
        self._page.get_by_role("button", name=title).click()


@pytest.fixture
def screen(request: pytest.FixtureRequest) -> Iterator[MapOnScreen]:
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        opened = chromium.new_page(viewport={"width": 400, "height": 300})
        yield MapOnScreen(opened, getattr(request, "param", ""))
        chromium.close()


def test_the_trail_of_one_trial_does_not_go_on_in_the_next(screen: MapOnScreen) -> None:
    screen.send_map("1", 0.0, 0.0, 4.0, 3.0)
    screen.wait_for(BLACK)
    for x in (1.0, 2.0, 3.0):
        screen.send(scene={"pose": [x, 1.0, 0.0]})
    assert TRAIL in screen.colours(EVERYWHERE)
    screen.send(scene={"pose": None})
    screen.send(scene={"pose": [1.0, 2.0, 0.0]})
    assert TRAIL not in screen.colours(EVERYWHERE)


def test_the_goal_and_the_way_are_grey_while_navigation_says_nothing(screen: MapOnScreen) -> None:
    screen.send_map("1", 0.0, 0.0, 4.0, 3.0)
    screen.wait_for(BLACK)
    screen.send(goal=[2.0, 1.5, 0.0], plan=[[0.5, 0.5], [3.5, 0.5]], silent={})
    screen.wait_for(GOAL)
    assert WAY in screen.colours(EVERYWHERE) and OLD not in screen.colours(EVERYWHERE)
    screen.send(silent={"navigation": 4})
    screen.wait_for(OLD)
    assert not {GOAL, WAY} & set(screen.colours(EVERYWHERE))


@pytest.mark.parametrize("screen", ["#layers"], indirect=True)
def test_a_layer_that_has_ended_is_not_drawn_even_if_its_picture_comes_late(screen: MapOnScreen) -> None:
    costs = {"origin": [-0.2, 0.0, 0.0], "size": [0.1, 1.0], "version": ["costs"]}
    beside_the_map = (10, 150, 1, 1)
    screen.send_map("1", 0.0, 0.0, 1.0, 1.0)
    screen.choose("local costmap")
    screen.send(local_costmap=costs)
    screen.wait_for(BLACK, beside_the_map)
    screen.send(local_costmap=None)
    assert screen.colours(beside_the_map) == [GROUND]
    screen.late["late"] = None
    screen.send(local_costmap=costs | {"version": ["late"]})
    assert screen.colours(beside_the_map) == [GROUND]
    screen.send(local_costmap=None)
    screen.give(screen.late["late"])
    assert screen.colours(beside_the_map) == [GROUND]


def test_a_picture_is_drawn_where_its_own_map_lies_while_that_of_a_newer_map_is_on_its_way(
    screen: MapOnScreen,
) -> None:
    screen.send_map("1", 0.0, 0.0, 4.0, 3.0)
    screen.wait_for(BLACK)
    screen.late["2"] = None
    screen.send_map("2", -4.0, -3.0, 12.0, 9.0)
    assert screen.colours(CORNER) == [GROUND]
    screen.give(screen.late["2"])
    screen.wait_for(BLACK, CORNER)
