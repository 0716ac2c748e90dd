"""Notes of our own export beside a script, and the check that they still say the same as the script.

An editor may have changed the script. Then the script counts, and our own words beside it are left aside.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import Position
from florence_bt.trees.kinds import Set
from florence_bt.trees.language.expressions.parser import parse_expression
from florence_bt.trees.language.expressions.syntax import Term, Unary
from florence_bt.trees.language.model import Literal
from florence_bt.trees.language.parse import parse_mission
from florence_btcpp.mission_text import read_flow
from florence_btcpp.script import parse_script, script_of, set_script
from florence_btcpp.values import case_text
from florence_btcpp.vocabulary import MARK
from florence_btcpp.xml_source import Element


def skip_script(when: Term) -> str:
    """Write ``when`` as a ``_skipIf``.

    Raises:
        Inexpressible: A part cannot be written in a script.
    """
    unless = when.operand if isinstance(when, Unary) and when.operator == "not" else None
    return script_of(unless if unless is not None else Unary("not", when, Position()))


def matching_expression(element: Element, mark: str, script: str) -> str | None:
    """Return the expression of a mark, None when there is none or it does not say what the script says."""
    text = element.get(mark)
    term = _term(text)
    return text if term is not None and _matches(lambda: script_of(term), script) else None


def matching_guard(element: Element) -> str | None:
    """Return ``when`` of the mark, None when it does not say what ``_skipIf`` says."""
    text = element.get(f"{MARK}_when")
    term = _term(text)
    return text if term is not None and _matches(lambda: skip_script(term), element.get("_skipIf")) else None


def _term(text: str) -> Term | None:
    try:
        return parse_expression(text).term if text else None
    except ConfigError:
        return None  # an editor broke it; the script beside it counts


def _matches(script: Callable[[], str], written: str) -> bool:
    try:
        return parse_script(script()) == parse_script(written)
    except ConfigError:
        return False  # not what our export would have written


def matching_values(element: Element) -> Any:
    """Return the values of our own mark on a ``Script``, None when they do not say what the script says."""
    text = element.get(f"{MARK}_set")
    if not text:
        return None
    try:
        mission = parse_mission(f"mission: m\ntree: {{set: {{{text}}}}}", Path("m.yaml"))
        values = read_flow(f"{{{text}}}")
    except ConfigError:
        return None  # an editor broke it; the script beside it counts
    node = mission.tree
    if not isinstance(node, Set) or mission.findings:
        return None
    return values if _matches(lambda: set_script(node.values), element.get("code")) else None


def matching_cases(element: Element, written: list[str]) -> list[str] | None:
    """Return the cases of our own mark on a ``Switch``; None if they differ from those in the file."""
    try:
        cases = read_flow(f"[{element.get(f'{MARK}_cases')}]")
    except ConfigError:
        return None  # an editor broke it; the cases beside it count
    if not isinstance(cases, list) or not all(isinstance(case, str) for case in cases):
        return None
    return cases if [case_text(Literal(case, False, Position()), None) for case in cases] == written else None
