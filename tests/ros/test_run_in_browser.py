"""A recorded run on the page in a real browser: slider, keys and marks, at a desk and on a phone."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")
playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
if shutil.which("chromium") is None:
    pytest.skip("there is no chromium", allow_module_level=True)

from florence_page.history import run_address  # noqa: E402

from florence_bt.app.runs.playback import Playback, read_playback  # noqa: E402
from tests.recorded_runs import record_run, resumable_missions  # noqa: E402

pytestmark = pytest.mark.ros


@pytest.fixture
def run(tmp_path: Path) -> Playback:
    """A run that was killed, went on, and failed."""
    resumable_missions(tmp_path / "missions")
    recorded, _ = record_run(tmp_path / "missions", tmp_path / "runs", "goto_user", 3)
    return read_playback(tmp_path / "runs", recorded.run_id)


@pytest.fixture
def page(open_page: Any, run: Playback, tmp_path: Path) -> Any:
    """A browser that looks at the run."""
    opened = open_page("", "--folder", tmp_path / "runs")
    opened.goto(f"{opened.url.rstrip('/')}/{run_address(run.run.run_id)}")
    return opened


def stands_at(page: Any, run: Playback, step: int) -> None:
    """Wait until a step is shown."""
    page.get_by_text(re.compile(rf"^step {step + 1} of {len(run)} ·")).wait_for()


def test_the_keys_go_through_the_run_and_its_failures(page: Any, run: Playback) -> None:
    failures = [mark.step for mark in run.marks if mark.kind == "failure"]
    stands_at(page, run, len(run) - 1)
    for key, step in (
        ("g", 0),
        ("ArrowRight", 1),
        ("ArrowLeft", 0),
        ("f", failures[0]),
        ("f", failures[1]),
        ("F", failures[0]),
        ("G", len(run) - 1),
    ):
        page.keyboard.press(key)
        stands_at(page, run, step)
    page.get_by_label("find a node").fill("fg")
    stands_at(page, run, len(run) - 1)


def test_one_press_of_an_arrow_is_one_step_also_on_the_slider(page: Any, run: Playback) -> None:
    stands_at(page, run, len(run) - 1)
    page.get_by_role("slider").focus()
    page.keyboard.press("ArrowLeft")
    stands_at(page, run, len(run) - 2)
    page.get_by_role("button", name=re.compile("^before")).click()
    page.keyboard.press("ArrowLeft")
    stands_at(page, run, len(run) - 4)


@pytest.mark.parametrize("size", [(1280, 720), (390, 780)], ids=["desk", "phone"])
def test_marks_lead_to_their_steps_and_all_is_on_the_screen(page: Any, run: Playback, size: Any) -> None:
    page.set_viewport_size({"width": size[0], "height": size[1]})
    stands_at(page, run, len(run) - 1)
    page.get_by_role("button", name="stop", exact=True).first.click()
    stands_at(page, run, next(mark.step for mark in run.marks if mark.kind == "stop"))
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    assert page.get_by_role("list", name="keys").get_by_text("room = ").first.is_visible()
    for part in (page.get_by_role("tree"), page.locator("canvas"), page.get_by_role("slider")):
        box = part.bounding_box()
        assert box["height"] > 10 and box["y"] + box["height"] <= size[1]
