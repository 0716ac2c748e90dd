"""``wait_until``: a pause that a condition or a time of day ends."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from florence_bt.behaviours.keys import HIDDEN
from florence_bt.core.outcome import LASTING_CODES
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlScalar
from florence_bt.trees.kinds.run_skill import RunSkill
from florence_bt.trees.kinds.selector import Selector
from florence_bt.trees.kinds.sequence import Sequence
from florence_bt.trees.language.model import Literal, Node, Reference, Value, show
from florence_bt.trees.language.node_kind import NodeKind, TreeBuilder
from florence_bt.trees.language.outcomes import MissionOutcomes, NodeOutcomes
from florence_bt.trees.language.value_schemas import EXPRESSION, NODE, TIME

if TYPE_CHECKING:
    from py_trees.behaviour import Behaviour

    from florence_bt.trees.language.form import Form

_TIME_OF_DAY = re.compile(r"(?P<time>\d{1,2}:\d{2})(?: or (?P<sooner>.+))?")
"""A time of day, perhaps with what ends the waiting sooner: ``22:00``, ``22:00 or $done``."""
_TIME_MEANT = re.compile(
    r"(?:[^\W\d]+,? )?(?:at |um )?(?P<hours>\d{1,2})(?:(?P<sign>[:.h])(?P<minutes>\d{2})(?::\d{2})?)?"
    r"\s*(?P<half>[ap]\.?m\.?)?\s*(?P<word>uhr|o'clock|h)?",
    re.IGNORECASE,
)
"""Times of the day as people write them: ``8pm``, ``20.00``, ``20 Uhr``, ``Monday 08:00``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WaitUntil(Node):
    """Asks a node until it succeeds.

    A time of day is written as one, too; it becomes a sequence of nodes (:func:`_wait_for_time`).

    Attributes:
        goal: What is asked until it succeeds.
    """

    kind: ClassVar = NodeKind(
        word="wait_until",
        about="pauses until something is so",
        symbol="⏸",
        value={"anyOf": [EXPRESSION, TIME, NODE]},
        example="- wait_until: $found",
    )
    takes_time: ClassVar = True

    goal: Node

    # ---- as written -----------------------------------------------------------------------------------

    @classmethod
    def read(cls, form: Form) -> Node | None:
        """Read what is waited for: a condition, or a time of day."""
        value, reader, fields = form.value, form.reader, form.fields
        given = value.get("time") if isinstance(value, YamlMapping) and len(value.entries) == 1 else None
        if given is not None:
            time = reader.value(given, "time")
            return _wait_for_time(form, time, None, given.position) if time is not None else None
        written = _TIME_OF_DAY.fullmatch(value.text.strip()) if isinstance(value, YamlScalar) else None
        if isinstance(value, YamlScalar) and written is not None:
            sooner = _sooner(form, value, written) if written["sooner"] else None
            literal = Literal(written["time"], True, value.position)
            return _wait_for_time(form, literal, sooner, value.position)
        goal = reader.question(value, "wait_until")
        return cls(goal=goal, **fields) if goal is not None else None

    @property
    def parts(self) -> tuple[Node, ...]:
        """Give the question, where it is a node."""
        return (self.goal,)

    @property
    def default_title(self) -> str:
        """Such as ``wait until $found``."""
        return f"wait until {self.goal.title}"

    # ---- how it ends, and runs ------------------------------------------------------------------------

    def outcomes(self, known: MissionOutcomes, skip_fails: bool) -> NodeOutcomes:
        """Return how it can end: with success, or with a failure that asking again does not mend."""
        asked = known.of(self.goal, skip_fails=True)
        return NodeOutcomes(asked.can_succeed, asked.codes & LASTING_CODES)

    def build(self, builder: TreeBuilder, name: str, skipped_fails: bool) -> Behaviour:
        """Build the question."""
        from florence_bt.behaviours import until

        return until.WaitUntil(name, builder.context, builder.question(self.goal))


def time_meant(text: str) -> str | None:
    """Return a time of day that is written in another way as hours and minutes: ``20:00`` for ``8 pm``."""
    match = _TIME_MEANT.fullmatch(text.strip())
    if match is None or not (match["sign"] or match["half"] or match["word"]):
        return None
    hours, minutes = int(match["hours"]), int(match["minutes"] or 0)
    if match["half"]:
        hours = hours % 12 + 12 * (match["half"][0] in "pP")
    return f"{hours:02}:{minutes:02}" if hours < 24 and minutes < 60 else None


def _sooner(form: Form, value: YamlScalar, written: re.Match[str]) -> Node | None:
    """Read the expression behind a time of day and ``or``."""
    start = value.text.index(written["sooner"])
    column = None if value.first_column is None else value.first_column + start
    place = value.position if column is None else Position(value.position.line, column)
    return form.reader.question(YamlScalar(written["sooner"], False, place, column), "wait_until")


def _wait_for_time(form: Form, time: Value, sooner: Node | None, place: Position) -> Node:
    """Read a time of day, ``wait_until: "22:00"``: the next such moment is looked up, and waited for.

    Args:
        form: The node as written.
        time: Hours and minutes, written out or in a key.
        sooner: What ends the waiting, too, if anything does.
        place: Where it stands.
    """
    shown, fields = show(time), form.fields
    if isinstance(time, Literal) and time_meant(shown) != f"{shown:0>5}":
        form.reader.error(place, f"wait_until: {shown!r} is no time of day", ["22:00"])
    written = shown.replace(":", "_") if isinstance(time, Literal) else f"of_line_{place.line}"
    name = f"{HIDDEN}time_{written}"
    look_up = RunSkill(
        skill="look_up_time",
        inputs=((Literal("time", True, place), time),),
        outputs=((Literal("date", True, place), Literal(name, True, place)),),
        position=place,
    )
    asked: Node = RunSkill(
        skill="time_reached",
        inputs=((Literal("date", True, place), Reference(name, place)),),
        position=place,
    )
    if sooner is not None:
        asked = Selector(children=(asked, sooner), position=place)
    wait = WaitUntil(goal=asked, position=place)
    fields["name"] = fields.get("name") or f"wait until {shown}"
    return Sequence(children=(look_up, wait), **fields)
