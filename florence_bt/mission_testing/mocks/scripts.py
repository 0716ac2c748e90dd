"""Scripts of mocks: everything that can be given as a script, and what it means for one skill.

The text form, such as ``running 3 s, then FAILURE 203 twice, then SUCCESS``::

    script  = clause {("," | "then" | newline) clause} ["then again"]
    clause  = "running" DURATION ["saying" "TEXT"]
            | "accepted after" DURATION | "cancel takes" DURATION
            | ending [count]
    ending  = "SUCCESS" ["(" name "=" value {"," name "=" value} ")"]
            | "FAILURE" ["code"] [CODE | NUMBER] ["TEXT"]
            | "CANCELLED" | "never ends" | "raises" "TEXT"
    count   = "once" | "twice" | N "times" | "always" | "for" DURATION

Words are read in upper and lower case. Clauses without an ending belong to the next ending: together they are
one step.
"""

from __future__ import annotations

import enum
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.outcome import COMMON_CODES, Result, cancelled, failure, success
from florence_bt.core.skill import Inputs
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.mission_testing.values import read_duration, read_port
from florence_bt.skills.served import error_codes
from florence_bt.trees.checks.outcomes import MISTAKES

ALWAYS = -1
"""The count of a reply that is given to every further call."""
AGAIN = -2
"""The count of a last reply that is given once, after which the script starts from the beginning."""


class Ending(enum.Enum):
    """The ends of a run of a mocked skill."""

    SUCCESS = "success"
    FAILURE = "failure"
    CANCELLED = "cancelled"
    """By the server, without a request."""
    NEVER = "never"
    RAISES = "raises"
    """A bug in the skill: it raises an exception."""


@dataclass(frozen=True, slots=True)
class ReplyPhase:
    """A part of a run.

    Attributes:
        seconds: How long it takes.
        feedback: What the run says meanwhile; empty for what it said before.
    """

    seconds: float
    feedback: str = ""


@dataclass(frozen=True, slots=True)
class MockReply:
    """The behaviour of one run of a mocked skill; :func:`bind_reply` holds it against a declaration.

    Attributes:
        ending: How it ends.
        code: Of a failure: a code, an error number of the skill's ROS server, or None for the first code
            that the skill declares.
        reason: Of a failure; the declared meaning of its code when empty.
        outputs: Of a success, by name: values in SI units or texts as in a mission file.
        phases: What happens before the ending, in order.
        accept_after: Seconds until the goal is accepted; a cancel takes effect only then.
        cancel_takes: Seconds from a cancel to the end.
        error: Of ``RAISES``.
        times: For how many calls; None for one, or for every further call when it is the last of a script.
        lasts: Seconds for which it is given to every call, from the first one on; None: ``times`` counts.
    """

    ending: Ending
    code: str | int | None = None
    reason: str = ""
    outputs: Mapping[str, Any] = field(default_factory=dict)
    phases: tuple[ReplyPhase, ...] = ()
    accept_after: float = 0.0
    cancel_takes: float = 0.0
    error: Exception | None = None
    times: int | None = None
    lasts: float | None = None


def succeed(
    *,
    after: float | str = 0.0,
    accept_after: float | str = 0.0,
    cancel_takes: float | str = 0.0,
    **outputs: Any,
) -> MockReply:
    """Make a run that succeeds.

    Args:
        after: How long it takes: seconds, or a text such as ``3 s``.
        accept_after: When the goal is accepted.
        cancel_takes: How long a cancel takes.
        **outputs: By name, in SI units or as texts with units.
    """
    return MockReply(Ending.SUCCESS, outputs=outputs, **_times(after, accept_after, cancel_takes))


def fail(
    code: str | int | None = None,
    reason: str = "",
    *,
    after: float | str = 0.0,
    accept_after: float | str = 0.0,
    cancel_takes: float | str = 0.0,
) -> MockReply:
    """Make a run that fails.

    Args:
        code: A code, an error number of the ROS server, or None for the first declared code.
        reason: A sentence for people; the declared meaning of the code when empty.
        after: How long it takes: seconds, or a text such as ``3 s``.
        accept_after: When the goal is accepted.
        cancel_takes: How long a cancel takes.
    """
    return MockReply(Ending.FAILURE, code, reason, **_times(after, accept_after, cancel_takes))


def never(*, accept_after: float | str = 0.0, cancel_takes: float | str = 0.0) -> MockReply:
    """Make a run that never ends by itself; a cancel and the deadline of the skill end it."""
    return MockReply(Ending.NEVER, **_times(0.0, accept_after, cancel_takes))


def raises(error: Exception | str, *, after: float | str = 0.0) -> MockReply:
    """Make a skill with a bug: it raises this exception."""
    broken = RuntimeError(error) if isinstance(error, str) else error
    return replace(MockReply(Ending.RAISES, error=broken), **_times(after, 0.0, 0.0))


def _times(after: float | str, accept_after: float | str, cancel_takes: float | str) -> dict[str, Any]:
    seconds = read_duration(after, "after")
    return {
        "phases": (ReplyPhase(seconds),) if seconds > 0.0 else (),
        "accept_after": read_duration(accept_after, "accept_after"),
        "cancel_takes": read_duration(cancel_takes, "cancel_takes"),
    }


def bind_reply(reply: MockReply, declaration: SkillDeclaration) -> Step:
    """Make the run that a reply means for one skill.

    Raises:
        ConfigError: The declaration does not allow the code or an output; the error says what it allows.
    """
    total, feedback = 0.0, []
    for phase in reply.phases:
        if phase.feedback:
            feedback.append((total, phase.feedback))
        total += phase.seconds
    return Step(
        result=_result(reply, declaration),
        after=total,
        accept_after=reply.accept_after,
        cancel_takes=reply.cancel_takes,
        feedback_at=tuple(feedback),
        error=reply.error,
    )


def _result(reply: MockReply, declaration: SkillDeclaration) -> Result | None:
    match reply.ending:
        case Ending.SUCCESS:
            defaults = {name: port.default for name, port in declaration.outputs.items() if not port.required}
            return success(**defaults | read_outputs(reply.outputs, declaration))
        case Ending.FAILURE:
            code = _code(reply.code, declaration)
            meaning = {**COMMON_CODES, **declaration.failures}[code]
            return failure(code, reply.reason or meaning)
        case Ending.CANCELLED:
            return cancelled(reply.reason or "cancelled by its server")
        case _:
            return None


def _code(code: str | int | None, declaration: SkillDeclaration) -> str:
    """Return the code of a failure."""
    if code is None:
        return next(iter(declaration.failures), "rejected")
    known = (*declaration.failures, *COMMON_CODES)
    if isinstance(code, int):
        numbers = {n: name for n, name in error_codes(declaration.name).items() if name in known}
        if code not in numbers:
            raise ConfigError(
                f"{declaration.name} has no error number {code}",
                valid=[*(f"{n} ({name})" for n, name in numbers.items()), *declaration.failures],
            )
        return numbers[code]
    if code not in known:
        raise ConfigError(
            f"{declaration.name} cannot fail with {code!r}", valid=_codes_like(code, declaration, known)
        )
    return code


def _codes_like(code: str, declaration: SkillDeclaration, known: tuple[str, ...]) -> tuple[str, ...]:
    """Return the codes of a group of this name, those that look like it, or all, mistakes last."""
    close = closest_first(code, known)
    grouped = tuple(
        each for group in declaration.groups if group.name == code for each in sorted(group.codes)
    )
    return grouped or (close if len(close) <= 3 else tuple(sorted(known, key=lambda each: each in MISTAKES)))


def read_outputs(outputs: Mapping[str, Any], declaration: SkillDeclaration) -> dict[str, Any]:
    """Read the outputs of a success.

    Raises:
        ConfigError: Everything that is wrong: outputs that are not declared, and values that do not fit.
    """
    values: dict[str, Any] = {}
    wrong: list[ConfigError] = []
    for name, value in outputs.items():
        port = declaration.outputs.get(name)
        if port is None:
            valid = closest_first(name, declaration.outputs) or ("no outputs",)
            wrong.append(ConfigError(f"{declaration.name} has no output {name!r}", valid=valid))
            continue
        try:
            values[name] = read_port(value, port)
        except ConfigError as error:
            problem = f"the output {name!r} of {declaration.name}: {error.problem}"
            wrong.append(ConfigError(problem, valid=error.valid))
    if wrong:
        remedies = dict.fromkeys(remedy for error in wrong for remedy in error.valid)
        raise ConfigError("; ".join(error.problem for error in wrong), valid=tuple(remedies))
    return values


Function = Callable[[Inputs], Any]
"""A mock as a function: from the inputs of a call to a text, a reply or outputs; or a generator
(:class:`florence_bt.mission_testing.mocks.mocks.RoutineRun`)."""
Script = str | MockReply | Function | Sequence[str | MockReply]
"""A text, one reply, a list of both (the last is for every further call), or a function."""

_VALID = ("'running 3 s, then SUCCESS'", "succeed()", "fail('no_path')", "never()", "a function")

MAX_TIMES = 1_000_000
"""The highest count of a step."""

_WORDS = ("SUCCESS", "FAILURE", "CANCELLED", "never ends", "raises", "running 3 s", "then", "twice")
_LOOP = "FAILURE twice, then SUCCESS, then again"
_EXAMPLE = "running 3 s, then FAILURE no_path twice, then SUCCESS"
_END_OF_WORD = r"""(?![^\s,(){}"'])"""
_WORD = r"""[^\s,(){}"']+"""
_COUNT = rf"(?:(?P<word>once|twice|always)|(?P<number>\d+)\s+times){_END_OF_WORD}"
_CODE = rf"(?!(?:then|for|once|twice|always|\d+\s+times){_END_OF_WORD}){_WORD}"
_DURATION = r"[+-]?\.?\d[\d.]*(?:\s*(?!(?:then|saying)\b)[^\W\d_]+)?"
_QUOTED = r""""[^"]*"|'[^']*'"""
_NEXT_CLAUSE = re.compile(rf"[,\n]|(?<!\S)then{_END_OF_WORD}", re.IGNORECASE)
_SEPARATORS = re.compile(rf"(?:[\s,]|then{_END_OF_WORD})*", re.IGNORECASE)


_NO_STEP = MockReply(Ending.SUCCESS)
"""A step of which nothing is known yet."""


class ScriptError(ConfigError):
    """A script cannot be read.

    Attributes:
        offset: Where the error is, in characters from the start of the text.
    """

    def __init__(self, problem: str, offset: int, valid: tuple[str, ...] = ()) -> None:
        self.offset = offset
        super().__init__(problem, valid=valid)


def parse_script(text: str) -> tuple[MockReply, ...]:
    """Read a script.

    Raises:
        ScriptError: The text is not a script; the error says where and what would have worked.
    """
    replies, problems = read_script(text)
    if problems:
        raise problems[0]
    return replies


@lru_cache(maxsize=4096)
def read_script(text: str) -> tuple[tuple[MockReply, ...], tuple[ScriptError, ...]]:
    """Return the steps of a script that can be read, and everything that is wrong with it, in order."""
    parser = _ScriptParser(text)
    replies = parser.script()
    return replies, tuple(parser.problems)


class _ScriptParser:
    def __init__(self, text: str) -> None:
        self.problems: list[ScriptError] = []
        self._text = text
        self._at = 0
        self._replies: list[MockReply] = []
        self._step = _NO_STEP

    def script(self) -> tuple[MockReply, ...]:
        """Read all clauses; what is wrong with one is noted, and the next one is read."""
        self._skip_separators()
        while self._at < len(self._text):
            try:
                if self._take_word("again"):
                    return self._again()
                self._clause()
                self._end_clause()
            except ScriptError as error:
                self.problems.append(error)
                self._skip_clause(error.offset)
        if not self.problems and self._step != _NO_STEP:
            problem = "the script stops before it says how the skill ends"
            self.problems.append(ScriptError(problem, len(self._text), (_EXAMPLE,)))
        if not self.problems and not self._replies:
            self.problems.append(ScriptError("the script is empty", 0, (_EXAMPLE, "SUCCESS")))
        return tuple(self._replies)

    def _clause(self) -> None:
        if self._replies and self._replies[-1].times == ALWAYS:
            raise ScriptError("nothing can follow a step that lasts for ever", self._at)
        step = self._step
        if self._take_word("running"):
            self._step = replace(step, phases=(*step.phases, self._phase()))
        elif self._take_word(r"accepted\s+after"):
            self._step = replace(step, accept_after=self._duration())
        elif self._take_word(r"cancel\s+takes"):
            self._step = replace(step, cancel_takes=self._duration())
        else:
            self._replies.append(self._count(self._ending(step)))
            self._step = _NO_STEP

    def _again(self) -> tuple[MockReply, ...]:
        """Read what follows ``again`` at the end: the script starts from the beginning."""
        start, replies = self._at - len("again"), self._replies
        if not self.problems and (not replies or replies[-1].times == ALWAYS):
            raise ScriptError("'again' needs steps before it that come to an end", start, (_LOOP,))
        self._skip_separators()
        if self._at < len(self._text):
            raise ScriptError("nothing can follow 'again'", self._at, (_LOOP,))
        if not replies:
            return ()
        *before, last = replies
        if last.times is not None and last.times > 1:
            before.append(replace(last, times=last.times - 1))
        return (*before, replace(last, times=AGAIN))

    def _skip_clause(self, wrong: int) -> None:
        """Go on after the next comma, ``then`` or line end behind a mistake."""
        following = _NEXT_CLAUSE.search(self._text, max(self._at, wrong))
        self._at = following.end() if following is not None else len(self._text)
        self._skip_separators()

    def _take(self, pattern: str) -> re.Match[str] | None:
        """Take what matches here, after spaces."""
        found = re.compile(rf"[^\S\n]*(?:{pattern})", re.IGNORECASE).match(self._text, self._at)
        if found is not None:
            self._at = found.end()
        return found

    def _take_word(self, words: str) -> bool:
        return self._take(words + _END_OF_WORD) is not None

    def _skip_separators(self) -> None:
        found = _SEPARATORS.match(self._text, self._at)
        self._at = found.end() if found is not None else self._at

    def _next_word(self) -> tuple[int, str]:
        """Return where the next word stands, without taking it; a sign counts as a word."""
        found = re.compile(rf"[^\S\n]*({_WORD}|.)", re.DOTALL).match(self._text, self._at)
        return (found.start(1), found[1]) if found is not None else (self._at, "")

    def _phase(self) -> ReplyPhase:
        seconds = self._duration()
        return ReplyPhase(seconds, self._quoted() if self._take_word("saying") else "")

    def _duration(self) -> float:
        start, word = self._next_word()
        found = self._take(_DURATION)
        if found is None:
            valid = ("3 s", "500 ms", "never ends")
            raise ScriptError(f"a duration is needed, not {word!r}", start, valid)
        try:
            return read_duration(found[0].strip())
        except ConfigError as error:
            raise ScriptError(error.problem, start, error.valid) from error

    def _quoted(self) -> str:
        start, word = self._next_word()
        found = self._take(_QUOTED)
        if found is None:
            raise ScriptError(f"text in quotes is needed, not {word!r}", start, ('"driving"',))
        return found[0].strip()[1:-1]

    def _ending(self, reply: MockReply) -> MockReply:
        if self._take_word("success"):
            return replace(reply, outputs=self._outputs())
        if self._take_word("failure"):
            named = self._take_word("code")
            found = self._take(_WORD if named else _CODE)
            code: str | int | None = found[0].strip() if found is not None else None
            if isinstance(code, str) and code.isdecimal() and len(code) < 10:
                code = int(code)
            reason = self._take(_QUOTED)
            text = reason[0].strip()[1:-1] if reason is not None else ""
            return replace(reply, ending=Ending.FAILURE, code=code, reason=text)
        if self._take_word("cancelled"):
            return replace(reply, ending=Ending.CANCELLED)
        if self._take_word(r"never\s+ends"):
            return replace(reply, ending=Ending.NEVER)
        if self._take_word("raises"):
            return replace(reply, ending=Ending.RAISES, error=RuntimeError(self._quoted()))
        start, word = self._next_word()
        if word in "\"'(){}":
            raise ScriptError(f"{word!r} has no partner here", start)
        close = closest_first(word, (*_WORDS, *(known.lower() for known in _WORDS)))
        known = close if len(close) <= 3 else _WORDS
        raise ScriptError(f"{word!r} is not a part of a script", start, (*known, _EXAMPLE))

    def _outputs(self) -> dict[str, Any]:
        """Read ``(room=kitchen, user=(1 m, 2 m, 0 deg))``."""
        opened = self._take(r"\(")
        if opened is None:
            return {}
        self._at, pieces = _in_brackets(self._text, self._at - 1)
        outputs: dict[str, Any] = {}
        for start, piece in pieces:
            match = re.fullmatch(r"\s*([a-z][a-z0-9_]*)\s*=\s*(.*?)\s*", piece, re.DOTALL)
            if match is None and piece.strip():
                offset = start + len(piece) - len(piece.lstrip())
                raise ScriptError(f"{piece.strip()!r} is not an output", offset, ("room=kitchen",))
            if match is not None:
                quoted = re.fullmatch(_QUOTED, match[2])
                outputs[match[1]] = match[2][1:-1] if quoted else match[2]
        return outputs

    def _count(self, reply: MockReply) -> MockReply:
        start, _ = self._next_word()
        if self._take_word("for"):
            return replace(reply, lasts=self._duration())
        count = self._take(_COUNT)
        if count is None:
            return reply
        if count["word"]:
            return replace(reply, times={"once": 1, "twice": 2, "always": ALWAYS}[count["word"].lower()])
        times = int(count["number"][:12])
        if not 1 <= times <= MAX_TIMES:
            raise ScriptError("a step is done at least once", start, ("once", "3 times"))
        return replace(reply, times=times)

    def _end_clause(self) -> None:
        """See that a separator or the end of the text follows."""
        start, word = self._next_word()
        before = self._at
        self._skip_separators()
        if self._at < len(self._text) and not self._text[before : self._at].strip(" \t"):
            if word in "\"'(){}":
                raise ScriptError(f"{word!r} has no partner here", start)
            valid = (f"then {word}",) if word.lower() in ("success", "failure", "running") else ()
            further = (
                "SUCCESS (room=kitchen)",
                "running 3 s, then SUCCESS",
                "twice",
                "3 times",
                "for 10 s",
                "always",
            )
            raise ScriptError(f"{word!r} cannot follow the end of a step", start, valid or further)


def _in_brackets(text: str, start: int) -> tuple[int, list[tuple[int, str]]]:
    """Return the end of the bracket that opens at ``start``, and the pieces between commas, with places."""
    pieces: list[tuple[int, str]] = []
    depth, quote, begin = 0, "", start + 1
    for index in range(start, len(text)):
        letter = text[index]
        if quote:
            quote = "" if letter == quote else quote
            continue
        if letter in "\"'":
            quote = letter
        elif letter in "({[":
            depth += 1
        elif letter in ")}]":
            depth -= 1
        if depth == 0 or (depth == 1 and letter == ","):
            pieces.append((begin, text[begin:index]))
            begin = index + 1
        if depth == 0:
            return index + 1, pieces
    raise ScriptError(f"the {text[start]!r} is never closed", start)


def replies_of(script: Script) -> tuple[MockReply, ...]:
    """Return the replies of a script that is not a function.

    Raises:
        ConfigError: It cannot be read.
    """
    if isinstance(script, str):
        return parse_script(script)
    if isinstance(script, MockReply):
        return (script,)
    if not isinstance(script, Sequence):
        raise ConfigError(f"{script!r} is not a script", valid=_VALID)
    if not script:
        raise ConfigError("a script needs at least one step", valid=_VALID)
    replies: list[MockReply] = []
    for part in script:
        if replies and replies[-1].times in (ALWAYS, AGAIN):
            raise ConfigError("nothing can follow a step that lasts for ever or starts again", valid=_VALID)
        replies += replies_of(part)
    return tuple(replies)


def reply_per_call(replies: Sequence[MockReply]) -> Iterator[MockReply]:
    """Yield the reply to each call; it ends when the script has no further answer."""
    again = True
    while again:
        again = False
        for index, reply in enumerate(replies):
            times = reply.times
            if times is None:
                times = ALWAYS if index == len(replies) - 1 else 1
            while times == ALWAYS:
                yield reply
            again = times == AGAIN
            for _ in range(1 if again else times):
                yield reply


def to_step(answer: Any, declaration: SkillDeclaration) -> Step:
    """Return the run that a reply, or the answer of a function, means for a skill.

    Raises:
        ConfigError: The skill cannot do that, or it is nothing that a script may hold.
    """
    match answer:
        case str():
            replies = parse_script(answer)
            if len(replies) > 1 or (replies[0].times, replies[0].lasts) != (None, None):
                raise ConfigError(
                    f"{answer!r} is for several calls; one is wanted here",
                    valid=["running 3 s, then SUCCESS"],
                )
            return bind_reply(replies[0], declaration)
        case None:
            return bind_reply(MockReply(Ending.SUCCESS), declaration)
        case Mapping():
            return bind_reply(MockReply(Ending.SUCCESS, outputs=answer), declaration)
        case MockReply():
            return bind_reply(answer, declaration)
    raise ConfigError(f"a mock of {declaration.name} cannot be {answer!r}", valid=_VALID)
