from __future__ import annotations

import io

import pytest
from rich.console import Console

from florence_bt.app.runs.live import LiveDisplay, LogDisplay, around_what_runs, make_display, styled

TREE = "goto: RUNNING\n[>] goto (sequence)\n    [+] find room\n    [>] navigate to -- driving [/bold] on\n"


@pytest.fixture
def screen():
    return Console(file=io.StringIO(), width=40)


def lines(console):
    return console.file.getvalue().splitlines()


def test_a_line_comes_when_another_leaf_runs_and_only_then(screen):
    display = LogDisplay(screen)
    display.show("")
    display.show("[+] all is over\n[-] or stopped")
    assert lines(screen) == []
    display.show(TREE)
    display.show(TREE)
    display.show(TREE.replace("find", "seek"))
    display.show(TREE.replace("driving", "turning"))
    assert lines(screen) == ["  [>] navigate to"]
    display.show(f"{TREE}    [>] look\n    [>] look\n")
    display.show(TREE)
    display.show(f"{TREE}    [>] look\n")
    assert lines(screen)[1:] == ["  [>] navigate to, look"]
    display.show("[>] goto\n    [>] stop")
    display.show(TREE)
    assert lines(screen)[2:] == ["  [>] stop", "  [>] navigate to"]
    display.close()


def test_each_new_failure_of_a_leaf_has_a_line(screen):
    display = LogDisplay(screen)
    first = TREE.replace("[+] find room", "[x] find room -- no [b] answer")
    display.show(first)
    display.show(TREE)
    display.show(first)
    display.show("[x] goto -- no way\n    [x] drive -- too far")
    assert lines(screen) == [
        "  [x] find room -- no [b] answer",
        "  [>] navigate to",
        "  [x] drive -- too far",
    ]


@pytest.mark.parametrize("display_class", [LogDisplay, LiveDisplay])
def test_what_looks_like_markup_is_printed_as_it_is(screen, display_class):
    display = display_class(screen)
    text = "a [/bold] [red]word[/] " + "and a long tail " * 5
    display.say(text)
    display.show(TREE)
    display.close()
    assert text.rstrip() in screen.file.getvalue()


def test_without_a_terminal_there_is_no_live_picture():
    assert isinstance(make_display(Console(file=io.StringIO()), headless=False), LogDisplay)
    terminal = Console(file=io.StringIO(), force_terminal=True)
    assert isinstance(make_display(terminal, headless=True), LogDisplay)
    display = make_display(terminal, headless=False)
    display.show(TREE)
    display.close()
    assert isinstance(display, LiveDisplay)


def test_marks_have_colours_and_the_text_stays(screen):
    text = styled(TREE)
    assert text.plain == TREE
    assert {"green", "bold cyan"} <= {str(span.style) for span in text.spans}


LONG = "goto: RUNNING\n[>] goto (sequence)\n" + "".join(
    f"{'    ' * depth}{mark} node {depth}\n"
    for depth, mark in enumerate("[>]" if i < 30 else "[ ]" for i in range(40))
)


def test_of_a_long_status_the_live_display_shows_what_runs():
    console = Console(file=io.StringIO(), width=80, height=24, force_terminal=True)
    display = LiveDisplay(console)
    display.show(LONG)
    display.close()
    shown = console.file.getvalue()
    assert "goto: RUNNING" in shown and "node 29" in shown and "node 30" not in shown


@pytest.mark.parametrize("lines", [3, 10, 41])
def test_as_many_lines_as_there_is_room_for(lines):
    found = around_what_runs(LONG, lines, 60).splitlines()
    assert len(found) == lines and found[0] == "goto: RUNNING"
    assert any("[>] node 29" in line[:60] for line in found)
