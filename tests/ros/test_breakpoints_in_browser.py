"""Breakpoints on the page in a real browser, before a real mission server whose skill is scripted."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from typing import Any

import pytest

pytest.importorskip("nicegui")
pytest.importorskip("rclpy")
playwright = pytest.importorskip("playwright.sync_api", reason="playwright drives the browser")
if shutil.which("chromium") is None:
    pytest.skip("there is no chromium", allow_module_level=True)

from florence_bt.core.outcome import success  # noqa: E402
from florence_bt.mission_testing.mocks.mocks import Step  # noqa: E402

pytestmark = pytest.mark.ros
THERE_AND_BACK = """mission: trip
description: Drives there and back.
inputs:
  way: {type: length, default: 1 m}
tree:
  sequence:
    - {drive: {way: $way}, name: there}
    - {drive: {way: $way}, name: back}
    - {drive: {way: $way}, name: home}
"""
QUICK = [Step(success(), after=0.05)] * 20


@pytest.fixture
def bench(bench_of: Callable[..., Any]) -> Any:
    """A mission server that knows the mission ``trip``, whose drives take no time."""
    bench = bench_of(*QUICK)
    (bench.missions / "trip.yaml").write_text(THERE_AND_BACK)
    return bench


def gutter(page: Any, node: str) -> Any:
    """Return what is clicked to set a breakpoint before a node."""
    row = page.get_by_role("treeitem").filter(has_text=node).get_attribute("id")
    return page.locator(f".florence-gutter:has(+ #{row})")


def seen(bench: Any, what: Any) -> None:
    """Wait until something is on the screen."""
    bench.ros.spin_until(lambda: what.count(), what=f"on the screen: {what}")


def button(page: Any, name: str) -> Any:
    return page.get_by_role("button", name=name, exact=True)


def stand_before(bench: Any, page: Any, node: str) -> None:
    """Wait until the page says that the run stands before a node, and may go on."""
    seen(bench, page.get_by_label("paused").filter(has_text=f"a breakpoint before '{node}'"))
    if button(page, "Go on").count():
        bench.ros.spin_until(button(page, "Go on").is_enabled, what="that it may go on")


def begin(bench: Any, page: Any, *breakpoints: str) -> str:
    """Start the mission, which stands before its first drive; return its run."""
    assert bench.breakpoints(add=["there", *breakpoints]).success
    run_id: str = bench.run("trip").run_id
    stand_before(bench, page, "there")
    seen(bench, page.get_by_role("treeitem").filter(has_text="there"))
    return run_id


def test_a_click_sets_a_breakpoint_and_takes_it_away_again(bench: Any, open_page: Any) -> None:
    page = open_page()
    run_id = begin(bench, page)
    gutter(page, "back").click()
    seen(bench, page.get_by_label("breakpoints").get_by_text("trip/back"))
    assert list(bench.breakpoints().breakpoints) == ["there", "trip/back"]
    assert gutter(page, "back").get_attribute("data-set") == "true"
    button(page, "Go on").click()
    stand_before(bench, page, "back")
    assert len(bench.drive.runs) == 1
    gutter(page, "back").click()
    bench.ros.spin_until(
        lambda: list(bench.breakpoints().breakpoints) == ["there"], what="one breakpoint less"
    )
    button(page, "Go on").click()
    assert bench.wait("SUCCEEDED", run_id)
    seen(bench, page.get_by_text("trip succeeded", exact=False))
    assert not page.get_by_label("the run stands").count()


def test_the_keys_choose_a_row_set_a_breakpoint_step_and_go_on(bench: Any, open_page: Any) -> None:
    page = open_page()
    run_id = begin(bench, page)
    page.get_by_role("tree").focus()
    for key in ("ArrowDown", "ArrowDown", "ArrowDown", "ArrowDown", "b"):
        page.keyboard.press(key)
    seen(bench, page.get_by_label("breakpoints").get_by_text("trip/home"))
    for key, node in (("s", "back"), ("c", "home")):
        page.keyboard.press(key)
        stand_before(bench, page, node)
    page.get_by_label("find a node").focus()
    page.keyboard.press("c")
    page.get_by_role("tree").focus()
    assert bench.status().state == "PAUSED", "who writes a word does not drive"
    page.keyboard.press(" ")
    assert bench.wait("SUCCEEDED", run_id) and len(bench.drive.runs) == 3


def test_breakpoints_of_others_are_seen_and_who_may_only_look_changes_none(
    bench: Any, open_page: Any
) -> None:
    page = open_page("look")
    begin(bench, page, "trip/home")
    seen(bench, page.get_by_label("breakpoints").get_by_text("trip/home"))
    assert gutter(page, "home").get_attribute("data-set") == "true"
    assert gutter(page, "back").get_attribute("data-set") == "false"
    gutter(page, "back").click()
    page.get_by_role("tree").focus()
    for key in ("ArrowDown", "b", "s", "c"):
        page.keyboard.press(key)
    assert not button(page, "Go on").count()
    bench.ros.spin_for(1.0)
    assert list(bench.breakpoints().breakpoints) == ["there", "trip/home"]
    assert bench.status().state == "PAUSED"
    bench.breakpoints(clear=True)
    bench.ros.spin_until(
        lambda: not page.get_by_label("breakpoints").count(), what="the end of all breakpoints"
    )


@pytest.mark.parametrize("size", [(1280, 800), (390, 780)], ids=["desk", "phone"])
def test_the_bar_hides_nothing_and_is_hidden_by_nothing(bench: Any, open_page: Any, size: Any) -> None:
    page = open_page()
    page.set_viewport_size({"width": size[0], "height": size[1]})
    begin(bench, page)
    for name in ("Step", "Go on", "STOP THE ROBOT"):
        button(page, name).click(trial=True)
    gutter(page, "there").click(trial=True)
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    button(page, "Stop").click()
    assert bench.wait("STOPPED") and not bench.drive.runs
