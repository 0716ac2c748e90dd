"""Takes the pictures of the page for the manual: a run of goto_user in the simulated flat, seen in a browser.

``python -m tools.page_pictures docs/img`` writes ``page.png`` (while it runs), ``page_run.png`` (how it ran)
and ``page_phone.png``. It needs Debian's chromium and takes two minutes.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

PORT = 8099
ADDRESS = f"http://localhost:{PORT}"
PATIENCE_MS = 300_000.0
SHOWN_AT_MS = 9_000.0
"""Into the run: the robot is on its way."""
SCREEN, PHONE = {"width": 1280, "height": 720}, {"width": 390, "height": 780}


@contextmanager
def system(folder: str) -> Iterator[None]:
    """Have a running system with its page."""
    words = ["up", "--sim", "--person", "kitchen", "--seed", "4", "--out", folder]
    words += ["--page", "--page-port", str(PORT)]
    command = [sys.executable, "-m", "florence_bt.cli", *words]
    no_tokens = {**os.environ, "XDG_CONFIG_HOME": folder}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=no_tokens)
    try:
        assert process.stdout is not None
        for line in process.stdout:
            print(line, end="")
            if "Ctrl-C ends all" in line:
                break
        yield
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait()


def take(page: Page, folder: Path) -> None:
    """Start a run and take the pictures."""
    page.goto(ADDRESS)
    expect(page.get_by_text("no map has come yet")).to_have_count(0)
    page.get_by_role("button", name="Start…").click()
    page.get_by_role("dialog").get_by_label("mission").fill("goto_user")
    page.get_by_role("option", name="goto_user", exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Start").click()
    expect(page.get_by_role("status")).to_contain_text("goto_user runs")
    page.wait_for_timeout(SHOWN_AT_MS)
    page.screenshot(path=folder / "page.png")
    page.set_viewport_size(PHONE)
    page.get_by_role("button", name="whole map").click()
    page.wait_for_timeout(1000.0)
    page.screenshot(path=folder / "page_phone.png")
    page.set_viewport_size(SCREEN)
    expect(page.get_by_role("status")).not_to_contain_text("runs")
    page.get_by_role("link", name="goto_user").click()
    slider = page.get_by_role("slider").first.bounding_box()
    assert slider is not None
    page.mouse.click(slider["x"] + 0.6 * slider["width"], slider["y"] + slider["height"] / 2.0)
    page.wait_for_timeout(2000.0)
    page.screenshot(path=folder / "page_run.png")


def main() -> None:
    """Take the pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the pictures go, e.g. docs/img")
    folder = parser.parse_args().folder
    chromium = shutil.which("chromium")
    if chromium is None:
        parser.error("there is no browser: apt install chromium")
    with tempfile.TemporaryDirectory() as runs, system(runs), sync_playwright() as started:
        browser = started.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport=SCREEN)
        page.set_default_timeout(PATIENCE_MS)
        expect.set_options(timeout=PATIENCE_MS)
        take(page, folder)
        browser.close()


if __name__ == "__main__":
    main()
