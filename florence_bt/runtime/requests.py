"""Requests for missions as they come from outside, as texts: checked and bounded before anything uses them.

Every way in (service, action, trigger by name) goes through here, so that a wrong or hostile caller gets one
clear sentence and nothing else happens.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from florence_bt.core.errors import ConfigError
from florence_bt.runtime.journal import JournalReader
from florence_bt.runtime.run import RUN_ID, MissionRequest, TriggerPolicy
from florence_bt.trees.language.loader import MissionLibrary

MAX_INPUTS = 64
MAX_NAME = 200
"""Characters of the name of a mission, an input, a caller or a run."""
MAX_VALUE = 2000
"""Characters of the value of an input, and of a reason."""
_BLANKS = str.maketrans("\n\t", "  ")


def request_from_texts(
    mission: str,
    names: Sequence[str] = (),
    values: Sequence[str] = (),
    *,
    caller: str,
    policy: str = "",
    priority: int = 0,
) -> MissionRequest:
    """Make a request of what a caller sent.

    Args:
        mission: Name of the mission.
        names: Names of its inputs.
        values: Their values as in a mission file, in the same order.
        caller: Who asks, for the records.
        policy: ``reject``, ``queue`` or ``preempt``; empty for ``reject``.
        priority: A higher number goes first.

    Raises:
        ConfigError: Something is too long, named twice or unknown; says what would have worked.
    """
    if len(names) != len(values):
        raise ConfigError(
            f"{len(names)} input names came with {len(values)} values", valid=["as many values as names"]
        )
    if len(names) > MAX_INPUTS:
        raise ConfigError(f"{len(names)} inputs are too many", valid=[f"at most {MAX_INPUTS}"])
    inputs: dict[str, str] = {}
    for name, value in zip(names, values, strict=True):
        checked_text("the name of an input", name)
        if name in inputs:
            raise ConfigError(f"the input {name!r} was given twice", valid=["each input once"])
        inputs[name] = checked_text(f"the value of the input {name!r}", value, MAX_VALUE)
    return MissionRequest(
        checked_text("the name of the mission", mission),
        inputs,
        checked_text("the caller", caller),
        policy_from_text(policy),
        priority,
    )


def check_in_time(valid_until: float) -> None:
    """Refuse what comes after the date until which somebody wanted it.

    Args:
        valid_until: Seconds since 1970; 0 for whenever it comes.

    Raises:
        ConfigError: It is too late.
    """
    late_s = time.time() - valid_until
    if valid_until > 0.0 and late_s > 0.0:
        raise ConfigError(
            f"this came {late_s:.1f} s after the date until which it was wanted",
            valid=["to ask again", "clocks that agree, if it came from another machine"],
        )


def policy_from_text(text: str) -> TriggerPolicy:
    """Return the policy with this name; empty means ``reject``.

    Raises:
        ConfigError: The policy is unknown.
    """
    if not text:
        return TriggerPolicy.REJECT
    try:
        return TriggerPolicy(text)
    except ValueError:
        shown = checked_text("the policy", text)
        raise ConfigError(
            f"unknown policy {shown!r}", valid=[policy.value for policy in TriggerPolicy]
        ) from None


def checked_text(what: str, text: str, longest: int = MAX_NAME) -> str:
    """Check a text of a caller that may go into records, logs and terminals.

    Args:
        what: Names the text in the error.
        text: The text.
        longest: Characters at most.

    Raises:
        ConfigError: It is too long, or has characters that would tear a record or a terminal.
    """
    if len(text) > longest:
        raise ConfigError(f"{what} is too long: {len(text)} characters", valid=[f"at most {longest}"])
    if not text.translate(_BLANKS).isprintable():
        raise ConfigError(f"{what} has characters that cannot be printed: {text!r}", valid=["plain text"])
    return text


def same_again(request: MissionRequest, library: MissionLibrary, runs_folder: Path) -> MissionRequest:
    """Replace the id of a run by its mission and inputs.

    Args:
        request: What a caller asks for; one that names a mission is given back as it is.
        library: The missions, which know the types of the inputs.
        runs_folder: The folder of the journal.

    Raises:
        ConfigError: No such run is in the journal, or the request brings inputs of its own.
    """
    run_id = request.mission
    if not RUN_ID.fullmatch(run_id):
        return request
    with JournalReader(runs_folder) as reader:
        row = reader.run(run_id)
    if row is None:
        raise ConfigError(f"no run {run_id!r} is in the journal", valid=["a run that florence runs shows"])
    if request.inputs:
        raise ConfigError(
            f"{run_id} is a run, and runs again with the inputs that it had", valid=["no inputs"]
        )
    return replace(request, mission=row.mission, inputs=row.typed_inputs(library.find(row.mission)))
