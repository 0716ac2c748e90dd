"""Draws diagrams of missions as text, Mermaid and SVG."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from florence_bt.trees import kinds
from florence_bt.trees.drawings._svg import COLOURS, OTHER, diagram_svg
from florence_bt.trees.drawings.diagram import Box, diagram_of
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission

SYMBOLS = {node.kind.word: node.kind.symbol for node in kinds.ALL}
"""A sign for each kind, in texts and Mermaid."""


_LIST = re.compile(r"^(\s*\d*)([.+-])(?=\s)")
"""The beginning of a list in Markdown, which Mermaid does not draw."""


def draw(
    mission: Mission,
    format_name: str,
    library: MissionLibrary | None = None,
    *,
    expand: bool = False,
    width: int | None = None,
) -> str:
    """Draw a mission.

    Args:
        mission: The mission.
        format_name: One of :data:`FORMATS`.
        library: Where called missions are found when they are expanded.
        expand: Whether to draw the trees of called missions too.
        width: Widest an SVG may be, in pixels, if that is possible at all.

    Returns:
        The text of the drawing.

    Raises:
        KeyError: There is no such format.
    """
    diagram = diagram_of(mission, library, expand=expand)
    if format_name == "svg" and width is not None:
        return diagram_svg(diagram, width)
    return FORMATS[format_name](diagram)


def diagram_text(root: Box) -> str:
    """Write an indented text, one line per box."""
    return "\n".join(_text_lines(root, "", ""))


def diagram_mermaid(root: Box) -> str:
    """Write a Mermaid flowchart, which Markdown pages can show."""
    return "\n".join(["flowchart LR", *_mermaid_lines(root)])


FORMATS: dict[str, Callable[[Box], str]] = {
    "svg": diagram_svg,
    "txt": diagram_text,
    "mermaid": diagram_mermaid,
}
"""The formats by name."""


def _label(box: Box) -> str:
    return f"{SYMBOLS[box.kind]} {box.title}".strip()


def _details(box: Box) -> tuple[str, ...]:
    return (*box.guards, *box.details, *(f"because {text}" for text in box.because))


def _text_lines(box: Box, first: str, rest: str) -> Iterator[str]:
    edge = f"({box.edge}) " if box.edge else ""
    details = "; ".join(_details(box))
    yield f"{first}{edge}{_label(box)}{f'  [{details}]' if details else ''}"
    for child in box.below:
        last = child is box.below[-1]
        yield from _text_lines(child, rest + ("└─ " if last else "├─ "), rest + ("   " if last else "│  "))


def _mermaid_lines(root: Box) -> Iterator[str]:
    numbers = {id(box): f"n{index}" for index, box in enumerate(root.walk())}
    kinds: dict[str, list[str]] = {}
    for box in root.walk():
        kinds.setdefault(box.kind if box.kind in COLOURS else "other", []).append(numbers[id(box)])
        lines = "<br/>".join(_mermaid_text(line) for line in (_label(box), *_details(box)))
        left, right = ('("', '")') if not box.below else ('["', '"]')
        yield f"  {numbers[id(box)]}{left}{lines}{right}"
        for child in box.below:
            word = f'|"{_mermaid_text(child.edge)}"|' if child.edge else ""
            arrow = "-.->" if child.edge == "finally" else "-->"
            yield f"  {numbers[id(box)]} {arrow}{word} {numbers[id(child)]}"
    for kind, members in kinds.items():
        fill, stroke = COLOURS.get(kind, OTHER)
        yield f"  classDef k_{kind} fill:{fill},stroke:{stroke},color:#101010"
        yield f"  class {','.join(members)} k_{kind}"


def _mermaid_text(text: str) -> str:
    """Escape what Mermaid would read as its own, lists of Markdown included."""
    escaped = "".join(
        char if char.isalnum() or char in " _.,:;/+-→?⇉↻⏱¬✓✗⏸▤$=◇◈①!" else f"#{ord(char)};" for char in text
    )
    return _LIST.sub(lambda match: f"{match[1]}#{ord(match[2])};", escaped)
