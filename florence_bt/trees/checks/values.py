"""Checks of values: kinds, units, limits, expressions."""

from __future__ import annotations

import re
from itertools import pairwise

from florence_bt.behaviours.keys import HIDDEN
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.errors import ConfigError
from florence_bt.trees.language import model
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.expressions.checking import (
    KindProblem,
    check_kinds,
    exact_comparisons,
    foreign_texts,
)
from florence_bt.trees.language.expressions.parser import parse_expression
from florence_bt.trees.language.expressions.ranges import zero_divisors
from florence_bt.trees.language.findings import FindingList
from florence_bt.trees.language.quantities import format_value, out_of_range, with_article
from florence_bt.trees.language.values import as_expression, fits, is_said, kind_of, port_value, tree_value

_PART = re.compile(r"\.(?:x|y|yaw)(?![a-z0-9_])")
_JOINED = re.compile(r";|\||\band\b|\bor\b")
"""Words and signs that people write between the items of a list in a text."""
_IN_BRACES = re.compile(r"\{\{?\s*(?P<key>[a-z][a-z0-9_]*)\s*\}?\}")
"""A key in a text as other languages write it: ``{room}`` or ``{{ room }}``."""


class ValueChecks:
    """Checks values against what they must be.

    Args:
        mission: The mission in which the values stand.
        analysis: Its surroundings.
        findings: Receives what is wrong.
    """

    def __init__(self, mission: model.Mission, analysis: Analysis, findings: FindingList) -> None:
        self._mission = mission
        self.findings = findings
        self.declared_keys = mission.keys
        self.kinds = analysis.of(mission).kinds
        self._measured = analysis.measured(mission)
        self._texts = analysis.known_texts(mission)

    def value(self, value: model.Value, port: Port | None, what: str) -> None:
        """Check one value.

        Args:
            value: The value.
            port: What it is given to; None when anything will do.
            what: What it is called in messages.
        """
        match value:
            case model.Expression():
                said = port is not None and is_said(self.kind_of(value), port)
                if self.expression(value, port.kind if port is not None and not said else None, what):
                    self._computed(value, port, what)
            case model.Reference() if port is not None:
                self._reference(value, port, what)
            case model.PoseParts(x=x, y=y, yaw=yaw) if port is None or port.kind is Kind.POSE:
                for part, kind in ((x, Kind.LENGTH), (y, Kind.LENGTH), (yaw, Kind.ANGLE)):
                    self.value(part, Port(kind, ""), what)
            case model.ListItems(items=items) if items and (port is None or port.kind.item is not None):
                self._items(value, port, what)
            case _:
                self._written(value, port, what)

    def _items(self, value: model.ListItems, port: Port | None, what: str) -> None:
        kinds = {kind for item in value.items if (kind := self.kind_of(item)) is not None}
        wanted = port.kind.item if port is not None else next(iter(kinds)) if len(kinds) == 1 else None
        if port is None and (len(kinds) > 1 or any(kind.item is not None for kind in kinds)):
            found = " and ".join(sorted(with_article(kind) for kind in kinds))
            self.findings.error(value.position, f"{what}: the items of a list are of one kind, not {found}")
            return
        for item in value.items:
            choices = port.choices if port is not None else ()
            one = Port(wanted, "", choices=choices) if wanted is not None else None
            self.value(item, one, f"an item of {what}")

    def condition(self, expression: model.Expression, what: str) -> None:
        """Check an expression that must give true or false."""
        if self.expression(expression, Kind.BOOLEAN, what):
            self._computed(expression, None, what)

    def expression(self, expression: model.Expression, wanted: Kind | None, what: str) -> bool:
        """Check an expression that must give a kind; says whether it does."""
        problems = list(check_kinds(expression, self.kinds, wanted).problems)
        problems = problems or list(foreign_texts(expression, self._texts))
        for problem in problems:
            self.findings.error(problem.position, f"{what}: {problem.message}", problem.valid)
        doubtful = [] if problems else self._doubts(expression)
        for problem in doubtful:
            self.findings.warning(problem.position, f"{what}: {problem.message}", problem.valid)
        return not problems

    def _doubts(self, expression: model.Expression) -> list[KindProblem]:
        """Return what is right, and hardly meant."""
        return [
            *exact_comparisons(expression, self.kinds, self._measured),
            *zero_divisors(expression, self._mission.inputs),
        ]

    def _computed(self, expression: model.Expression, port: Port | None, what: str) -> None:
        """Check the value of an expression that needs no keys, which is the same at every time."""
        if expression.keys:
            return
        try:
            if port is None:
                tree_value(expression, None)
            else:
                port_value(expression, port)
        except ConfigError as error:
            self.findings.error(expression.position, f"{what}: {error.problem}", error.valid)

    def kind_of(self, value: model.Value) -> Kind | None:
        """Return the kind of a value, None when it is not known."""
        return kind_of(value, self.kinds)

    def choices_of(self, value: model.Value) -> tuple[str, ...]:
        """Return the texts that a value can only have, none when it can be any."""
        return tuple(self._texts.get(value.key, ())) if isinstance(value, model.Reference) else ()

    def _written(self, value: model.Value, port: Port | None, what: str) -> None:
        try:
            if port is None:
                tree_value(value, None)
            else:
                port_value(value, port)
        except ConfigError as error:
            suggestions = (
                (f"${value.text}",) if isinstance(value, model.Literal) and value.text in self.kinds else ()
            )
            if port is not None and port.kind is Kind.POSE and isinstance(value, model.Literal):
                place = f"get_hotspot: {{label: {value.text}}}, out: {{pose: place}}"
                suggestions = (*suggestions, f"$place, after {place}")
            valid = (*suggestions, *error.valid)
            self.findings.error(value.position, f"{what}: {error.problem}", tuple(dict.fromkeys(valid)))
        else:
            if not self.text(value, what) and port is None:
                self.unclear(value, what)
            if port is not None and port.kind is Kind.LIST_OF_TEXT:
                self._one_item(value, what)

    def _one_item(self, value: model.Value, what: str) -> None:
        """Warn of a list that is one text, ``kitchen and hall``; quotes say that it is meant."""
        if isinstance(value, model.Literal) and not value.quoted and _JOINED.search(value.text):
            message = f"{what}: {value.text!r} is one item"
            items = ", ".join(part.strip() for part in _JOINED.split(value.text))
            self.findings.warning(value.position, message, [f"[{items}]", f'["{value.text}"]'])

    def unclear(self, value: model.Value, what: str) -> None:
        """Warn of ``$a + 1`` where anything will do: without ``${...}`` it is a text."""
        if isinstance(value, model.Template) and not value.quoted:
            suggestions = as_expression(value)
            # "$first - $last" with two texts is not a sum that lacks its braces.
            if suggestions and not check_kinds(parse_expression(model.show(value)), self.kinds).problems:
                message = f"{what}: {model.show(value)!r} is text here, and nothing is computed"
                self.findings.warning(
                    value.position, message, (*suggestions, f'"{model.show(value)}" for text')
                )

    def text(self, value: model.Value, what: str) -> bool:
        """Warn of ``$pose.x`` in a text, which is the whole pose and a text behind it, and of ``{room}``.

        Returns:
            Whether there was anything to warn of.
        """
        warned = False
        written_out = (value.text,) if isinstance(value, model.Literal) else ()
        parts = value.parts if isinstance(value, model.Template) else written_out
        for text in (part for part in parts if isinstance(part, str)):
            for braced in _IN_BRACES.finditer(text):
                if braced["key"] in self.kinds:
                    message = f"{what}: {braced[0]} is text here, and not the value of the key"
                    self.findings.warning(
                        value.position, message, [f"${braced['key']}", f"${{{braced['key']}}}"]
                    )
                    warned = True
        for part, behind in pairwise(parts):
            match = _PART.match(behind) if isinstance(behind, str) else None
            if isinstance(part, model.Reference) and match and self.kinds.get(part.key) is Kind.POSE:
                written = f"${part.key}{match[0]}"
                message = f"{what}: {written} is text here: the whole pose, then {match[0]!r}"
                alone = [f"${{{written}}}"] if len(parts) == 2 and match[0] == behind else []
                valid = alone or [f"set: {{part: '${{{written}}}'}} first, and $part in the text"]
                self.findings.warning(value.position, message, valid)
                warned = True
        return warned

    def _reference(self, value: model.Reference, port: Port, what: str) -> None:
        given = kind_of(value, self.kinds)
        if given is None or is_said(given, port):
            return
        if not fits(given, port.kind):
            written = {key: kind for key, kind in self.kinds.items() if not key.startswith(HIDDEN)}
            valid = [f"${key}" for key, kind in written.items() if fits(kind, port.kind)]
            if port.kind is Kind.TEXT:
                valid.insert(0, f'a text with it: "{value.key.replace("_", " ")}: ${value.key}"')
            message = (
                f"{what}: {with_article(port.kind)} is needed, but ${value.key} is {with_article(given)}"
            )
            self.findings.error(value.position, message, valid)
            return
        source = self._mission.inputs.get(value.key)
        if source is None or source.required or source.default is None:
            return
        problem = out_of_range(source.default, port)
        if problem is not None:
            default = format_value(source.default, source.kind)
            message = f"{what}: the default of ${value.key} does not fit: {problem}"
            self.findings.error(value.position, message, [f"a default of {value.key!r} other than {default}"])
