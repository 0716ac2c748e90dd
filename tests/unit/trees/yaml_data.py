"""YAML as the data that an editor holds against the schema: scalars typed as YAML 1.2 types them."""

from __future__ import annotations

import re
from typing import Any

from florence_bt.core.plain_yaml import YamlNode, YamlScalar, YamlSequence

_INTEGER = re.compile(r"[+-]?[0-9]+")
_FLOAT = re.compile(r"[+-]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][+-]?[0-9]+)?")


def as_data(source: YamlNode) -> Any:
    """Texts, lists and mappings as strings, numbers, booleans, None, lists and dictionaries.

    Source:
        YAML 1.2.2, section 10.3.2 (the core schema), without octal and hexadecimal numbers.
    """
    if isinstance(source, YamlScalar):
        return source.text if source.quoted else _scalar(source.text)
    if isinstance(source, YamlSequence):
        return [as_data(item) for item in source.items]
    return {key.text: as_data(value) for key, value in source.entries}


def _scalar(text: str) -> Any:
    if text in ("", "~", "null", "Null", "NULL"):
        return None
    if text in ("true", "True", "TRUE", "false", "False", "FALSE"):
        return text.lower() == "true"
    if _INTEGER.fullmatch(text):
        return int(text) if len(text) < 20 else float(text)
    return float(text) if _FLOAT.fullmatch(text) else text
