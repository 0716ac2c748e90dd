"""The number of rounds of ``retry`` and ``repeat``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from florence_bt.core.declaration import Kind, Port
from florence_bt.core.plain_yaml import YamlScalar
from florence_bt.trees.language.quantities import is_duration
from florence_bt.trees.language.value_schemas import REFERENCE, Schema
from florence_bt.trees.language.vocabulary import FOREVER

if TYPE_CHECKING:
    from florence_bt.trees.language.form import Form
    from florence_bt.trees.language.model import Value

COUNT = Port(Kind.INTEGER, "", minimum=1)
"""The value of ``retry`` and ``repeat``."""
_ENDLESS = ("infinite", "infinity", "inf", "endless", "endlessly", "always", "unlimited", "true", "-1")
"""Others' words for ``forever``."""
ROUNDS: Schema = {"anyOf": [{"const": FOREVER}, {"type": "integer", "minimum": 1}, REFERENCE]}


def read_rounds(form: Form) -> tuple[Value | None, bool]:
    """Read how often a node below is started.

    Returns:
        The number, None for a loop without end, and whether it can be read at all.
    """
    value, kind = form.value, form.key.text
    endless = isinstance(value, YamlScalar) and value.text == FOREVER
    if isinstance(value, YamlScalar) and (meant := _meant(kind, value.text)):
        form.reader.error(value.position, f"{kind}: a whole number is needed, not {value.text!r}", [meant])
        endless = True
    number = None if endless else form.reader.value(value, kind)
    return number, endless or number is not None


def _meant(kind: str, text: str) -> str | None:
    """Suggest what is meant by a ``retry`` or ``repeat`` of something else than a number; None for a number.

    Args:
        kind: The kind of node.
        text: What stands behind it.
    """
    if is_duration(text) and kind == "repeat":
        return f"repeat: {FOREVER}, with until: {{wait: {text}}}"
    if is_duration(text):
        return f"timeout: {text}, with do: {{{kind}: forever, do: ...}}"
    return FOREVER if text.lower() in _ENDLESS or text.startswith("until ") else None
