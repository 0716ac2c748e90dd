"""Takes the pictures of the page for the manual: a run of goto_user in the simulated flat, seen in a browser.

``python -m tools.page_pictures docs/img`` writes ``page.png`` and ``page_phone.png`` (while it runs),
``page_run.png`` and ``page_run_phone.png`` (how it ran), ``page_breakpoint.png`` and
``page_breakpoint_phone.png`` (it stands before a node), and in each state of its link
``page_stopped_phone.png``, ``page_missions_silent.png``, ``page_cut_off.png``, ``page_not_confirmed.png``,
``page_started_again.png``. It needs chromium and takes three minutes on a machine with nothing else to do.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from playwright.sync_api import Locator, Page, expect, sync_playwright

PORT = 8099
ADDRESS = f"http://localhost:{PORT}"
PATIENCE_MS = 300_000.0
SHOWN_AT_MS = 9_000.0
"""Into the run: the robot is on its way."""
STANDS_BEFORE = "what is said"
"""Of the name of a node of goto_user that comes when the robot has driven and looked."""
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
    start(page)
    page.wait_for_timeout(SHOWN_AT_MS)
    page.screenshot(path=folder / "page.png")
    page.set_viewport_size(PHONE)
    page.get_by_role("button", name="whole map").click()
    page.wait_for_timeout(1000.0)
    page.screenshot(path=folder / "page_phone.png")
    page.set_viewport_size(SCREEN)
    page.get_by_role("button", name="Stop", exact=True).click()
    expect(status(page)).to_contain_text("was stopped")


def take_breakpoint(page: Page, folder: Path) -> None:
    """Start a run, set a breakpoint by a click, and take the pictures when the run stands there."""
    start(page)
    word = page.get_by_label("find a node")
    word.fill(STANDS_BEFORE)
    row = page.get_by_role("treeitem").filter(has_text=STANDS_BEFORE).first.get_attribute("id")
    page.locator(f".florence-gutter:has(+ #{row})").click()
    word.fill("")
    expect(page.get_by_role("button", name="Go on", exact=True)).to_be_enabled()
    page.wait_for_timeout(1000.0)
    page.screenshot(path=folder / "page_breakpoint.png")
    page.set_viewport_size(PHONE)
    page.get_by_role("button", name="whole map").click()
    page.wait_for_timeout(1000.0)
    page.screenshot(path=folder / "page_breakpoint_phone.png")
    page.set_viewport_size(SCREEN)
    page.get_by_role("button", name="Stop", exact=True).click()
    page.get_by_role("button", name=re.compile("^take away")).click()
    expect(status(page)).to_contain_text("was stopped")


def take_run(page: Page, folder: Path) -> None:
    """Take the pictures of the last run, as it stood somewhere in it."""
    page.goto(ADDRESS)
    page.get_by_role("link", name="goto_user").click()
    slider = page.get_by_role("slider").first.bounding_box()
    assert slider is not None
    page.mouse.click(slider["x"] + 0.6 * slider["width"], slider["y"] + slider["height"] / 2.0)
    page.wait_for_timeout(2000.0)
    page.screenshot(path=folder / "page_run.png")
    page.set_viewport_size(PHONE)
    page.get_by_role("button", name="whole map").click()
    page.wait_for_timeout(1000.0)
    page.screenshot(path=folder / "page_run_phone.png")
    page.set_viewport_size(SCREEN)


def start(page: Page) -> None:
    """Start goto_user from the form."""
    page.goto(ADDRESS)
    expect(page.get_by_text("no map has come yet")).to_have_count(0)
    page.get_by_role("button", name="Start…").click()
    page.get_by_role("dialog").get_by_label("mission").fill("goto_user")
    page.get_by_role("option", name="goto_user", exact=True).click()
    page.get_by_role("dialog").get_by_role("button", name="Start").click()
    expect(status(page)).to_contain_text("goto_user runs")


def status(page: Page) -> Locator:
    """Return the line that says how things stand."""
    return page.get_by_role("status").first


def take_states(page: Page, folder: Path, run: Path) -> None:
    """Take a picture of each state of the link between the page and the robot.

    Args:
        page: In a browser.
        folder: Where the pictures go.
        run: The folder of the bring-up, which has the process ids.
    """
    page.goto(ADDRESS)
    word = page.locator(".florence-bar .word")
    stop = page.get_by_role("button", name="STOP THE ROBOT")
    page.set_viewport_size(PHONE)
    stop.click()
    expect(word).to_have_attribute("data-state", "stopped")
    page.wait_for_timeout(2500.0)
    page.screenshot(path=folder / "page_stopped_phone.png")
    page.get_by_role("button", name="Release").click()
    page.set_viewport_size(SCREEN)
    expect(word).to_have_attribute("data-state", "free")
    with stopped(run, "missions"):
        expect(status(page)).to_contain_text("the mission server has said nothing")
        page.screenshot(path=folder / "page_missions_silent.png")
    with stopped(run, "page"):
        expect(word).to_contain_text("what you see is old")
        page.screenshot(path=folder / "page_cut_off.png")
    expect(word).to_have_attribute("data-state", "free")
    with stopped(run, "page"):
        stop.click()
        expect(word).to_contain_text("NOT CONFIRMED")
        page.screenshot(path=folder / "page_not_confirmed.png")
    expect(word).to_have_attribute("data-state", "stopped")
    page.get_by_role("button", name="Release").click()
    os.kill(pid_of(run, "page"), signal.SIGKILL)
    expect(word).to_contain_text("started again")
    page.screenshot(path=folder / "page_started_again.png")


def pid_of(run: Path, process: str) -> int:
    """Return the id of a process of the bring-up."""
    words = f"florence_bt.app.bringup.process {process} {run}"
    return int(subprocess.run(["pgrep", "-f", words], capture_output=True, check=True).stdout.split()[0])


@contextmanager
def stopped(run: Path, process: str) -> Iterator[None]:
    """Have a process of the bring-up stopped."""
    pid = pid_of(run, process)
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        with suppress(ProcessLookupError):  # the supervisor has killed it, and started another one
            os.kill(pid, signal.SIGCONT)


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
        take_breakpoint(page, folder)
        take_run(page, folder)
        take_states(page, folder, Path(runs))
        browser.close()


if __name__ == "__main__":
    main()
