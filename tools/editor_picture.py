"""Makes the pictures of the editor: a mission that is tried, and one of which something does not hold.

``python -m tools.editor_picture docs/img/editor.png docs/img/editor_verify.png``. Starts a page without a
robot, and opens the missions in a browser (playwright, Debian's chromium).
"""

from __future__ import annotations

import argparse
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

MISSION = """\
mission: tea_round
description: The robot asks in some rooms who wants tea, and goes home.
inputs:
  rooms: {type: list of text, default: [kitchen, study]}
tree:
  sequence:
    - for_each: $rooms
      as: room
      do:
        sequence:
          - run: goto_room
            with: {room: $room}
          - say: {text: "Tea is ready. Who is in the $room?"}
          - wait: 2 s
    - run: go_home
      on_failure:
        any:
          say: {text: I could not get home.}
"""
LIGHT = """\
mission: fetch_light
description: Looks in the dark whether somebody is there.
keys:
  lit: {type: boolean, default: false}
properties:
  - never: it ends while $lit
    because: The light is left on.
tree:
  sequence:
    - run: goto_room
      with: {room: kitchen}
    - set: {lit: true}
    - say: {text: "Light, please!"}
    - run: detect_user
    - say: {text: "Light off, please!"}
    - set: {lit: false}
"""
SIZE = {"width": 1400, "height": 860}
LONGEST_MS = 300_000


def draw(tried: Path, verified: Path) -> None:
    """Make the pictures."""
    with tempfile.TemporaryDirectory(prefix="florence_picture_") as folder:
        missions = Path(folder) / "missions"
        missions.mkdir()
        (missions / "tea_round.yaml").write_text(MISSION)
        (missions / "fetch_light.yaml").write_text(LIGHT)
        port = _free_port()
        command = [sys.executable, "-m", "florence_bt.cli", "page", "--port", str(port)]
        environment = {**os.environ, "XDG_CONFIG_HOME": folder}
        server = subprocess.Popen([*command, "--missions", str(missions)], env=environment)
        try:
            _wait_for(port)
            with sync_playwright() as driver:
                chromium = driver.chromium.launch(
                    executable_path=shutil.which("chromium"), args=["--no-sandbox"]
                )
                page = chromium.new_page(viewport=SIZE)
                page.set_default_timeout(LONGEST_MS)
                page.goto(f"http://localhost:{port}/edit/tea_round")
                _try_it(page)
                page.screenshot(path=tried)
                page.goto(f"http://localhost:{port}/edit/fetch_light")
                _verify_it(page)
                page.screenshot(path=verified)
                chromium.close()
        finally:
            server.terminate()
            server.wait()


def _try_it(page: Page) -> None:
    page.wait_for_selector("text=nothing is wrong")
    page.click(".q-tab:has-text('Insert')")
    page.click(".cm-line:has-text('goto_room')")
    page.click(".q-tab:has-text('Try')")
    page.click("button:has-text('Try it')")
    page.wait_for_selector("text=/It (succeeded|failed)/")
    page.wait_for_timeout(1000)


def _verify_it(page: Page) -> None:
    page.wait_for_selector("text=nothing is wrong")
    page.click(".q-tab:has-text('Verify')")
    page.click("button:has-text('Verify it')")
    page.wait_for_selector("text=It comes like this")
    page.wait_for_timeout(1000)


def _free_port() -> int:
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        port: int = server.getsockname()[1]
        return port


def _wait_for(port: int) -> None:
    while True:
        with socket.socket() as client:
            if client.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.2)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tried", type=Path)
    parser.add_argument("verified", type=Path)
    given = parser.parse_args()
    draw(given.tried, given.verified)
