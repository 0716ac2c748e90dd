"""The live display on a real pseudo-terminal, and the log lines where there is none."""

from __future__ import annotations

import fcntl
import io
import os
import pty
import struct
import termios
import time
from contextlib import closing

import pytest
from rich.console import Console, ConsoleDimensions

from florence_bt.app.runs.live import LiveDisplay, LogDisplay, make_display
from florence_bt.runtime.viewers.run_tree import RunTree
from tests.unit.app.written_trees import written_tree

TREE = "goto: RUNNING\n[>] goto (sequence)\n    [+] find room\n    [>] navigate to -- driving [/bold] on\n"


@pytest.fixture
def screen():
    return Console(file=io.StringIO(), width=60)


def lines(console):
    return console.file.getvalue().splitlines()


def test_a_line_comes_when_a_leaf_begins_or_says_something_else(screen):
    display = LogDisplay(screen)
    display.show(RunTree())
    display.show(written_tree("goto: SUCCEEDED\n[+] all is over"))
    assert lines(screen) == []
    display.show(written_tree(TREE))
    display.show(written_tree(TREE))
    display.show(written_tree(TREE.replace("find", "seek")))
    assert lines(screen) == ["  [>] navigate to -- driving [/bold] on"]
    display.show(written_tree(TREE.replace("RUNNING", "RUNNING · 7.5 s").replace("driving", "turning")))
    assert lines(screen)[1:] == ["   7.5 s  [>] navigate to -- turning [/bold] on"]
    display.show(written_tree(f"{TREE}    [>] look\n"))
    display.show(written_tree(TREE))
    assert lines(screen)[2:] == ["  [>] navigate to -- driving [/bold] on", "  [>] look"]
    display.close()


def test_each_new_failure_of_a_leaf_has_a_line(screen):
    display = LogDisplay(screen)
    first = TREE.replace("[+] find room", "[x] find room -- no [b] answer")
    display.show(written_tree(first))
    display.show(written_tree(first))
    display.show(written_tree("goto: FAILED\n[x] goto\n    [x] drive -- too far"))
    assert lines(screen) == [
        "  [x] find room -- no [b] answer",
        "  [>] navigate to -- driving [/bold] on",
        "  [x] drive -- too far",
    ]


@pytest.mark.parametrize("display_class", [LogDisplay, LiveDisplay])
def test_what_looks_like_markup_is_printed_as_it_is(screen, display_class):
    display = display_class(screen)
    text = "a [/bold] [red]word[/] " + "and a long tail " * 5
    display.say(text)
    display.close()
    assert text.rstrip() in screen.file.getvalue()


@pytest.mark.parametrize(
    ("terminal", "columns", "term", "headless", "kind"),
    [
        (True, 80, "xterm", False, LiveDisplay),
        (True, 60, "xterm", False, LiveDisplay),
        (True, 59, "xterm", False, LogDisplay),
        (True, 80, "dumb", False, LogDisplay),
        (True, 80, "xterm", True, LogDisplay),
        (False, 80, "xterm", False, LogDisplay),
    ],
)
def test_the_screen_is_for_terminals_that_are_large_enough(terminal, columns, term, headless, kind):
    console = Console(
        file=io.StringIO(), force_terminal=terminal, width=columns, height=24, _environ={"TERM": term}
    )
    assert type(make_display(console, headless=headless)) is kind


class Terminal:
    """A pseudo-terminal; what was written to it is read only when a test asks."""

    def __init__(self, monkeypatch):
        self.master, slave = pty.openpty()
        self.resize(80, 24)
        os.set_blocking(self.master, False)
        self._output = os.fdopen(slave, "w", encoding="utf-8")
        self._input = os.fdopen(os.dup(slave), encoding="utf-8")
        monkeypatch.setattr("sys.stdin", self._input)
        monkeypatch.setattr("florence_bt.app.runs.keyboard.in_front", lambda: True)
        self.console = Console(
            file=self._output, force_terminal=True, color_system=None, _environ={"TERM": "xterm"}
        )
        monkeypatch.setattr(
            Console, "size", property(lambda console: ConsoleDimensions(*os.get_terminal_size(self.master)))
        )

    def close(self):
        while self.read():
            pass
        self._output.close()
        self._input.close()
        os.close(self.master)

    def resize(self, columns, rows):
        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def read(self):
        try:
            return os.read(self.master, 1 << 20).decode()
        except BlockingIOError:
            return ""

    def wait_for(self, text, timeout_s=20.0):
        seen, end = "", time.monotonic() + timeout_s
        while text not in seen:
            assert time.monotonic() < end, f"no {text!r} in {seen!r}"
            time.sleep(0.01)
            seen += self.read()
        return seen

    def press(self, keys):
        os.write(self.master, keys.encode())

    @property
    def echoes(self):
        return bool(termios.tcgetattr(self.master)[3] & termios.ECHO)


@pytest.fixture
def terminal(monkeypatch):
    with closing(Terminal(monkeypatch)) as terminal:
        yield terminal


def wait(condition, timeout_s=20.0):
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_the_screen_takes_keys_and_gives_the_terminal_back(terminal):
    display = LiveDisplay(terminal.console)
    display.say("before")
    assert "before" in terminal.read() and terminal.echoes
    display.show(written_tree(TREE), where="in the hall")
    first = terminal.wait_for("q leave")
    assert "\x1b[?1049h" in first and "in the hall" in first and not terminal.echoes
    display.say("the process 'people' answers again")
    terminal.wait_for("answers again")
    terminal.press("/driv")
    terminal.wait_for("/driv")
    terminal.press("\rq")
    wait(lambda: display.left)
    display.close()
    last = terminal.wait_for("\x1b[?1049l")
    terminal_after = last.partition("\x1b[?1049l")[2] or terminal.wait_for("answers again")
    assert "answers again" in terminal_after and terminal.echoes


def test_a_larger_terminal_is_used_at_once(terminal):
    display = LiveDisplay(terminal.console)
    display.show(written_tree(TREE.replace("driving", "driving " + "on " * 30 + "end")))
    terminal.wait_for("follows")
    terminal.resize(200, 40)
    terminal.wait_for("─" * 150)
    display.close()


def test_a_terminal_that_takes_nothing_holds_nobody_up(terminal, monkeypatch):
    monkeypatch.setattr("florence_bt.app.runs.live.LAST_PICTURE_S", 0.2)
    display = LiveDisplay(terminal.console)
    begin = time.monotonic()
    display.show(written_tree(TREE))
    while display._thread is None or time.monotonic() < begin + 3.0:  # until the terminal is full
        one = time.monotonic()
        display.show(written_tree(TREE.replace("driving", f"driving {one} " + "x" * 5000)))
        assert time.monotonic() - one < 1.0
        time.sleep(0.02)
    display.close()
    assert terminal.echoes
    wait(lambda: terminal.read() == "" and not display._thread.is_alive())
