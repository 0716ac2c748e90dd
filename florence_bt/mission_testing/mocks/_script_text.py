"""The text form of a script: ``running 3 s, then FAILURE 203 twice, then SUCCESS``.

::

    script  = step {("," | ";" | "then" | newline) step} ["then" "again" ["and" "again"]]
    step    = {phase} ending [count]
    phase   = ["running"|"for"|"after"] DURATION ["saying" "TEXT"]
            | "accepted after" DURATION | "cancel takes" DURATION
    ending  = "SUCCESS" ["(" name "=" value {"," name "=" value} ")"]
            | "FAILURE" ["code"] [CODE | NUMBER] [["because"] "TEXT"]
            | "CANCELLED" | "never ends" | "raises" "TEXT"
    count   = "once" | "twice" | N "times" | "always" | "for" DURATION

Words are read in any case. A phase may also follow its ending directly: ``SUCCESS after 3 s``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.mission_testing.mocks.replies import AGAIN, ALWAYS, Ending, Phase, Reply
from florence_bt.mission_testing.values import read_duration

MAX_TIMES = 1_000_000
"""The highest count of a step."""

_ENDINGS = {
    **dict.fromkeys(("success", "succeeds", "succeed", "succeeded", "ok"), Ending.SUCCESS),
    **dict.fromkeys(("failure", "fails", "fail", "failed"), Ending.FAILURE),
    **dict.fromkeys(("cancelled", "canceled"), Ending.CANCELLED),
    **dict.fromkeys(("never", "hangs"), Ending.NEVER),
    **dict.fromkeys(("raises", "raise", "exception"), Ending.RAISES),
}
_RUNNING = ("running", "runs", "for", "after", "within")
_COUNTS = {"once": 1, "twice": 2, "thrice": 3, "always": ALWAYS}
_SAYS = ("saying", "says")
_BECAUSE = ("because", "reason")
_WORDS = ("SUCCESS", "FAILURE", "CANCELLED", "never ends", "running 3 s", "raises", "then", "twice")
_LOOP = "FAILURE twice, then SUCCESS, then again"
_EXAMPLE = "running 3 s, then FAILURE no_path twice, then SUCCESS"
_TOKEN = re.compile(
    r"""(?P<space>[^\S\n]+)|(?P<separator>[,;\n])|(?P<text>"[^"]*"|'[^']*')|(?P<open>[({])"""
    r"""|(?P<word>[^\s,;(){}"']+)|(?P<odd>.)""",
    re.DOTALL,
)


class ScriptError(ConfigError):
    """A script cannot be read.

    Attributes:
        offset: Where the trouble begins, characters from the start of the text.
    """

    def __init__(self, problem: str, offset: int, valid: tuple[str, ...] = ()) -> None:
        self.offset = offset
        super().__init__(problem, valid=valid)


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    offset: int

    @property
    def lower(self) -> str:
        return self.text.lower()


@lru_cache(maxsize=4096)
def parse_script(text: str) -> tuple[Reply, ...]:
    """Read a script.

    Raises:
        ScriptError: It is none; the error says where and what would have worked.
    """
    return _Parser(text).script()


def _tokens(text: str) -> Iterator[_Token]:
    position = 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        assert match is not None  # the last alternative takes any character
        kind, end = match.lastgroup or "", match.end()
        if kind == "open":
            end = _closing(text, position)
            kind = "group"
        elif kind == "odd":
            raise ScriptError(f"{match[0]!r} has no partner here", position)
        if kind != "space":
            yield _Token(kind, text[position:end], position)
        position = end
    yield _Token("end", "", len(text))


def _closing(text: str, start: int) -> int:
    """The position behind the bracket that closes the one at ``start``."""
    depth, quote = 0, ""
    for index in range(start, len(text)):
        letter = text[index]
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter in "({[":
            depth += 1
        elif letter in ")}]":
            depth -= 1
            if depth == 0:
                return index + 1
    raise ScriptError(f"the {text[start]!r} is never closed", start)


class _Parser:
    def __init__(self, text: str) -> None:
        self._tokens = list(_tokens(text))
        self._index = 0

    def script(self) -> tuple[Reply, ...]:
        replies: list[Reply] = []
        while self._skip_separators().kind != "end":
            if self._now.lower == "again":
                return self._again(replies)
            if replies and replies[-1].times == ALWAYS:
                raise ScriptError("nothing can follow a step that is for always", self._now.offset)
            replies.append(self._step())
        if not replies:
            raise ScriptError("the script is empty", 0, (_EXAMPLE, "SUCCESS"))
        return tuple(replies)

    def _again(self, replies: list[Reply]) -> tuple[Reply, ...]:
        """``again`` at the end: the script begins anew."""
        token = self._take()
        self._take_if("and")
        self._take_if("again")
        if not replies or replies[-1].times == ALWAYS:
            raise ScriptError("'again' needs steps before it that come to an end", token.offset, (_LOOP,))
        if self._skip_separators().kind != "end":
            raise ScriptError("nothing can follow 'again'", self._now.offset, (_LOOP,))
        *before, last = replies
        if last.times is not None and last.times > 1:
            before.append(replace(last, times=last.times - 1))
        return (*before, replace(last, times=AGAIN))

    @property
    def _now(self) -> _Token:
        return self._tokens[self._index]

    def _take(self) -> _Token:
        token = self._now
        self._index += token.kind != "end"
        return token

    def _take_if(self, *words: str) -> bool:
        if self._now.kind == "word" and self._now.lower in words:
            self._index += 1
            return True
        return False

    def _skip_separators(self) -> _Token:
        while self._now.kind == "separator" or (self._now.kind == "word" and self._now.lower == "then"):
            self._index += 1
        return self._now

    def _step(self) -> Reply:
        reply = Reply(Ending.SUCCESS)
        while True:
            token = self._skip_separators()
            if token.kind == "end":
                raise ScriptError(
                    "the script stops before it says how the skill ends", token.offset, (_EXAMPLE,)
                )
            if token.kind == "word" and token.lower in _ENDINGS and not self._phase_follows():
                return self._ending(reply)
            if token.lower in _RUNNING and not self._number_at(self._index + 1):
                self._take()
                self._take_if("forever")
                return self._count(replace(reply, ending=Ending.NEVER))
            reply = self._phase(reply)

    def _phase_follows(self) -> bool:
        """``cancelled`` is an ending, ``cancel takes 2 s`` a phase."""
        return self._now.lower == "cancel"

    def _phase(self, reply: Reply) -> Reply:
        token = self._now
        if self._take_if("accepted", "accepts"):
            self._take_if("after")
            return replace(reply, accept_after=self._duration())
        if self._take_if("cancel", "cancelling"):
            self._take_if("takes")
            return replace(reply, cancel_takes=self._duration())
        if not self._take_if(*_RUNNING) and not self._number_at(self._index):
            self._refuse(token)
        seconds = self._duration()
        says = self._quoted() if self._take_if(*_SAYS) else ""
        return replace(reply, phases=(*reply.phases, Phase(seconds, says)))

    def _refuse(self, token: _Token) -> None:
        close = closest_first(token.text, (*_WORDS, *(word.lower() for word in _WORDS)))
        known = close if len(close) <= 3 else _WORDS
        raise ScriptError(f"{token.text!r} is no part of a script", token.offset, (*known, _EXAMPLE))

    def _number_at(self, index: int) -> bool:
        """Whether a number stands there, if only one that no duration can have."""
        return index < len(self._tokens) and re.match(r"[+-]?\.?\d", self._tokens[index].text) is not None

    def _duration(self) -> float:
        token = self._take()
        text = token.text
        if token.kind != "word":
            raise ScriptError(f"a duration is needed, not {text!r}", token.offset, ("3 s", "500 ms"))
        if re.fullmatch(r"[+-]?[\d.]+", text) and self._unit_follows():
            text = f"{text} {self._take().text}"
        try:
            return read_duration(text)
        except ConfigError as error:
            raise ScriptError(error.problem, token.offset, error.valid) from error

    def _unit_follows(self) -> bool:
        token = self._now
        word = token.kind == "word" and token.text.isalpha()
        return word and token.lower not in (*_ENDINGS, *_SAYS, "then")

    def _quoted(self) -> str:
        token = self._take()
        if token.kind != "text":
            raise ScriptError(f"a text in quotes is needed, not {token.text!r}", token.offset, ('"driving"',))
        return token.text[1:-1]

    def _ending(self, reply: Reply) -> Reply:
        token = self._take()
        ending = _ENDINGS[token.lower]
        reply = replace(reply, ending=ending)
        if ending is Ending.SUCCESS:
            self._take_if("with")
            if self._now.kind == "group":
                reply = replace(reply, outputs=_outputs(self._take()))
        elif ending is Ending.FAILURE:
            reply = self._failure(reply)
        elif ending is Ending.NEVER:
            self._take_if("ends", "end")
        elif ending is Ending.RAISES:
            reply = replace(reply, error=RuntimeError(self._quoted()))
        while self._now.kind == "word" and self._now.lower in ("after", "cancel", "accepted"):
            reply = self._phase(reply)
        return self._count(reply)

    def _failure(self, reply: Reply) -> Reply:
        self._take_if("with")
        named = self._take_if("code")
        code: str | int | None = None
        if self._now.kind == "word" and (named or not self._is_reserved()):
            text = self._take().text
            code = int(text) if text.isdigit() else text
        because = self._take_if(*_BECAUSE)
        reason = self._quoted() if because or self._now.kind == "text" else ""
        return replace(reply, code=code, reason=reason)

    def _is_reserved(self) -> bool:
        """Whether the word here is no code but the next part of the step."""
        following = self._tokens[self._index + 1]
        return self._now.lower in ("then", *_BECAUSE, "after", "for", "cancel", "accepted", *_COUNTS) or (
            self._now.text.isdigit() and following.lower == "times"
        )

    def _count(self, reply: Reply) -> Reply:
        token = self._now
        if self._take_if("for"):
            return self._end_of_step(replace(reply, lasts=self._duration()))
        if token.kind == "word" and token.lower in _COUNTS:
            self._take()
            return self._end_of_step(replace(reply, times=_COUNTS[token.lower]))
        if token.kind == "word" and token.text.isdigit() and self._tokens[self._index + 1].lower == "times":
            self._take()
            self._take()
            times = int(token.text[:12])
            if not 1 <= times <= MAX_TIMES:
                raise ScriptError("a step is done at least once", token.offset, ("once", "3 times"))
            return self._end_of_step(replace(reply, times=times))
        return self._end_of_step(reply)

    def _end_of_step(self, reply: Reply) -> Reply:
        token = self._now
        if token.kind in ("separator", "end") or token.lower == "then":
            return reply
        begins = token.lower in (*_ENDINGS, *_RUNNING)
        raise ScriptError(
            f"{token.text!r} cannot stand behind the end of a step",
            token.offset,
            (f"then {token.text}",) if begins else ("then SUCCESS", "twice", "3 times", "for 10 s", "always"),
        )


def _outputs(token: _Token) -> dict[str, Any]:
    """``(room=kitchen, user=(1 m, 2 m, 0 deg))`` or the same in braces with colons."""
    outputs: dict[str, Any] = {}
    offset = token.offset + 1
    for piece in _split(token.text[1:-1]):
        start = offset + len(piece) - len(piece.lstrip())
        offset += len(piece) + 1
        if not piece.strip():
            continue
        match = re.match(r"\s*([a-z][a-z0-9_]*)\s*[=:]\s*(.*?)\s*$", piece, re.DOTALL)
        if match is None:
            raise ScriptError(f"{piece.strip()!r} is no output", start, ("room=kitchen",))
        value = match[2]
        quoted = len(value) > 1 and value[0] == value[-1] and value[0] in "\"'"
        outputs[match[1]] = value[1:-1] if quoted else value
    return outputs


def _split(text: str) -> Iterator[str]:
    """The pieces between the commas that stand in no bracket and no quotes."""
    depth, quote, start = 0, "", 0
    for index, letter in enumerate(text):
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        elif letter in "({[":
            depth += 1
        elif letter in ")}]":
            depth -= 1
        elif letter == "," and depth == 0:
            yield text[start:index]
            start = index + 1
    yield text[start:]
