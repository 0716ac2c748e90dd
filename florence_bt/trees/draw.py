"""Draws diagrams of missions as text, Mermaid and SVG."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from florence_bt.trees._svg import diagram_svg
from florence_bt.trees.diagram import Box, diagram_of
from florence_bt.trees.loader import MissionLibrary
from florence_bt.trees.model import Mission

SYMBOLS = {
    "sequence": "→",
    "selector": "?",
    "parallel": "⇉",
    "retry": "↻",
    "repeat": "↻",
    "timeout": "⏱",
    "invert": "¬",
    "succeed": "✓",
    "fail": "✗",
    "wait": "⏸",
    "set": "=",
    "run": "▤",
    "skill": "",
}
"""A sign for each kind, in texts and Mermaid."""


def draw(
    mission: Mission, format_name: str, library: MissionLibrary | None = None, *, expand: bool = False
) -> str:
    """Draw a mission.

    Args:
        mission: The mission.
        format_name: One of :data:`FORMATS`.
        library: Where called missions are found when they are expanded.
        expand: Whether to draw the trees of called missions too.

    Returns:
        The text of the drawing.

    Raises:
        KeyError: There is no such format.
    """
    return FORMATS[format_name](diagram_of(mission, library, expand=expand))


def diagram_text(root: Box) -> str:
    """An indented text, one line per box."""
    return "\n".join(_text_lines(root, "", ""))


def diagram_mermaid(root: Box) -> str:
    """A Mermaid flowchart, which Markdown pages can show."""
    return "\n".join(["flowchart LR", *_mermaid_lines(root)])


FORMATS: dict[str, Callable[[Box], str]] = {
    "svg": diagram_svg,
    "txt": diagram_text,
    "mermaid": diagram_mermaid,
}
"""The formats by name."""


def _label(box: Box) -> str:
    return f"{SYMBOLS[box.kind]} {box.title}".strip()


def _text_lines(box: Box, first: str, rest: str) -> Iterator[str]:
    edge = f"({box.edge}) " if box.edge else ""
    details = f"  [{'; '.join(box.details)}]" if box.details else ""
    yield f"{first}{edge}{_label(box)}{details}"
    for child in box.below:
        last = child is box.below[-1]
        yield from _text_lines(child, rest + ("└─ " if last else "├─ "), rest + ("   " if last else "│  "))


def _mermaid_lines(root: Box) -> Iterator[str]:
    numbers = {id(box): f"n{index}" for index, box in enumerate(root.walk())}
    for box in root.walk():
        lines = "<br/>".join(_mermaid_text(line) for line in (_label(box), *box.details))
        left, right = ('(["', '"])') if not box.below else ('["', '"]')
        yield f"  {numbers[id(box)]}{left}{lines}{right}"
        for child in box.below:
            arrow = f"-. {child.edge} .->" if child.edge else "-->"
            yield f"  {numbers[id(box)]} {arrow} {numbers[id(child)]}"


def _mermaid_text(text: str) -> str:
    """Escape what Mermaid would read as its own."""
    return "".join(
        char if char.isalnum() or char in " _.,:;/+-→?⇉↻⏱¬✓✗⏸▤$=" else f"#{ord(char)};" for char in text
    )
