from __future__ import annotations

import io

import pytest
from rich.console import Console

from florence_bt.app.runs.live import LiveDisplay, LogDisplay, make_display, styled

TREE = "goto: RUNNING\n[>] goto (sequence)\n    [+] find room\n    [>] navigate to -- driving [/bold] on\n"


@pytest.fixture
def screen():
    return Console(file=io.StringIO(), width=40)


def lines(console):
    return console.file.getvalue().splitlines()


def test_a_line_comes_when_the_running_leaf_changes_and_only_then(screen):
    display = LogDisplay(screen)
    display.show("")
    display.show("[+] all is over\n[x] or failed")
    assert lines(screen) == []
    display.show(TREE)
    display.show(TREE)
    display.show(TREE.replace("find", "seek"))
    assert lines(screen) == ["  [>] navigate to -- driving [/bold] on"]
    display.show(TREE.replace("driving", "turning"))
    display.show(TREE)
    assert len(lines(screen)) == 3
    display.close()


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
