"""The panel in the terminal while somebody drives by hand: text in, lines out."""

from __future__ import annotations

from dataclasses import dataclass

from rich.text import Text

from florence_bt.core.geometry import Twist2

KEYS = (
    "  u  i  o     these and the arrows drive, any other key stops",
    "  j  k  l     q z  both speeds,  w x  forward,  e c  turning: 10 % up, down",
    "  m  ,  .     Ctrl-C gives the robot back",
)


@dataclass(frozen=True, slots=True)
class Situation:
    """The state of the robot and of the hand, as far as it is known.

    Attributes:
        speeds: What a full push gives: m/s and rad/s.
        wanted: What the hand wants now.
        driven: What the odometry says; None while it says nothing.
        stop_reason: Why the base is held, in words; empty when it is not.
        charge: Of the battery, as a fraction; None while nobody tells.
        where: Where the robot is, in words; empty when nobody knows.
        problem: Why the hand cannot drive; empty when it can.
    """

    speeds: Twist2
    wanted: Twist2
    driven: Twist2 | None = None
    stop_reason: str = ""
    charge: float | None = None
    where: str = ""
    problem: str = ""


def lines_of(situation: Situation) -> list[Text]:
    """Return the lines that change."""
    charge, held = situation.charge, situation.problem or situation.stop_reason
    return [
        _line("speed", f"{_words(situation.speeds)} at a full push"),
        _line("drives", _motion(situation)),
        _line("held", held or "no", "bold red" if held else ""),
        _line("battery", "not known" if charge is None else f"{charge:.0%}"),
        _line("where", situation.where or "not known"),
    ]


def _motion(situation: Situation) -> str:
    wanted = "stands still" if situation.wanted.is_zero() else f"{_words(situation.wanted)} wanted"
    driven = situation.driven
    return wanted if driven is None else f"{wanted}; {_words(driven)} by the odometry"


def _words(twist: Twist2) -> str:
    # Adding zero makes -0.0 a plain zero.
    return f"{round(twist.linear, 2) + 0.0:.2f} m/s, {round(twist.angular, 2) + 0.0:.2f} rad/s"


def _line(label: str, text: str, style: str = "") -> Text:
    return Text.assemble((f"{label:<9}", "dim"), (text, style), overflow="ellipsis", no_wrap=True)
