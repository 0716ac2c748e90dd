"""Values of a mission as XML attributes, and as the YAML of our own marks."""

from __future__ import annotations

from typing import Any

from florence_bt.btcpp.si_values import si_text
from florence_bt.btcpp.values_in import text_value, written_value
from florence_bt.btcpp.vocabulary import PREFIX
from florence_bt.btcpp.written import Quoted, write_flow
from florence_bt.core.declaration import Kind
from florence_bt.core.geometry import Pose2
from florence_bt.trees.language import model
from florence_bt.trees.language.model import Literal, PoseParts, Reference, Template, Value
from florence_bt.trees.language.quantities import UNITS, guess_value
from florence_bt.trees.language.values import tree_value


def port_attribute(value: Value, kind: Kind | None) -> str:
    """A value of a port.

    Literals are written in SI units and references as ``{key}``. What BehaviorTree.CPP cannot say stands in
    the mission language behind ``florence:``.

    Args:
        value: The value.
        kind: What it must be; None when anything will do.
    """
    if isinstance(value, Reference):
        return f"{{{value.key}}}"
    if isinstance(value, Literal | PoseParts):
        resolved = tree_value(value, kind)
        if isinstance(resolved, str | bool | int | float | Pose2):
            text = si_text(resolved)
            if not isinstance(resolved, str) or _stays(text, kind):
                return text
    return PREFIX + own_value(value)


def case_text(case: Literal, declared: Kind | None) -> str:
    """A case of a ``Switch`` as keys are compared there: a number in SI units, 1 or 0 for a truth value.

    Args:
        case: The case as written.
        declared: The kind of the key, None when it is not declared.
    """
    kind, value = guess_value(case.text)
    if declared is Kind.TEXT:
        return case.text
    if kind is Kind.BOOLEAN:
        return str(int(bool(value)))
    return si_text(float(value)) if kind in UNITS else case.text


def own_value(value: Value | dict[str, Value]) -> str:
    """A value in the mission language, on one line."""
    if isinstance(value, dict):
        return write_flow({key: flow_value(item) for key, item in value.items()})
    return write_flow(flow_value(value))


def flow_value(value: Value) -> Any:
    """A value as it is written in a mission."""
    match value:
        case Literal(text=text, quoted=quoted):
            return Quoted(text.replace("$", "$$")) if quoted else text_value(text, Kind.TEXT)
        case PoseParts(x=x, y=y, yaw=yaw):
            return {"x": flow_value(x), "y": flow_value(y), "yaw": flow_value(yaw)}
        case Template(parts=parts):
            return Quoted(
                "".join(p.replace("$", "$$") if isinstance(p, str) else f"${{{p.key}}}" for p in parts)
            )
    return model.show(value)


def _stays(text: str, kind: Kind | None) -> bool:
    """Whether a text is read back as the same text."""
    if text.strip().startswith("{") and text.strip().endswith("}"):
        return False
    read, problem = written_value(text, kind)
    return (
        not problem
        and str(read) == text.replace("$", "$$")
        and (kind is Kind.TEXT or not isinstance(read, Quoted))
    )
