"""Shows a recorded run in the terminal step by step, with keys; elsewhere its steps as lines."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from contextlib import suppress

from rich.console import Console, Group
from rich.live import Live
from rich.text import Text

from florence_bt.app.runs.film import Film, Frame
from florence_bt.app.runs.keyboard import Keyboard
from florence_bt.app.runs.screen import LEAST_COLUMNS, LEAST_LINES, Detail, choose, draw_row, lines_of

KEYS = "→ next  ← before  f F failures  g G start, end  q leave"
MOST_SENTENCES = 4
"""Sentences of a moment that are shown at most."""
MOST_KEYS = 3
"""Lines for the keys."""
KEYS_LOOK_S = 0.3
"""Seconds between two looks whether the terminal has another size."""
PAGE = 10
"""Steps of a page key."""


def show_film(film: Film, console: Console) -> None:
    """Show a run until the person leaves."""
    fits = console.width >= LEAST_COLUMNS and console.height >= LEAST_LINES
    with Keyboard() as keyboard:
        if not console.is_terminal or console.is_dumb_terminal or keyboard.closed or not fits:
            for line in film_lines(film):
                console.print(line, highlight=False, markup=False, soft_wrap=True)
            return
        live = Live(console=console, screen=True, auto_refresh=False, redirect_stdout=False)
        with suppress(OSError), live:  # the terminal may be closed
            _show(film, console, keyboard, live)


def _show(film: Film, console: Console, keyboard: Keyboard, live: Live) -> None:
    number = 0
    while not keyboard.closed:
        live.update(Group(*draw(film, number, *console.size)), refresh=True)
        for key in keyboard.read(None, KEYS_LOOK_S):
            if key == "q":
                return
            number = moved(film, number, key)


def moved(film: Film, number: int, key: str) -> int:
    """Return the step to which a key leads; the same when it means nothing."""
    last = len(film) - 1
    steps = {"right": 1, " ": 1, "l": 1, "left": -1, "h": -1, "page down": PAGE, "page up": -PAGE}
    if key in steps:
        return min(max(number + steps[key], 0), last)
    if key in ("g", "home"):
        return 0
    if key in ("G", "end"):
        return last
    if key == "f":
        return next(iter(film.failures[bisect_right(film.failures, number) :]), number)
    if key == "F":
        return next(reversed(film.failures[: bisect_left(film.failures, number)]), number)
    return number


def draw(film: Film, number: int, columns: int, lines: int) -> list[Text]:
    """Draw a step: at most so many lines, none of them wider than the terminal."""
    frame = film.frame(number)
    top = list(_top(film, frame))
    bottom = [Text(film.ends_early, "yellow")] if film.ends_early and number == len(film) - 1 else []
    bottom.append(Text(KEYS, "dim"))
    room = lines - len(top) - len(bottom)
    shown = lines_of(frame.rows, Detail.FOLDED)
    chosen = choose(shown, frame.rows, room) if room > 0 else []
    tree = [draw_row(line.row, columns)[0] for line in chosen]
    drawn = [*top, *tree, *(Text() for _ in range(room - len(tree))), *bottom]
    for line in drawn:
        line.no_wrap = True
        line.truncate(columns, overflow="ellipsis")
    return drawn[:lines]


def _top(film: Film, frame: Frame) -> Iterator[Text]:
    row = film.recorded.row
    yield Text(
        f"{row.mission}, step {frame.number + 1} of {len(film)} · tick {frame.tick} · +{frame.at:.1f} s",
        "bold",
    )
    for sentence in frame.happened[:MOST_SENTENCES]:
        yield Text(f"  {sentence}", "cyan")
    if frame.said:
        yield Text(f'said    "{frame.said[-1]}"')
    new_first = sorted(frame.keys, key=lambda name: name not in frame.changed)
    for name in new_first[:MOST_KEYS]:
        yield Text(f"key     {_short(name)} = {frame.keys[name]}", "green" if name in frame.changed else "")


def _short(key: str) -> str:
    """Return the name of a key, with the called mission that has it."""
    return "/".join(key.split("/")[-2:]).removeprefix("/")


def film_lines(film: Film) -> Iterator[str]:
    """Yield the steps of a run, a line for each sentence."""
    row = film.recorded.row
    yield f"{row.run_id}: {row.state}{f', {row.code}: {row.reason}' if row.reason else ''}"
    for number in range(len(film)):
        frame = film.frame(number)
        when = f"{f'+{frame.at:.1f} s':>10}  tick {frame.tick:<4}"
        changed = [f"{_short(name)} = {frame.keys[name]}" for name in frame.keys if name in frame.changed]
        for line in (*frame.happened, *changed):
            yield f"{when}  {line}"
            when = " " * len(when)
    if film.ends_early:
        yield f"here it ends: {film.ends_early}"
