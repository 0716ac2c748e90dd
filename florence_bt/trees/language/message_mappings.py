"""Servers of skills that a file declares: an action, a service or a topic, with its fields mapped.

The types are those of any installed interface package. They are looked at when they are installed; without
them a file is read all the same, and its fields are not checked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from florence_bt.behaviours.expressions import CompiledExpression
from florence_bt.behaviours.keys import (
    KeyReference,
    KeyStore,
    ListFromItems,
    TextTemplate,
    ValueProblem,
    is_source,
    resolve,
)
from florence_bt.core.answer_shape import AnswerShape, constants_below, constants_of, shape_of
from florence_bt.core.declaration import SHOWN_UNITS, Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.interfaces import (
    NOW,
    TIME,
    field_type,
    get,
    holder_of,
    holds,
    integer_limits,
    item_of_array,
    kind_of_field,
    length_limits,
    load_interface,
    part_of,
    put,
)
from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar, texts_in
from florence_bt.core.ros_names import check_ros_name
from florence_bt.core.serving import (
    ActionBinding,
    ConditionBinding,
    PublicationBinding,
    ServiceBinding,
    SkillBinding,
    WaitBinding,
)
from florence_bt.core.skill import Inputs
from florence_bt.trees.language.expressions.checking import check_kinds
from florence_bt.trees.language.expressions.compiling import compile_expression
from florence_bt.trees.language.expressions.syntax import Constant, keys_of, walk
from florence_bt.trees.language.message_fields import (
    AnyConstant,
    Chosen,
    check_readable,
    never_held,
    numbers_of,
    paths_in_text,
    shown_in,
    value_in,
    with_paths,
)
from florence_bt.trees.language.model import Expression, ListItems, Literal, Reference, Template, Value
from florence_bt.trees.language.quantities import with_article
from florence_bt.trees.language.reader import Reader
from florence_bt.trees.language.values import kind_of, template_of, tree_value
from florence_bt.trees.language.vocabulary import IDENTIFIER

DEFAULT_CODE = "failed"
"""The code of a goal that the server gave up, when the file names none."""
_CONSTANTS: Mapping[Kind | None, tuple[type, ...]] = {
    Kind.INTEGER: (int,),
    Kind.NUMBER: (float, int),
    Kind.TEXT: (str,),
    Kind.BOOLEAN: (bool,),
}
"""Kind of a field -> the constants of an interface that it takes."""
_NUMBER = re.compile(r"-?\d+(\.\d+)?")
_MOST_SHOWN = 4
MAX_AGE_S = 5.0
"""Of a message that a condition judges, when the file says nothing."""


@dataclass(frozen=True, slots=True)
class Way:
    """A way to serve a skill.

    Attributes:
        sent: The part of the interface that is sent; None when nothing is.
        answered: The part of the interface that outputs and failures are read from; None when there is none.
        keys: What can be said about it, beside the type.
        example: A type of it.
    """

    sent: str | None
    answered: str | None
    keys: tuple[str, ...]
    example: str


WAYS: Mapping[str, Way] = {
    "action": Way("Goal", "Result", ("send", "reason", "feedback"), "nav2_msgs/action/NavigateToPose"),
    "service": Way("Request", "Response", ("send", "reason"), "std_srvs/srv/SetBool"),
    "publish": Way("", None, ("send", "latched"), "std_msgs/msg/String"),
    "condition": Way(None, "", ("reason", "max_age", "latched"), "std_msgs/msg/Bool"),
    "wait_for": Way(None, "", ("reason",), "std_msgs/msg/String"),
}
"""Key of a file of skills -> the way."""
MAPPING_KEYS = (*WAYS, "type", *dict.fromkeys(key for way in WAYS.values() for key in way.keys))


@dataclass(frozen=True, slots=True)
class MessageMapping:
    """A mapping from the inputs of a skill to messages, and from messages to its result.

    Attributes:
        declaration: The skill.
        way: One of :data:`WAYS`.
        name: The name of the action, service or topic.
        interface: Its type, such as ``nav2_msgs/action/Spin``.
        send: What is sent: path of a field, and a value or where to find it.
        outputs: Output -> path of the field that gives it.
        failures: Code -> when it is given, in this order.
        otherwise: The code of a goal that the server gave up for no reason named in ``failures``.
        reason: The path of the server's own words; empty without.
        feedback: A text about the running goal, with fields of the feedback; None without.
        max_age_s: Seconds after which a message does not count any more; infinite for a latched topic, which
            speaks only when something changes.
        latched: Whether the topic gives its last message to who comes later.
        stock: Whether it comes with Florence, so that perhaps nobody wants it here.
        unread: The output with which the server says no, and the expression that then holds, when no failure
            reads it; None otherwise. Only a mission that takes it notices a refusal.
    """

    declaration: SkillDeclaration
    way: str
    name: str
    interface: str
    send: tuple[tuple[str, Any], ...] = ()
    outputs: Mapping[str, str] = field(default_factory=dict)
    failures: tuple[tuple[str, CompiledExpression], ...] = ()
    otherwise: str = DEFAULT_CODE
    reason: str = ""
    feedback: TextTemplate | None = None
    max_age_s: float = MAX_AGE_S
    latched: bool = False
    stock: bool = False
    unread: tuple[str, str] | None = None

    @property
    def server(self) -> tuple[str, str]:
        """Name the other side with its kind: of one topic everybody has one type."""
        return self.way if self.way in ("action", "service") else "topic", self.name.strip("/")

    def binding(self) -> SkillBinding:
        """Return how the skill is served, as the shipped ones say it."""
        make: Callable[..., SkillBinding]
        match self.way:
            case "action":
                make = partial(
                    ActionBinding, request=self.fields, result=self.result, feedback=self.feedback_text
                )
            case "service":
                make = partial(ServiceBinding, request=self.fields, result=self.result)
            case "publish":
                make = partial(PublicationBinding, message=self.fields, latched=self.latched)
            case "condition":
                make = partial(
                    ConditionBinding,
                    judge=self.judge,
                    max_age_s=self.max_age_s,
                    latched=self.latched,
                    foreign=True,
                )
            case _:
                limit_s = self.declaration.deadline_s
                nothing = failure("timed_out", f"nothing came from topic {self.name} within {limit_s:g} s")
                make = partial(
                    WaitBinding,
                    result=self.result,
                    time_limit=lambda inputs: limit_s,
                    nothing=lambda inputs: nothing,
                    foreign=True,
                )
        return make(skill=self.declaration.name, interface=self.interface, name=self.name)

    def fields(self, inputs: Inputs) -> dict[str, Any]:
        """Return what is sent: path of a field -> value.

        Args:
            inputs: The inputs, complete.

        Raises:
            FlorenceError: An input does not fit; TypeError or ValueError likewise.
        """
        keys = KeyStore(dict(inputs))
        return {path: resolve(value, keys) for path, value in self.send}

    def judge(self, inputs: Inputs, message: Any) -> Result:
        """Return what a condition says about a message."""
        return self.result(message, inputs=inputs)

    def result(
        self, message: Any, outcome: Outcome = Outcome.SUCCEEDED, inputs: Inputs | None = None
    ) -> Result:
        """Return the skill's result from the answer of the server.

        Args:
            message: The result, response or message.
            outcome: The way a goal ended.
            inputs: The inputs of a condition.
        """
        words = self._words(message)
        if outcome is Outcome.CANCELLED:
            return cancelled(words or "cancelled")
        outputs, problem = self._read_outputs(message)
        for code, expression in self.failures:
            try:
                holds_now = expression.holds(self._values(expression.keys, inputs or {}, outputs, message))
            except (ConfigError, ValueProblem) as error:
                return failure("bad_output", f"{self.name}: {error}")
            if holds_now:
                return failure(code, words or self._meaning(code, expression.text), **outputs)
        if outcome is Outcome.FAILED:
            return failure(self.otherwise, words or self._meaning(self.otherwise, "it gave up"), **outputs)
        return failure("bad_output", f"{self.name}: {problem}") if problem else success(**outputs)

    def feedback_text(self, message: Any) -> str:
        """Return a text for people from a feedback message; empty where the file has none."""
        if self.feedback is None:
            return ""
        names = [part.key for part in self.feedback.parts if not isinstance(part, str)]  # type: ignore[attr-defined]
        shown = {name: shown_in(message, name, self.interface, "Feedback") for name in names}
        return self.feedback.resolve(KeyStore(shown))

    def _meaning(self, code: str, otherwise: str) -> str:
        return f"{self.name}: {self.declaration.failures.get(code) or otherwise}"

    def _words(self, message: Any) -> str:
        if not self.reason:
            return ""
        try:
            text = get(message, self.reason, Kind.TEXT)
        except ConfigError:  # an item of an array that is shorter
            return ""
        return f"{self.name}: {text}" if text else ""

    def _read_outputs(self, message: Any) -> tuple[dict[str, Any], str]:
        outputs, problem = {}, ""
        for name, path in self.outputs.items():
            try:
                outputs[name] = get(message, path, self.declaration.outputs[name].kind)
            except ConfigError as error:
                problem = problem or str(error)
        return outputs, problem

    def _values(
        self, keys: Iterable[str], inputs: Inputs, outputs: Mapping[str, Any], message: Any
    ) -> KeyStore:
        known, part = {**inputs, **outputs}, WAYS[self.way].answered or ""
        return KeyStore(
            {
                key: known[key] if key in known else value_in(message, key, self.interface, part)
                for key in keys
            }
        )


def read_mapping(
    reader: Reader,
    declaration: SkillDeclaration,
    table: YamlMapping,
    paths: Mapping[str, YamlNode],
    conditions: Mapping[str, YamlNode],
    *,
    stock: bool = False,
) -> MessageMapping | None:
    """Read how a skill is served.

    Args:
        reader: Receives what is wrong.
        declaration: What the file says about the skill otherwise.
        table: All that the file says about it.
        paths: Output -> ``from`` of it.
        conditions: Failure code -> ``when`` of it.
        stock: Whether the skill comes with Florence; its interface is not looked at before it is used.

    Returns:
        The mapping; None when the file does not say, or not well enough.
    """
    ways = [key for key, _ in table.entries if key.text in WAYS]
    if not ways:
        key = next((key for key, _ in table.entries if key.text in MAPPING_KEYS), None)
        if key is not None:
            typed = "".join(texts_in(table.get("type"))).split("/")[1:2]
            fitting = [way for way in WAYS if WAYS[way].example.split("/")[1:2] == typed] or [*WAYS]
            message = f"{key.text}: the skill names nothing that serves it"
            reader.error(key.position, message, [f"{way}: NAME" for way in fitting])
        return None
    if len(ways) > 1:
        reader.error(ways[1].position, f"a skill is served in one way, not by {ways[1].text} too")
        return None
    return _Mapping(reader, declaration, table, ways[0].text, stock).read(paths, conditions)


class _Mapping:
    def __init__(
        self, reader: Reader, declaration: SkillDeclaration, table: YamlMapping, way: str, stock: bool
    ) -> None:
        self._reader = reader
        self._declaration = declaration
        self._table = table
        self._way_name, self._way = way, WAYS[way]
        self._stock = stock
        self._inputs = {name: port.kind for name, port in declaration.inputs.items()}
        self._interface: Any = None

    def read(
        self, paths: Mapping[str, YamlNode], conditions: Mapping[str, YamlNode]
    ) -> MessageMapping | None:
        way, declaration = self._way_name, self._declaration
        for key, _ in self._table.entries:
            if key.text in MAPPING_KEYS and key.text not in (way, "type", *self._way.keys):
                self._error(key.position, f"{key.text} has no meaning beside {way}", self._way.keys)
        source = self._table.get(way)
        assert source is not None
        name = self._reader.text(source, way)
        kind = self._table.get("type")
        if kind is None:
            self._error(self._table.position, f"{way} needs the type", (f"type: {self._way.example}",))
        interface = self._reader.text(kind, "type") if kind is not None else None
        if name is not None:
            self._attempt(source.position, check_ros_name, name)
        if name is None or interface is None or kind is None:
            return None
        if not self._stock and not self._load(interface, kind.position):
            return None
        if way == "condition":
            declaration = replace(declaration, instant=True, reports_changes=True)
        otherwise, failures = self._read_failures(conditions)
        if way == "action" and not otherwise:
            declaration = replace(
                declaration, failures={**declaration.failures, DEFAULT_CODE: "the server gave the goal up"}
            )
        latched = self._reader.flag(self._table.get("latched"), "latched")
        sent = self._read_send()
        outputs = self._read_paths(paths)
        self._warn_of_unused(conditions)
        return MessageMapping(
            declaration,
            way,
            name,
            interface,
            sent,
            outputs,
            failures,
            otherwise or DEFAULT_CODE,
            self._read_reason(bool(failures)),
            self._read_feedback(),
            self._read_max_age(math.inf if latched else MAX_AGE_S),
            latched,
            self._stock,
            self._unread_refusal(source.position, outputs, failures),
        )

    def _unread_refusal(
        self,
        position: Position,
        outputs: Mapping[str, str],
        failures: tuple[tuple[str, CompiledExpression], ...],
    ) -> tuple[str, str] | None:
        """Return the output that says no and that no failure reads; warn when it is not even an output."""
        shape = self._shape_of_answer()
        signs = tuple(sign for sign in shape.signs if sign != shape.code or self._way_name == "service")
        given = {name: _of_every_item(path) for name, path in outputs.items()}
        keys = [key for _, expression in failures for key in expression.keys]
        read = {given.get(key, _of_every_item(key)) for key in keys}  # one of several is enough
        output = next((name for name, path in given.items() if path in signs[:1]), "")
        meant = signs or shape.flags
        if not meant or read.intersection(meant) or (not output and {*given.values()}.intersection(meant)):
            return None
        if output:
            one = given[output] != outputs[output]
            no = f"{'' if shape.denies else 'not '}${output}" if one else shape.no.replace(signs[0], output)
            return None if shape.guessed else (output, no)
        condition = self._way_name == "condition"
        what = "every message is a yes" if condition else "a refusal counts as success"
        is_flag = meant == (shape.flag,) or not signs
        about = "is true or false" if is_flag else "says how it went"
        self._reader.warning(
            position,
            f"no failure reads {' or '.join(meant)}, which {about}: {what}",
            [_remedy(shape, "not_so" if condition else "refused", f"not ${meant[0]}")],
        )
        return None

    def _shape_of_answer(self) -> AnswerShape:
        """Return the shape of what says yes or no: an answer, or a message that is nothing but a flag."""
        part = self._way.answered
        if self._interface is None or part is None or self._way_name == "wait_for":
            return AnswerShape()
        message_type = part_of(self._interface, part)
        if self._way_name == "condition":
            kinds = {*message_type.get_fields_and_field_types().values()} - {"std_msgs/Header"}
            return shape_of(message_type) if kinds == {"boolean"} else AnswerShape()
        return shape_of(message_type)

    def _warn_of_unused(self, conditions: Mapping[str, YamlNode]) -> None:
        """Warn of inputs that go nowhere (nothing is sent or judged by them), and of empty messages."""
        texts = [text for each in (self._table.get("send"), *conditions.values()) for text in texts_in(each)]
        if self._way_name == "publish" and self._interface is not None and self._table.get("send") is None:
            fields = list(part_of(self._interface, "").get_fields_and_field_types())
            if fields:
                message = "nothing is sent: the message is empty"
                self._reader.warning(self._table.position, message, [f"send: {{{fields[0]}: ...}}"])
        table = self._table.get("inputs")
        for key, _ in table.entries if isinstance(table, YamlMapping) else ():
            if not any(re.search(rf"\b{re.escape(key.text)}\b", text) for text in texts):
                where = "send: {FIELD: $%s}" if self._way.sent is not None else "when: $FIELD < $%s"
                self._reader.warning(key.position, f"the input {key.text!r} goes nowhere", [where % key.text])

    def _read_max_age(self, usual_s: float) -> float:
        source = self._table.get("max_age")
        seconds = self._reader.duration(source, "max_age") if source is not None else None
        if source is None or seconds is None:
            return usual_s
        if seconds <= 0.0:
            self._error(source.position, "max_age must be above zero", ["5 s"])
        return seconds

    def _error(self, position: Position, message: str, valid: Iterable[str] = ()) -> None:
        self._reader.error(position, message, tuple(valid))

    def _attempt(self, position: Position, what: Callable[..., Any], *given: Any) -> Any:
        """Return the value of something that may be wrong; None, and an error, when it is."""
        try:
            return what(*given)
        except ConfigError as error:
            place = Position(error.line, error.column or 1) if error.line else position
            self._error(place, error.problem, error.valid)
            return None

    def _load(self, interface: str, position: Position) -> bool:
        """Look at the interface; whether the file can be used. That it is not installed is a warning."""
        try:
            self._interface = load_interface(interface)
        except ConfigError as error:
            if "not installed" not in error.problem:
                self._error(position, error.problem, error.valid)
                return False
            self._reader.warning(position, f"{error.problem}; its fields are not checked", error.valid)
            return True
        parts = [part for part in (self._way.sent, self._way.answered) if part is not None]
        return all(self._attempt(position, part_of, self._interface, part) is not None for part in parts)

    def _field(self, part: str | None, path: str) -> str | None:
        """Return the type of a field of a part; None when the interface is not installed."""
        if self._interface is None or part is None:
            return None
        return field_type(part_of(self._interface, part), path)

    # ---- what is sent -----------------------------------------------------------------------------------

    def _read_send(self) -> tuple[tuple[str, Any], ...]:
        source = self._table.get("send")
        table = self._reader.mapping(source, "send")
        sent = []
        for key, item in table.entries if table is not None else ():
            value = self._reader.value(item, key.text)
            if value is None:
                continue
            self._check_keys(value, item.position)
            made = self._attempt(item.position, self._sent, key, value)
            if made is not None:
                sent.append((key.text, made[0]))
                self._attempt(item.position, self._check_together, sent)
        return tuple(sent)

    def _check_together(self, sent: Sequence[tuple[str, Any]]) -> None:
        """Check that a message takes the last of some values after those before it, as far as they are known.

        Raises:
            ConfigError: It does not: the lists for one array are not of one length.
        """
        if self._interface is None or "[*]" not in sent[-1][0]:
            return
        array = sent[-1][0].partition("[*]")[0]
        lengths = [
            len(value) for path, value in sent if path.startswith(f"{array}[*]") and not is_source(value)
        ]
        if len({*lengths}) > 1:
            raise ConfigError(f"{sent[-1][0]}: {lengths[-1]} values, and {lengths[0]} items are there")

    def _sent(self, key: YamlScalar, value: Value) -> tuple[Any] | None:
        try:
            written = self._field(self._way.sent, key.text)
        except ConfigError as error:
            self._error(key.position, error.problem, error.valid)
            return None
        named = self._named(key.text, written, value) if written is not None else None
        if named is not None:
            if not is_source(named) and named is not NOW:
                self._check_put(key.text, named)
            return (named,)
        if written is not None and isinstance(value, ListItems):
            value = self._numbered(key.text, written, value)
            self._check_items(key.text, written, value)
        text = written is not None and holds(Kind.TEXT, written)
        kind = Kind.TEXT if text else kind_of(value, self._inputs)
        given = kind_of(value, self._inputs) if isinstance(value, Reference) else kind
        if written is not None and given is not None and not holds(given, written):
            message = f"{key.text} is of the type {written}, which does not hold {with_article(given)}"
            raise ConfigError(message, valid=self._instead(value, written))
        made = tree_value(value, Kind.TEXT if text else None, self._inputs)
        if written is not None:
            self._check_room(key.text, written, value, made)
        return (made,)

    def _numbered(self, path: str, written: str, value: ListItems) -> ListItems:
        """Return a list with what its names of constants stand for.

        Raises:
            ConfigError: The interface has constants, and none of a name.
        """
        named = [self._named(path, item_of_array(written), each) for each in value.items]
        items = (
            replace(each, text=str(found)) if isinstance(each, Literal) and found is not None else each
            for each, found in zip(value.items, named, strict=True)
        )
        return replace(value, items=tuple(items))

    def _check_items(self, path: str, written: str, value: ListItems) -> None:
        """Check that each item of a list is what the array holds.

        Raises:
            ConfigError: One is not.
        """
        item = item_of_array(written)
        for each in value.items if item else ():
            given = kind_of(each, self._inputs)
            if given is not None and not holds(given, item):
                message = (
                    f"an item of {path} is of the type {item}, which does not hold {with_article(given)}"
                )
                raise ConfigError(message, valid=self._instead(each, item))

    def _check_room(self, path: str, written: str, value: Value, made: Any) -> None:
        """Check that a field takes the values that it will be given, as far as they are known.

        Raises:
            ConfigError: It does not.
        """
        limits = integer_limits(written)
        if limits is not None:
            self._check_limits(path, value, made, limits)
        known = [made] if not is_source(made) else []
        if isinstance(value, Reference):
            port = self._declaration.inputs.get(value.key)
            known = [*port.choices] if port is not None else []
            known += [port.default] if port is not None and not port.required else []
        for each in known:
            if each is not None:  # a default that is wrong itself
                self._check_put(path, each)
        lengths = length_limits(written)
        if isinstance(made, ListFromItems):
            if lengths is not None and not lengths[0] <= len(made.items) <= lengths[1]:
                raise ConfigError(f"{path}: {len(made.items)} items do not fit into {written}")
            for each in made.items if lengths is None or not lengths[0] else ():
                if not is_source(each):
                    self._check_put(path, (each,))

    def _check_put(self, path: str, value: Any) -> None:
        """Write a value into an empty message, as a run would.

        Raises:
            ConfigError: The field does not take it.
        """
        stamp = load_interface("builtin_interfaces/msg/Time")()
        try:
            put(part_of(self._interface, str(self._way.sent))(), path, value, stamp)
        except (ValueError, TypeError) as error:
            raise ConfigError(str(error)) from error

    def _named(self, path: str, written: str, value: Value) -> Any:
        """Return what a word or choice stands for: the present, or a constant; None for anything else.

        Raises:
            ConfigError: The interface has constants, and none of this name.
        """
        if isinstance(value, Reference) and integer_limits(written) is not None:
            port = self._declaration.inputs.get(value.key)
            if port is not None and port.choices and port.kind is Kind.TEXT:
                constants = self._constants_of_field(path, int)
                numbers = numbers_of(port.choices, constants, path.rpartition(".")[2])
                return Chosen(KeyReference(value.key), numbers)
        if not isinstance(value, Literal) or value.quoted or value.text in self._inputs:
            return None
        if written == TIME and value.text == "now":
            return NOW
        kind = kind_of_field(written)
        is_name = IDENTIFIER.fullmatch(value.text.lower()) is not None
        if kind not in _CONSTANTS or not is_name or kind_of(value, {}) is not Kind.TEXT:
            return None
        constants = self._constants_of_field(path, *_CONSTANTS[kind])
        if constants and kind is not Kind.TEXT and value.text not in constants:
            valid = closest_first(value.text, constants)
            raise ConfigError(f"{path}: the interface names no {value.text}", valid=valid)
        return constants.get(value.text)

    def _constants_of_field(self, path: str, *kinds: type) -> dict[str, Any]:
        """Return the constants that a field may mean: those of the message that has it, else of the whole."""
        whole = part_of(self._interface, str(self._way.sent))
        for message_type in (holder_of(whole, path), whole):
            found = {name: each for kind in kinds for name, each in constants_of(message_type, kind).items()}
            if found:
                return found
        return {}

    def _instead(self, value: Value, written: str) -> tuple[str, ...]:
        """Suggest what a field of a type takes in place of a value."""
        kind = kind_of_field(written)
        limits = length_limits(written)
        if written == TIME:
            return ("now",)
        match value:
            case Reference(key=name) if kind is not None:
                return (f"inputs: {{{name}: {{type: {kind.value}}}}}",)
            case Literal(text=text) if text in self._inputs:
                return (f"${text}",)
            case Literal(text=text) if kind is Kind.DURATION and _NUMBER.fullmatch(text):
                return (f"{text} s",)
            case Literal(text=text) if limits is not None and limits[0]:
                return (f"[{', '.join([text] * min(limits[0], _MOST_SHOWN))}]",)
            case Literal(text=text) if item_of_array(written):
                return (f"[{text}]",)
            case Literal(text=text) if kind is Kind.BOOLEAN:
                return ("false",) if text.lower() in ("off", "no", "false", "0") else ("true",)
        return ()

    def _check_limits(self, path: str, value: Value, made: Any, limits: tuple[int, int]) -> None:
        """Check that an integer field takes every value that it may be given.

        Raises:
            ConfigError: It does not.
        """
        possible: tuple[Any, ...] = (made,)
        if isinstance(value, Reference):
            port = self._declaration.inputs.get(value.key)
            possible = (port.minimum, port.maximum) if port is not None else ()
        low, high = limits
        for each in possible:
            if isinstance(each, (int, float)) and not low <= each <= high:
                raise ConfigError(f"{path} takes {low} to {high}, and would be given {each}")

    def _check_keys(self, value: Value, position: Position) -> None:
        """Check that only inputs of the skill are named."""
        names = getattr(value, "keys", None) or (
            (value.key,)
            if isinstance(value, Reference)
            else tuple(part.key for part in value.parts if isinstance(part, Reference))
            if isinstance(value, Template)
            else ()
        )
        for name in names:
            if name not in self._inputs:
                valid = closest_first(name, self._inputs) if self._inputs else (f"inputs: {{{name}: ...}}",)
                self._error(position, f"the skill has no input {name!r}", valid)

    # ---- what is answered -------------------------------------------------------------------------------

    def _read_paths(self, paths: Mapping[str, YamlNode]) -> dict[str, str]:
        found = {}
        for name, port in self._declaration.outputs.items():
            source = paths.get(name)
            path = name
            if source is not None:
                path = self._reader.text(source, "from") or name
            place = source.position if source is not None else self._table.position
            if self._way.answered is None:
                self._error(place, f"{self._way_name} gives nothing back: {name!r} cannot be an output")
                continue
            self._attempt(place, self._check_path, name, path, port)
            found[name] = path
        return found

    def _check_path(self, name: str, path: str, port: Port) -> None:
        written = self._field(self._way.answered, path)
        if written is None:
            return
        read = kind_of_field(written)
        cut = Kind.INTEGER in (port.kind, port.kind.item) and read in (Kind.NUMBER, Kind.NUMBER.list)
        if cut or not holds(port.kind, written):
            problem = (
                f"{name!r} is {with_article(port.kind)}, and {path} of the type {written} does not hold one"
            )
            raise ConfigError(problem, valid=[f"type: {read.value}"] if read is not None else [])

    def _read_failures(
        self, conditions: Mapping[str, YamlNode]
    ) -> tuple[str, tuple[tuple[str, CompiledExpression], ...]]:
        """Read the code of failures that nothing names, and the conditions of the others."""
        failures = []
        for code, source in conditions.items():
            expression = self._condition(source)
            if expression is None:
                continue
            kinds = self._kinds_in_answers(expression)
            for problem in check_kinds(expression, kinds, Kind.BOOLEAN).problems:
                valid = problem.valid or self._with_units(expression, kinds)
                self._error(problem.position, problem.message, valid)
            for problem in never_held(expression, self._type_or_none, self._known()):
                self._error(problem.position, problem.message, problem.valid)
            failures.append((code, compile_expression(expression, kinds)))
        without = [code for code in self._declaration.failures if code not in conditions]
        if without and (self._way_name != "action" or len(without) > 1):
            last = "only one failure may lack when: that of a goal which the server gives up"
            message = last if self._way_name == "action" else f"{without[0]!r} never comes: it lacks when"
            self._error(self._table.position, message, [f"{without[0]}: {{meaning: ..., when: $field == 1}}"])
        return (without[0] if without else ""), tuple(failures)

    def _with_units(self, expression: Expression, kinds: Mapping[str, Kind | None]) -> list[str]:
        """Suggest outputs that give the plain numbers of a message the unit of what they stand beside."""
        written = [term.kind for term in walk(expression.term) if isinstance(term, Constant)]
        units = [kind for kind in (*kinds.values(), *written) if kind in SHOWN_UNITS]
        plain = [
            name
            for name, kind in kinds.items()
            if kind is Kind.NUMBER and name not in (*self._inputs, *self._declaration.outputs)
        ]
        return [
            f"outputs: {{{name.replace('.', '_')}: {{type: {kind.value}, from: {name}}}}}"
            for name in plain
            for kind in units[:1]
            if kind is not None
        ]

    def _condition(self, source: YamlNode) -> Expression | None:
        """Read ``when``, in which each field of the answer is a key, by its path."""
        every = re.search(r"\$([\w.]+\[\*\][\w.]*)", "".join(texts_in(source)))
        if every is not None:
            name = every[1].replace("[*]", "").replace(".", "_")
            valid = f"outputs: {{{name}: {{type: list of ..., from: '{every[1]}'}}}}, and ${name}"
            self._error(
                source.position, f"{every[1]} is a list, which an expression reads from an output", [valid]
            )
            return None
        expression = self._reader.expression(source, "when", constants=self._constants_in_answers())
        if expression is None:
            return None
        return self._attempt(source.position, with_paths, expression, self._known(), self._type_or_none)

    def _constants_in_answers(self) -> Mapping[str, Any]:
        if self._interface is None or self._way.answered is None:
            return AnyConstant()
        return constants_below(part_of(self._interface, self._way.answered))

    def _known(self) -> dict[str, Kind]:
        """Return the kinds of the keys of ``when`` that are no fields."""
        outputs = {name: port.kind for name, port in self._declaration.outputs.items()}
        return {**(self._inputs if self._way_name == "condition" else {}), **outputs}

    def _type_or_none(self, path: str) -> str | None:
        try:
            return self._field(self._way.answered, path)
        except ConfigError:
            return None

    def _kind_or_none(self, path: str) -> Kind | None:
        """Return the kind of a field of the feedback; None when it has none or is not known."""
        try:
            written = self._field("Feedback", path)
        except ConfigError:
            return None
        return kind_of_field(written) if written is not None else None

    def _kinds_in_answers(self, expression: Expression) -> dict[str, Kind | None]:
        kinds: dict[str, Kind | None] = {**self._known()}
        for key in keys_of(expression.term):
            if key.key not in kinds:
                kinds[key.key] = self._kind_of_answer(self._way.answered, key.key, key.position)
        return kinds

    def _kind_of_answer(self, part: str | None, path: str, position: Position) -> Kind | None:
        """Return the kind of a field that is read; None, and an error, when it has none."""
        if self._interface is None or part is None:
            return None
        kind: Kind | None = self._attempt(position, check_readable, part_of(self._interface, part), path)
        return kind

    def _read_reason(self, can_fail: bool) -> str:
        source = self._table.get("reason")
        path = self._reader.text(source, "reason") if source is not None else None
        if source is None or path is None:
            return ""
        written = self._attempt(source.position, self._field, self._way.answered, path)
        if written is not None and not holds(Kind.TEXT, written):
            self._error(source.position, f"reason: {path} is of the type {written}, and no text")
        elif not can_fail and self._way_name == "service" and self._shape_of_answer().no:
            message = f"{path} is never told: no failure has when, and every answer counts as success"
            self._reader.warning(source.position, message, [_remedy(self._shape_of_answer(), "refused")])
        return path

    def _read_feedback(self) -> TextTemplate | None:
        source = self._table.get("feedback")
        value = self._reader.value(source, "feedback") if source is not None else None
        if source is None or value is None:
            return None
        if isinstance(value, Template | Reference):
            value = paths_in_text(value, self._kind_or_none)
        template = self._attempt(source.position, template_of, value)
        for part in template.parts if template is not None else ():
            if not isinstance(part, str):
                self._kind_of_answer("Feedback", part.key, source.position)
        return template


def _remedy(shape: AnswerShape, code: str, otherwise: str = "") -> str:
    """Write the failure that an answer of a shape lacks, and the output that it needs."""
    condition, outputs = shape.no or otherwise, ""
    if "[*]" in shape.many:
        name = shape.many.replace("[*]", "").replace(".", "_")
        outputs = f"outputs: {{{name}: {{type: list of boolean, from: '{shape.many}'}}}}, "
        condition = condition.replace(shape.many, name)
    return f"{outputs}failures: {{{code}: {{when: {condition}}}}}"


def _of_every_item(path: str) -> str:
    """Return the path of the same field of all items of an array."""
    return re.sub(r"\[\d+\]", "[*]", path).removesuffix("[*]")
