"""The editor in a real browser: a mission with a mistake is mended by its message, tried, saved and run."""

from __future__ import annotations

import http.client
import json
import shutil
import socket
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")
connect = pytest.importorskip("websockets.sync.client").connect
playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
CHROMIUM = shutil.which("chromium")
if CHROMIUM is None:
    pytest.skip("there is no chromium", allow_module_level=True)

from florence_interfaces.msg import RunState  # noqa: E402
from florence_interfaces.srv import ReloadMissions, RunMission  # noqa: E402
from florence_page.access import COOKIE, make_token, tokens_file  # noqa: E402
from websockets.exceptions import ConnectionClosed, InvalidStatus  # noqa: E402

from florence_bt.ros.node import FlorenceNode  # noqa: E402
from florence_bt.ros.qos import LATCHED  # noqa: E402
from tests.ros.conftest import Child  # noqa: E402
from tests.ros.test_page import answers, get  # noqa: E402

pytestmark = pytest.mark.ros
MOMENT_MS = 60_000


class MissionServer(FlorenceNode):
    """Says which folder it reads, reloads, and takes missions."""

    def __init__(self, folder: Path) -> None:
        super().__init__("florence_bt")
        self.declare_parameter("mission_folders", [str(folder)])
        self.reloads = 0
        self.runs: list[RunMission.Request] = []
        self.create_publisher(RunState, "florence_bt/run_state", LATCHED)
        self.create_service(ReloadMissions, "florence_bt/reload_missions", self._on_reload)
        self.create_service(RunMission, "florence_bt/run_mission", self._on_run)

    def _on_reload(self, request: Any, answer: Any) -> Any:
        self.reloads += 1
        answer.success, answer.report = True, "tea: reloaded"
        return answer

    def _on_run(self, request: Any, answer: Any) -> Any:
        self.runs.append(request)
        answer.accepted, answer.run_id = True, "1"
        return answer


@pytest.fixture
def start_page(
    ros: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start_process: Callable[..., Child]
) -> Callable[[], tuple[int, Child]]:
    """Starts a page that knows no folder of its own; gives its port, and its process."""

    def start() -> tuple[int, Child]:
        with socket.socket() as server:
            server.bind(("127.0.0.1", 0))
            port: int = server.getsockname()[1]
        monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
        monkeypatch.chdir(tmp_path)
        child = start_process("-m", "florence_bt.cli", "page", "--port", str(port))
        child.wait_for("Ctrl-C ends it")
        ros.spin_until(lambda: answers(port))
        return port, child

    return start


@pytest.fixture
def port(start_page: Callable[[], tuple[int, Child]]) -> Iterator[int]:
    """The port of a running page."""
    port, child = start_page()
    yield port
    child.end()


class Browser:
    """A page in a browser, driven from a test whose ROS nodes go on meanwhile."""

    def __init__(self, ros: Any, page: Any) -> None:
        self._ros = ros
        self.page = page

    def open(self, address: str) -> None:
        """Open an address, without waiting for an answer that a node of the test may have to give first."""
        self.page.evaluate(f"setTimeout(() => {{ location = {address!r} }})")

    def see(self, selector: str) -> Any:
        """Wait until something is to be seen."""
        found = self.page.locator(f"{selector} >> visible=true").first
        self._ros.spin_until(found.is_visible, timeout_s=240.0, what=selector)
        return found

    def click(self, selector: str) -> None:
        self.see(selector).click()

    def write(self, text: str) -> None:
        """Put a text in place of the one in the editor."""
        self.see(".cm-content").click()
        self.page.keyboard.press("ControlOrMeta+a")
        self.page.keyboard.insert_text(text)


@pytest.fixture
def browser(ros: Any) -> Iterator[Browser]:
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = chromium.new_page(viewport={"width": 1400, "height": 850})
        page.set_default_timeout(MOMENT_MS)
        yield Browser(ros, page)
        chromium.close()


TEA = """\
mission: tea
inputs:
  what: {type: text, default: tea}
tree:
  sequence:
    - sya: {text: "The $what is ready."}
    - wait: 1 s
"""


def test_a_mission_is_written_mended_tried_saved_and_run(
    ros: Any, port: int, browser: Browser, tmp_path: Path
) -> None:
    folder = tmp_path / "own"
    folder.mkdir()
    server = ros.add(MissionServer(folder))
    browser.open(f"http://localhost:{port}/edit/")
    browser.see("text=the robot is running")
    browser.click("button:has-text('New mission')")
    browser.see(".q-dialog input").fill("Tea")
    browser.click("button:has-text('Write it')")
    browser.see("text=nothing is wrong")
    # The mistake is told at its line, and its message mends it.
    browser.write(TEA)
    finding = browser.see(".florence-finding")
    assert "line 6" in finding.inner_text() and "sya" in finding.inner_text()
    browser.see(".cm-gutterElement:has-text('✗')")
    browser.click(".florence-finding a:has-text('say')")
    browser.see("text=nothing is wrong")
    # The drawing leads to the line, and a completion is offered beside it.
    browser.click("[role=treeitem]:has-text('wait')")
    browser.see(".cm-activeLine:has-text('wait: 1 s')")
    browser.see("[role=treeitem][aria-selected=true]:has-text('wait')")
    # In the rig it runs on the flat.
    browser.click(".q-tab:has-text('Try')")
    browser.see("[aria-label='what (text)']").fill("coffee")
    browser.click("button:has-text('Try it')")
    browser.see("text=/It succeeded after/")
    browser.see("[role=status]:has-text('The coffee is ready.')")
    # Saved, the robot reads it again, and runs it.
    browser.see("text=the robot is running")
    browser.click("button:has-text('Save')")
    browser.see("text=the robot: tea: reloaded")
    assert (folder / "tea.yaml").read_text() == TEA.replace("sya", "say")
    assert server.reloads == 1
    browser.click("button:has-text('Run on the robot')")
    browser.click(".q-dialog button:has-text('Run')")
    ros.spin_until(lambda: server.runs, what="the run")
    assert (server.runs[0].mission, server.runs[0].caller) == ("tea", "page (edit)")


def test_what_has_errors_becomes_a_draft_and_old_versions_come_back(
    ros: Any, port: int, browser: Browser, tmp_path: Path
) -> None:
    folder = tmp_path / "missions"  # there is no robot: the folder of the page
    folder.mkdir()
    (folder / "tea.yaml").write_text("mission: tea\ntree:\n  wait: 1 s\n")
    browser.page.set_viewport_size({"width": 390, "height": 800})
    browser.open(f"http://localhost:{port}/edit/tea")
    browser.see("text=no robot is running")
    browser.see("text=nothing is wrong")
    browser.write("mission: tea\ntree:\n  wate: 1 s\n")
    browser.see(".florence-finding")
    browser.page.keyboard.press("ControlOrMeta+s")
    browser.click("button:has-text('Keep the draft')")
    browser.see("text=/no robot reads it/")
    assert "wate" in (folder / ".drafts" / "tea.yaml").read_text()
    browser.write("mission: tea\ntree:\n  wait: 2 s\n")
    browser.see("text=nothing is wrong")
    browser.page.keyboard.press("ControlOrMeta+s")
    browser.see("text=/what stood there is kept/")
    assert "2 s" in (folder / "tea.yaml").read_text() and not list((folder / ".drafts").iterdir())
    draft, old = sorted((folder / ".versions" / "tea").iterdir())
    assert "wate" in draft.read_text() and "1 s" in old.read_text()
    # What is too long is not said to be saved while the text of before is.
    browser.write(f"# {'t' * 100_000}")
    browser.see("text=/at most 100000 bytes/")
    browser.see("text=not saved")
    browser.page.keyboard.press("ControlOrMeta+s")
    browser.see("text=/could not be checked/")
    assert "2 s" in (folder / "tea.yaml").read_text()


LEFT_ON = """\
mission: tea
tree:
  sequence:
    - start_tracker:
    - look_for_user: {}
"""


def test_a_mission_is_verified_its_way_saved_and_then_it_holds(
    ros: Any, port: int, browser: Browser, tmp_path: Path
) -> None:
    folder = tmp_path / "missions"
    folder.mkdir()
    (folder / "tea.yaml").write_text(LEFT_ON)
    browser.open(f"http://localhost:{port}/edit/tea")
    browser.see("text=nothing is wrong")
    browser.click(".q-tab:has-text('Verify')")
    browser.click("button:has-text('Verify it')")
    browser.see("text=tea: BROKEN, 1 thing")
    browser.see("text=/look for user: SUCCESS/")
    # Its line is marked, listed below the text, and a press leads there.
    browser.see(".cm-gutterElement:has-text('✗')")
    assert "left on" in browser.see(".florence-finding").inner_text()
    browser.click("button:has-text('line 5')")
    browser.see(".cm-activeLine:has-text('look_for_user')")
    # The way to it is played by the tab beside.
    browser.click("button:has-text('Save as scenario')")
    browser.see("text=/it fails until the mission is mended/")
    browser.click(".q-tab:has-text('Scenarios')")
    browser.click("button:has-text('Run the scenarios')")
    browser.see("text=0 of 1 passed")
    browser.write(f"{LEFT_ON}  finally:\n    stop_tracker:\n")
    browser.see("text=nothing is wrong")
    browser.click(".q-tab:has-text('Verify')")
    browser.click("button:has-text('Verify it')")
    browser.see("text=tea: holds")


def test_what_was_not_saved_is_kept_in_the_browser(
    ros: Any, port: int, browser: Browser, tmp_path: Path
) -> None:
    folder = tmp_path / "missions"
    folder.mkdir()
    (folder / "tea.yaml").write_text("mission: tea\ntree:\n  wait: 1 s\n")
    browser.open(f"http://localhost:{port}/edit/tea")
    browser.see("text=nothing is wrong")
    browser.write("mission: tea\ntree:\n  wait: 7 s\n")
    browser.see("text=not saved")
    browser.page.on("dialog", lambda dialog: dialog.accept())
    browser.open("about:blank")

    def left() -> bool:
        browser.page.wait_for_timeout(10)  # in which the question of the page is answered
        return str(browser.page.url) == "about:blank"

    ros.spin_until(left, what="the page to be left")
    browser.open(f"http://localhost:{port}/edit/tea")
    browser.see("text=/your text of .*, which was not saved/")
    assert "7 s" in browser.see(".cm-content").inner_text()
    browser.click("button:has-text('throw it away')")
    browser.see("text=nothing is wrong")
    assert "1 s" in browser.see(".cm-content").inner_text()


def test_a_token_that_may_only_run_gets_no_editor(
    start_page: Callable[[], tuple[int, Child]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    cookie = {role: f"{COOKIE}={make_token(role, tokens_file())}" for role in ("run", "edit")}
    port, child = start_page()
    assert b"token with the role edit" in get(port, "/edit/goto_user", Cookie=cookie["run"])[1]
    assert b"token with the role edit" not in get(port, "/edit/goto_user", Cookie=cookie["edit"])[1]
    assert get(port, "/edit/goto_user")[0] == 403
    assert get(port, "/edit/picture/map", Cookie=cookie["run"])[0] == 403
    asked = json.dumps({"text": "", "line": 1, "column": 1}).encode()
    assert post(port, asked, Cookie=cookie["run"]) == 403
    assert post(port, asked, Cookie=cookie["edit"]) == 200
    with (
        pytest.raises((ConnectionClosed, InvalidStatus)),
        connect(f"ws://127.0.0.1:{port}/edit/live", additional_headers={"Cookie": cookie["run"]}) as viewer,
    ):
        viewer.recv()
    child.end()


def post(port: int, body: bytes, **headers: str) -> int:
    """Ask for completions; give the status."""
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=60)) as client:
        client.request("POST", "/edit/complete", body, {"content-type": "application/json", **headers})
        return client.getresponse().status


def test_names_and_sizes_from_a_browser_are_not_believed(ros: Any, port: int) -> None:
    for name in ("..%2F..%2Fetc%2Fpasswd", "Tea", "x" * 300):
        status, page = get(port, f"/edit/{name}")
        assert status in (200, 404) and b"root:" not in page
    asked = {"text": "mission: tea\n", "line": 1, "column": 1}
    assert post(port, json.dumps(asked).encode()) == 200
    for wrong in ({"text": "x" * 100_001}, {"line": 0}, {"column": "no"}, {"text": None}):
        assert post(port, json.dumps({**asked, **wrong}).encode()) == 422
    assert post(port, b"x" * 1_500_000) == 403
