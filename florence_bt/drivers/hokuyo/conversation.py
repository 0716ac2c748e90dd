"""Questions and answers in a row: a script asks, this sends, waits, repeats and gives up.

A script is a generator. It yields :class:`Ask` or :class:`Listen`; each gives back the :class:`Answer`, or
raises :class:`~florence_bt.core.errors.DeviceError` where it was asked when there is none. It yields
:class:`Retune` for another speed. Bytes and the time go in, bytes come out; there is no port and no clock
here.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, TypeAlias

from florence_bt.core.errors import CommandRejected, DeviceError, DeviceTimeout
from florence_bt.drivers.hokuyo.codec import ScipReply, request
from florence_bt.drivers.hokuyo.status import ACCEPTED, describe_status

END_OF_LINE = b"\n"


@dataclass(frozen=True, slots=True)
class Retune:
    """Speak at another speed from now on; takes no time.

    A line feed goes first: what was sent at the wrong speed is half a command in the sensor's buffer.

    Attributes:
        bit_rate: Bits per second of our end of the line.
    """

    bit_rate: int


@dataclass(frozen=True, slots=True)
class Ask:
    """Send a command and wait for its echo.

    Attributes:
        command: The text to send.
        accepted: Statuses that lead on.
        attempts: How often to try, one reply time-out apart.
    """

    command: str
    accepted: tuple[str, ...] = (ACCEPTED,)
    attempts: int = 3


@dataclass(frozen=True, slots=True)
class Listen:
    """Wait for a reply that nothing was sent for, such as the next scan of a stream.

    Attributes:
        head: What its echo begins with.
        timeout_s: Longest wait; None for the reply time-out.
        ignored: Statuses that are not an answer yet.
    """

    head: str
    timeout_s: float | None = None
    ignored: tuple[str, ...] = (ACCEPTED,)


@dataclass(frozen=True, slots=True)
class Answer:
    """A reply and its times.

    Attributes:
        reply: The reply.
        sent: When the question went out, in seconds.
        arrived: When the last byte of the answer came.
    """

    reply: ScipReply
    sent: float
    arrived: float


Script: TypeAlias = Generator[Retune | Ask | Listen, Answer, Any]
"""The course of a conversation; its value is the conversation's result."""


class Conversation:
    """One script on its way.

    Attributes:
        done: Whether the script has ended.
        result: What the script returned.
        error: Why it ended early, None when it did not.
        answered: Whether the sensor said anything at all.
        bit_rate: The speed that the script wants the line to have; None when it does not care.
    """

    def __init__(self, script: Script, reply_timeout_s: float, now: float) -> None:
        """Begin.

        Args:
            script: What to say.
            reply_timeout_s: Longest wait for an answer.
            now: The time.
        """
        self._script = script
        self._timeout_s = reply_timeout_s
        self._outbox = bytearray()
        self._step: Ask | Listen | None = None
        self._attempt = 0
        self._refusal: DeviceError | None = None
        self._sent = now
        self._deadline = now
        self.done = False
        self.result: Any = None
        self.error: DeviceError | None = None
        self.answered = False
        self.bit_rate: int | None = None
        self._advance(None, now)

    @property
    def deadline(self) -> float | None:
        """Return when :meth:`poll` must be called at the latest; None when all is said."""
        return None if self.done else self._deadline

    def take_bytes(self) -> bytes:
        """Return what has to be sent now."""
        data = bytes(self._outbox)
        self._outbox.clear()
        return data

    def receive(self, reply: ScipReply, now: float) -> None:
        """Take a reply; one that answers no open question is passed over."""
        self.answered = True
        step = self._step
        if isinstance(step, Listen):
            if reply.echo.startswith(step.head) and reply.status not in step.ignored:
                self._advance(Answer(reply, self._sent, now), now)
        elif step is not None and reply.echo == step.command:
            if reply.status in step.accepted:
                self._advance(Answer(reply, self._sent, now), now)
                return
            # Asked again at the deadline: a sensor that is busy now may be ready then.
            self._refusal = CommandRejected(
                step.command, reply.status, describe_status(step.command, reply.status)
            )
            if self._attempt >= step.attempts:
                self._advance(self._refusal, now)

    def poll(self, now: float) -> None:
        """Ask again, or give up, when the answer is overdue."""
        step = self._step
        if step is None or now < self._deadline:
            return
        if isinstance(step, Ask) and self._attempt < step.attempts:
            self._send(step, now)
            return
        what = f"no answer to {step.command}" if isinstance(step, Ask) else "no scan arrived in time"
        self._advance(self._refusal or DeviceTimeout(what), now)

    def close(self) -> None:
        """End it where it stands."""
        self._step = None
        self.done = True
        self._outbox.clear()
        self._script.close()

    def _advance(self, news: Answer | DeviceError | None, now: float) -> None:
        try:
            step = self._resume(news)
            while isinstance(step, Retune):
                self.bit_rate = step.bit_rate
                self._outbox += END_OF_LINE
                step = next(self._script)
        except StopIteration as end:
            self._step, self.done, self.result = None, True, end.value
            return
        except DeviceError as error:
            self._step, self.done, self.error = None, True, error
            return
        self._step = step
        self._attempt = 0
        if isinstance(step, Ask):
            self._send(step, now)
        else:
            limit = step.timeout_s
            self._deadline = now + (self._timeout_s if limit is None else limit)

    def _resume(self, news: Answer | DeviceError | None) -> Retune | Ask | Listen:
        if news is None:
            return next(self._script)
        return self._script.throw(news) if isinstance(news, DeviceError) else self._script.send(news)

    def _send(self, step: Ask, now: float) -> None:
        self._attempt += 1
        self._refusal = None
        self._outbox += request(step.command)
        self._sent = now
        self._deadline = now + self._timeout_s
