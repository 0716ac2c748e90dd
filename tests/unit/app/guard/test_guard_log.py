"""What others cause is logged in so many lines a minute, each of one line, none with a traceback."""

from __future__ import annotations

import logging

import pytest

from florence_bt.app.guard.log import (
    LINES_S,
    LOGGERS,
    LONGEST_LINE,
    MOST_LINES,
    BoundedHandler,
    Seldom,
    bound_logs,
    one_line,
)


def test_so_many_lines_are_said_and_of_the_rest_how_many_there_were() -> None:
    said: list[str] = []
    now = 5.0
    seldom = Seldom(said.append, lambda: now)
    for number in range(1_000):
        seldom(f"line {number}")
    assert said == [f"line {number}" for number in range(MOST_LINES)]
    now += LINES_S
    seldom("again")
    assert said[MOST_LINES:] == [f"{1_000 - MOST_LINES} more lines like these were left out", "again"]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a\nb\r\n\tc", "a b c"),
        ("a\x1b[31mred\x00", "a [31mred"),
        ("x" * 10_000, "x" * (LONGEST_LINE - 1) + "…"),
        ("caf\u00e9", "caf\u00e9"),
        ("\u2028a\udcffb\u202ec", "a b c"),
    ],
)
def test_what_others_wrote_is_one_line(text: str, line: str) -> None:
    assert one_line(text) == line


def test_an_error_is_told_in_a_line_with_its_place() -> None:
    said: list[str] = []
    handler = BoundedHandler(said.append)
    logger = logging.Logger("engineio.server")
    logger.addHandler(handler)
    try:
        raise ValueError("bad\nframe " + "x" * 5_000)
    except ValueError:
        logger.exception("Unknown\nreceive error")
    (line,) = said
    assert line.startswith("engineio.server: Unknown receive error: ValueError: bad frame xxx")
    assert "test_guard_log.py" in line or len(line) == LONGEST_LINE
    assert "Traceback" not in line and "\n" not in line


def test_the_libraries_that_speak_of_what_comes_in_are_bound(capsys: pytest.CaptureFixture[str]) -> None:
    names = {each: logging.getLogger(each) for top in LOGGERS for each in (top, f"{top}.below")}
    before = {each: (logger.handlers, logger.propagate, logger.level) for each, logger in names.items()}
    try:
        names["engineio.below"].addHandler(logging.StreamHandler())
        bound_logs()
        for logger in names.values():
            for number in range(200):
                logger.error("bad %d\n%s", number, "x" * 2_000)
                logger.info("not worth a line")
        text = capsys.readouterr().err
    finally:
        for each, (handlers, propagate, level) in before.items():
            names[each].handlers, names[each].propagate = handlers, propagate
            names[each].setLevel(level)
    assert len(text.splitlines()) == MOST_LINES * len(LOGGERS)
    assert max(map(len, text.splitlines())) <= LONGEST_LINE
