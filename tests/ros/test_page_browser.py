"""The page in a real browser, before one simulated system that all tests here share, in their order."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")
pytest.importorskip("playwright", reason="a browser is driven by playwright")

from playwright import sync_api as playwright

from tests.ros.conftest import GENEROUS_S, Child, own_domain

CHROMIUM = shutil.which("chromium")
pytestmark = [
    pytest.mark.ros,
    pytest.mark.slow,
    pytest.mark.timeout(1800),
    pytest.mark.xdist_group("browser"),
    pytest.mark.skipif(CHROMIUM is None, reason="there is no browser: apt install chromium"),
]
expect = playwright.expect
PATIENCE_MS = 1000.0 * GENEROUS_S
ROBOT = """canvas => {
  const { data, width } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  let count = 0, x = 0, y = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (Math.abs(data[i] - 31) + Math.abs(data[i + 1] - 111) + Math.abs(data[i + 2] - 214) > 6) continue;
    count += 1; x += i / 4 % width; y += Math.floor(i / 4 / width);
  }
  return count ? [x / count, y / count] : null;
}"""
"""Where the robot is drawn: the middle of everything in its colour."""


@dataclass(frozen=True)
class System:
    """A running system: the address of its page, and its folder."""

    address: str
    folder: Path


@pytest.fixture(scope="module")
def system(tmp_path_factory: pytest.TempPathFactory) -> Iterator[System]:
    folder = tmp_path_factory.mktemp("system")
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        port = server.getsockname()[1]
    words = [sys.executable, "-m", "florence_bt.cli", "up", "--sim", "--person", "kitchen", "--seed", "4"]
    words += ["--page", "--page-port", str(port), "--out", str(folder / "up")]
    with own_domain(), pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CONFIG_HOME", str(folder))
        up = Child(words, folder / "up.txt")
        try:
            up.wait_for("Ctrl-C ends all", 5.0 * GENEROUS_S)
            yield System(f"http://localhost:{port}/", folder / "up")
        finally:
            up.end()


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser: Any, system: System) -> Iterator[Any]:
    """A viewer of the page, who sees the map; what the browser reports as an error fails the test."""
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    opened.set_default_timeout(PATIENCE_MS)
    expect.set_options(timeout=PATIENCE_MS)
    errors: list[str] = []
    opened.on("pageerror", lambda error: errors.append(str(error)))
    for _ in range(100):
        try:
            opened.goto(system.address)
            break
        except playwright.Error:  # the page is a process that nothing waits for
            opened.wait_for_timeout(500)
    expect(opened.get_by_text("no map has come yet")).to_have_count(0)
    yield opened
    opened.close()
    assert errors == []


def place_of_robot(page: Any) -> list[float]:
    page.wait_for_function(f"({ROBOT})(document.querySelector('canvas'))")
    found: list[float] = page.evaluate(f"({ROBOT})(document.querySelector('canvas'))")
    return found


def wait_until_it_moves(page: Any, start: list[float], pixels: float = 15.0) -> None:
    page.wait_for_function(
        f"([x, y]) => {{ const now = ({ROBOT})(document.querySelector('canvas'));"
        f" return now && Math.hypot(now[0] - x, now[1] - y) > {pixels}; }}",
        arg=start,
    )


def start_by_form(page: Any, mission: str) -> None:
    asked = page.get_by_role("dialog").get_by_label("mission")
    for _ in range(20):
        try:  # the page asks the mission server, which may not be found yet
            page.get_by_role("button", name="Start…").click(timeout=1_000)
            asked.wait_for(timeout=12_000)
            break
        except playwright.Error:
            continue
    asked.fill(mission)
    page.get_by_role("option", name=mission, exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Start").click()


def test_a_mission_is_started_by_form_followed_on_the_map_and_stopped(page: Any) -> None:
    start = place_of_robot(page)
    start_by_form(page, "goto_user")
    expect(page.get_by_role("status")).to_contain_text("goto_user runs")
    expect(page.get_by_role("treeitem").first).to_contain_text("goto_user")
    wait_until_it_moves(page, start)
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.get_by_role("status")).to_contain_text("was stopped")
    expect(page.get_by_role("status")).to_contain_text("page (edit)")


def test_a_click_on_the_map_drives_there(page: Any) -> None:
    box = page.locator("canvas").bounding_box()
    x, y = box["x"] + 0.35 * box["width"], box["y"] + 0.6 * box["height"]
    page.keyboard.down("Shift")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 60.0, steps=3)
    page.mouse.up()
    page.keyboard.up("Shift")
    expect(page.get_by_role("dialog")).to_contain_text("kitchen")
    expect(page.get_by_label("heading in degrees")).to_have_value("90")
    page.get_by_role("button", name="Drive there").click()
    page.get_by_role("button", name="Drive", exact=True).click()
    expect(page.get_by_role("status")).to_contain_text("goto_pose runs")
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.get_by_role("status")).to_contain_text("goto_pose was stopped")


def test_the_override_refuses_missions_and_a_hand_drives_until_it_lets_go(page: Any) -> None:
    page.get_by_role("button", name="STOP THE ROBOT").click()
    expect(page.get_by_role("status")).to_contain_text("manual override")
    expect(word(page)).to_have_attribute("data-state", "stopped")
    start_by_form(page, "go_home")
    expect(page.get_by_text(re.compile("florence release"))).to_be_visible()
    expect(page.get_by_role("slider", name="drive by hand")).to_have_count(0)
    page.get_by_role("button", name="Drive by hand").click()
    start = place_of_robot(page)
    page.locator("canvas").focus()
    page.keyboard.down("ArrowLeft")
    page.wait_for_timeout(1500)
    page.keyboard.up("ArrowLeft")
    page.keyboard.down("ArrowUp")
    wait_until_it_moves(page, start, 4.0)
    page.keyboard.up("ArrowUp")
    page.wait_for_timeout(1000)
    stands = place_of_robot(page)
    page.wait_for_timeout(1500)
    assert place_of_robot(page) == pytest.approx(stands, abs=2.0)
    page.get_by_role("button", name="Release").click()
    expect(page.get_by_role("status")).not_to_contain_text("manual override")
    expect(page.get_by_role("slider", name="drive by hand")).to_have_count(0)


def take_in_hand(page: Any) -> None:
    """Drive by hand: a key is held, and the robot turns."""
    page.get_by_role("button", name="Drive by hand").click()
    expect(page.get_by_role("slider", name="drive by hand")).to_be_visible()
    expect(page.get_by_role("status")).to_contain_text("manual override")
    page.locator("canvas").focus()
    page.keyboard.down("ArrowLeft")
    expect(word(page)).to_have_attribute("data-state", "hand")


def test_a_press_on_stop_takes_the_robot_out_of_the_hand(page: Any, browser: Any, system: System) -> None:
    """On this page, on the page of a phone, and by the command in a terminal."""
    phone = browser.new_page(viewport={"width": 390, "height": 844}, base_url=system.address)
    phone.set_default_timeout(PATIENCE_MS)
    phone.goto(system.address)
    command = [sys.executable, "-m", "florence_bt.cli", "override"]
    presses = {
        "here": lambda: page.get_by_role("button", name="STOP THE ROBOT").click(),
        "on a phone": lambda: phone.get_by_role("button", name="STOP THE ROBOT").click(),
        "in a terminal": lambda: subprocess.run(command, check=True, capture_output=True),
    }
    for where, press in presses.items():
        take_in_hand(page)
        press()
        expect(word(page)).to_contain_text("driving by hand is off")
        expect(page.get_by_role("slider", name="drive by hand")).to_have_count(0)
        expect(page.get_by_role("button", name="Drive by hand")).to_have_attribute("aria-pressed", "false")
        expect(word(page)).to_have_attribute("data-state", "stopped")
        page.wait_for_timeout(1500)  # the key is held on
        assert word(page).get_attribute("data-state") == "stopped", where
        page.keyboard.up("ArrowLeft")
    phone.close()
    page.get_by_role("button", name="Release").click()
    expect(word(page)).to_have_attribute("data-state", "free")


def word(page: Any) -> Any:
    """Return what the page says of the robot beside STOP."""
    return page.locator(".florence-bar .word")


def test_stop_is_in_its_place_above_everything(page: Any) -> None:
    stop = page.get_by_role("button", name="STOP THE ROBOT")

    def place() -> Any:
        box = stop.bounding_box()
        middle = [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2]
        top = "([x, y]) => document.elementFromPoint(x, y).innerText"
        assert page.evaluate(top, middle) == "STOP THE ROBOT"
        return box

    for width, height in ((390, 844), (1280, 800)):
        page.set_viewport_size({"width": width, "height": height})
        calm = place()
        assert calm["y"] + calm["height"] <= height and calm["x"] + calm["width"] <= width
        page.get_by_role("button", name="Start…").click()
        expect(page.get_by_role("dialog")).to_be_visible()
        assert place() == calm
        stop.click()
        expect(word(page)).to_have_attribute("data-state", "stopped")
        assert place() == calm
        page.get_by_role("button", name="Cancel").click()
        page.get_by_role("button", name="Release").click()
        expect(word(page)).to_have_attribute("data-state", "free")
        assert place() == calm


def test_what_is_shown_has_an_age_and_the_page_stays_through_a_break(page: Any, system: System) -> None:
    """The page's process is stopped: nothing comes, and nobody closes a connection."""
    page.evaluate("window.begun = true")
    pid = int((system.folder / "up" / "page").read_text())
    os.kill(pid, signal.SIGSTOP)
    try:
        page.wait_for_function("document.documentElement.dataset.old.includes('page')")
        expect(word(page)).to_contain_text("what you see is old")
        expect(page.get_by_role("button", name="Release")).to_be_disabled()
        page.get_by_role("button", name="STOP THE ROBOT").click()
        expect(word(page)).to_contain_text("NOT CONFIRMED: switch the robot off by hand")
    finally:
        os.kill(pid, signal.SIGCONT)
    expect(word(page)).to_have_attribute("data-state", "stopped")
    page.wait_for_function("document.documentElement.dataset.old === ''")
    page.get_by_role("button", name="Release").click()
    expect(word(page)).to_have_attribute("data-state", "free")
    assert page.evaluate("window.begun"), "it was not loaded anew"


def test_a_stop_outlives_a_reload_of_the_page(page: Any, system: System) -> None:
    page.route("**/robot/stop", lambda route: route.abort())
    page.get_by_role("button", name="STOP THE ROBOT").click()
    expect(word(page)).to_contain_text("NOT CONFIRMED")
    page.unroute("**/robot/stop")
    page.evaluate("sessionStorage.setItem('florence_stop', JSON.stringify({id: 'kept', began: Date.now()}))")
    page.reload()
    expect(word(page)).to_have_attribute("data-state", "stopped")
    assert page.evaluate("sessionStorage.getItem('florence_stop')") is None
    page.get_by_role("button", name="Release").click()
    expect(word(page)).to_have_attribute("data-state", "free")


def test_layers_come_on_request(page: Any) -> None:
    with page.expect_response(re.compile("picture/global_costmap")) as answer:
        page.get_by_role("button", name="global costmap").click()
    assert answer.value.ok
    page.get_by_role("button", name="camera").click()
    picture = page.get_by_alt_text("what the camera sees")
    expect(picture).to_be_visible()
    page.wait_for_function("document.querySelector('img[alt^=what]').naturalWidth > 100")
    page.get_by_role("button", name="camera").click()
    expect(picture).to_have_count(0)


def test_the_page_dies_and_comes_back_while_the_mission_goes_on(page: Any, system: System) -> None:
    start_by_form(page, "patrol")
    expect(page.get_by_role("status")).to_contain_text("patrol runs")
    page.evaluate("window.begun = true")
    pid = int((system.folder / "up" / "page").read_text())
    os.kill(pid, signal.SIGKILL)
    expect(word(page)).to_contain_text("started again")
    assert int((system.folder / "up" / "page").read_text()) != pid
    expect(page.get_by_role("status")).to_contain_text("patrol runs")
    assert page.evaluate("window.begun"), "what is on the screen stays"
    page.get_by_role("button", name="open the page again").click()
    page.wait_for_function("window.begun === undefined")
    expect(page.get_by_role("status")).to_contain_text("patrol runs")
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(page.get_by_role("status")).to_contain_text("patrol was stopped")


def test_a_run_is_looked_at_as_it_ran(page: Any) -> None:
    page.get_by_role("button", name="recorded runs").click()
    page.get_by_role("link", name="goto_user").click()
    expect(page.get_by_text("stopped on the page (edit)").first).to_be_visible()
    tree = page.get_by_role("tree")
    expect(tree).to_contain_text("goto_user")
    end = place_of_robot(page)
    slider = page.get_by_role("slider").first.bounding_box()
    page.mouse.click(slider["x"] + 1.0, slider["y"] + slider["height"] / 2.0)
    expect(page.get_by_text("+0.0 s the run started")).to_be_visible()
    page.wait_for_function(
        f"([x, y]) => {{ const now = ({ROBOT})(document.querySelector('canvas'));"
        f" return !now || Math.hypot(now[0] - x, now[1] - y) > 5; }}",
        arg=end,
    )


def test_on_a_phone_nothing_is_wider_than_the_screen(page: Any) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    for address in ("", "runs"):
        page.goto(page.url.rpartition("/")[0] + f"/{address}")
        page.wait_for_selector("[role=status], table")
        page.wait_for_function("document.documentElement.scrollWidth <= 390")
    assert page.get_by_role("link", name="the robot").is_visible()


BLANK_ICONS = """() => document.fonts.ready.then(() =>
  [...document.querySelectorAll("i.material-icons")].filter(icon => {
  const glyph = document.createRange(); glyph.selectNodeContents(icon);
  const wide = glyph.getBoundingClientRect().width, size = parseFloat(getComputedStyle(icon).fontSize);
  return icon.offsetWidth && Math.abs(wide - size) > 1;
}).map(icon => icon.textContent))"""
"""The names of icons that the font does not have: they show nothing."""


def test_every_icon_is_one_that_the_font_has(page: Any) -> None:
    expect(page.get_by_role("button", name="go on with the mission")).to_be_visible()
    assert page.evaluate(BLANK_ICONS) == []
