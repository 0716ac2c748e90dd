"""The source of a mission file: plain YAML with positions, as every file that people write (see ``core``)."""

from __future__ import annotations

from florence_bt.core.plain_yaml import (
    MAX_BYTES,
    MAX_DEPTH,
    MAX_PARTS,
    MAX_TEXT,
    NOT_UTF8,
    Listing,
    Position,
    Source,
    Table,
    Text,
    parse_source,
    read_bytes,
    read_source,
    readable,
)

__all__ = [
    "MAX_BYTES",
    "MAX_DEPTH",
    "MAX_PARTS",
    "MAX_TEXT",
    "NOT_UTF8",
    "Listing",
    "Position",
    "Source",
    "Table",
    "Text",
    "parse_source",
    "read_bytes",
    "read_source",
    "readable",
]
