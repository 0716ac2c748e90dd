"""The page of all parameters is current, and says of each what the code says."""

from dataclasses import dataclass
from pathlib import Path

from florence_bt.app.bringup.topology import node_classes
from florence_bt.core.limits import Positive
from tools.parameters_page import parameters_of, parameters_page

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "parameters.md"


@dataclass
class Motor:
    """Parameters of a motor.

    Attributes:
        speed: How fast it turns at most, rad/s (REFERENCE 2.2).
        pause: Between two turns,
            in seconds.

    Source:
        Document, sections 2.1 and 2.3.
    """

    speed: Positive = 1.5
    pause: float | None = None


class MotorNode:
    parameter_classes = (Motor,)


def test_the_page_is_current():
    again = "write it again: python tools/parameters_page.py docs/reference/parameters.md"
    assert PAGE.read_text(encoding="utf-8") == parameters_page(), again
    assert all(f"## {node}\n" in PAGE.read_text(encoding="utf-8") for node in node_classes())


def test_a_parameter_has_its_unit_default_limits_and_section():
    speed, pause = parameters_of(MotorNode)
    assert (speed.name, speed.unit, speed.default, speed.limits) == ("speed", "rad/s", "`1.5`", "above 0")
    assert (speed.source, pause.source) == ("R 2.2", "S 2.1 and 2.3")
    assert (pause.kind, pause.unit, pause.default) == ("number or none", "s", "none")
    assert pause.meaning == "Between two turns, in seconds."
