"""Writes elements as XML that people can read: indented, long attribute lists broken."""

from __future__ import annotations

from collections.abc import Iterator
from xml.sax.saxutils import escape

from florence_bt.btcpp.xml_source import Element

WIDTH = 110
_STEP = "  "


def write_xml(root: Element) -> str:
    """An element with everything below as the text of a file."""
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', *_lines(root, ""), ""])


def _lines(element: Element, indent: str) -> Iterator[str]:
    opening = _opening(element, indent)
    if not element.children and not element.text:
        yield f"{opening}/>"
    elif not element.children:
        yield f"{opening}>{_escape(element.text)}</{element.tag}>"
    else:
        yield f"{opening}>"
        for child in element.children:
            yield from _lines(child, indent + _STEP)
        yield f"{indent}</{element.tag}>"


def _opening(element: Element, indent: str) -> str:
    parts = [f'{name}="{_attribute(value)}"' for name, value in element.attributes.items()]
    line = f"{indent}<{' '.join([element.tag, *parts])}"
    if len(line) <= WIDTH or len(parts) < 2:
        return line
    beside = f"\n{indent} {' ' * len(element.tag)} "
    return f"{indent}<{element.tag} {beside.join(parts)}"


def _attribute(value: str) -> str:
    return _escape(value, {'"': "&quot;", "\n": "&#10;", "\t": "&#9;", "\r": "&#13;"})


def _escape(text: str, more: dict[str, str] | None = None) -> str:
    """Escape, and replace what XML 1.0 cannot hold at all by the sign for that."""
    kept = "".join(char if char >= " " or char in "\t\n\r" else "�" for char in text)
    return escape(kept, more or {})
