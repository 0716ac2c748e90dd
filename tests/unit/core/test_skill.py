"""The life of a run: when the other side is told to stop, which result counts, who is told of what."""

import pytest

from florence_bt.core.outcome import Outcome, cancelled, failure, success
from florence_bt.core.skill import BaseRun, Event, FinishedRun, InstantSkill, MissingSkill, Phase

LETTERS = {"a": Event.ACCEPTED, "c": Event.CANCEL, "f": Event.FINISHED}


@pytest.mark.parametrize(
    ("events", "stops"),
    [
        # The other side is told once to stop, as soon as it has accepted.
        ("acc", " x "),
        ("acaf", " x  "),
        ("cca", "  x"),
        ("caac", " x  "),
        # What is over is not stopped.
        ("aafc", "    "),
        ("fcf", "   "),
        ("cfc", "   "),
        ("acfc", " x  "),
        # A goal that is accepted after the end was reported must not be left running, however often.
        ("fa", " x"),
        ("cfaa", "  xx"),
    ],
)
def test_when_the_other_side_is_told_to_stop(events, stops):
    state = BaseRun()
    sent = [state.handle(LETTERS[letter], success()) for letter in events]
    assert "".join(" x"[stop] for stop in sent) == stops


def test_the_first_result_stays():
    state = BaseRun()
    with pytest.raises(ValueError, match="without a result"):
        state.handle(Event.FINISHED)
    state.handle(Event.CANCEL, success())
    assert state.result is None and state.phase is Phase.PENDING_CANCEL
    state.handle(Event.FINISHED, cancelled())
    state.handle(Event.FINISHED, success())
    assert state.result == cancelled() and state.phase is Phase.DONE


def test_what_subscribers_are_told():
    state, told = BaseRun("waiting"), []
    state.on_change(lambda: told.append((state.phase, state.feedback)))
    state.set_feedback("waiting")
    state.set_feedback("driving")
    state.set_feedback("driving")
    for event in (Event.ACCEPTED, Event.ACCEPTED, Event.FINISHED):
        state.handle(event, success())
    state.set_feedback("driving on")
    assert told == [(Phase.PENDING, "driving"), (Phase.ACTIVE, "driving"), (Phase.DONE, "driving")]


def test_skills_that_answer_at_once():
    run = InstantSkill(
        lambda inputs: failure("low", f"only {inputs['charge']}", charge=inputs["charge"])
    ).start({"charge": 0.2})
    assert isinstance(run, FinishedRun)
    assert run.poll() == failure("low", "only 0.2", charge=0.2) and run.feedback == "only 0.2"
    run.cancel()
    assert run.poll().code == "low"
    assert MissingSkill("no camera").start({}).poll() == failure("no_skill", "no camera")


def test_results():
    assert success(x=1).succeeded and success(x=1).outputs == {"x": 1} and success().code == "ok"
    assert not failure("low", "empty").succeeded and not cancelled().succeeded
    assert (cancelled().outcome, cancelled().code) == (Outcome.CANCELLED, "cancelled")
