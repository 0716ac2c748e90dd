"""What one run of a mocked skill does, and what a skill's declaration accepts of it."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.errors import ConfigError, closest_first
from florence_bt.core.outcome import COMMON_CODES, Outcome, Result, cancelled, failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.mission_testing.values import read_duration, read_port

ALWAYS = -1
"""The count of a reply that is given to every further call."""
AGAIN = -2
"""The count of a last reply that is given once, after which the script starts from the beginning."""


class Ending(enum.Enum):
    """How a run of a mocked skill ends."""

    SUCCESS = "success"
    FAILURE = "failure"
    CANCELLED = "cancelled"
    """By its own side, without having been asked."""
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
    """What one run of a mocked skill does; :func:`bind_reply` holds it against a declaration.

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
    """A run that succeeds.

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
    """A run that fails.

    Args:
        code: A code, an error number of the ROS server, or None for the first declared code.
        reason: A sentence for people; the declared meaning of the code when empty.
        after: How long it takes: seconds, or a text such as ``3 s``.
        accept_after: When the goal is accepted.
        cancel_takes: How long a cancel takes.
    """
    return MockReply(Ending.FAILURE, code, reason, **_times(after, accept_after, cancel_takes))


def never(*, accept_after: float | str = 0.0, cancel_takes: float | str = 0.0) -> MockReply:
    """A run that never ends by itself; a cancel and the deadline of the skill end it."""
    return MockReply(Ending.NEVER, **_times(0.0, accept_after, cancel_takes))


def raises(error: Exception | str, *, after: float | str = 0.0) -> MockReply:
    """A skill with a bug: it raises this exception."""
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
    """The run that a reply means for one skill.

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
            return success(**read_outputs(reply.outputs, declaration))
        case Ending.FAILURE:
            code, number = _code(reply.code, declaration)
            meaning = {**COMMON_CODES, **declaration.failures}[code]
            return failure(code, reply.reason or meaning, server_code=number)
        case Ending.CANCELLED:
            return cancelled(reply.reason or "cancelled by its own side")
        case _:
            return None


def _code(code: str | int | None, declaration: SkillDeclaration) -> tuple[str, int]:
    """Code and server code of a failure."""
    if code is None:
        return next(iter(declaration.failures), "rejected"), 0
    if isinstance(code, int):
        if code not in declaration.server_codes:
            raise ConfigError(
                f"{declaration.name} has no error number {code}",
                valid=[
                    *(f"{n} ({name})" for n, name in declaration.server_codes.items()),
                    *declaration.failures,
                ],
            )
        return declaration.server_codes[code], code
    known = (*declaration.failures, *COMMON_CODES)
    if code not in known:
        raise ConfigError(f"{declaration.name} cannot fail with {code!r}", valid=_codes_like(code, known))
    return code, 0


def _codes_like(code: str, known: tuple[str, ...]) -> tuple[str, ...]:
    close = closest_first(code, known)
    return close if len(close) <= 3 else known


def read_outputs(outputs: Mapping[str, Any], declaration: SkillDeclaration) -> dict[str, Any]:
    """Read the outputs of a success.

    Raises:
        ConfigError: One is not declared, or its value does not fit.
    """
    values = {}
    for name, value in outputs.items():
        port = declaration.outputs.get(name)
        if port is None:
            valid = closest_first(name, declaration.outputs) or ("no outputs",)
            raise ConfigError(f"{declaration.name} has no output {name!r}", valid=valid)
        try:
            values[name] = read_port(value, port)
        except ConfigError as error:
            raise ConfigError(
                f"the output {name!r} of {declaration.name}: {error.problem}", valid=error.valid
            ) from error
    return values


def check_result(result: Result, declaration: SkillDeclaration) -> None:
    """Hold a ready result against a declaration.

    Raises:
        ConfigError: It is one that the real skill could not give.
    """
    if result.outcome is Outcome.SUCCEEDED:
        read_outputs(result.outputs, declaration)
    elif result.outcome is Outcome.FAILED:
        _code(result.code, declaration)
