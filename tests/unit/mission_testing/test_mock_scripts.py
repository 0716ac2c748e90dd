"""Scripts of mocks: the text form, the Python form, and what a declaration accepts of them."""

import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result
from florence_bt.mission_testing.mocks.mocks import ScriptedRun
from florence_bt.mission_testing.mocks.scripts import (
    Ending,
    MockReply,
    ReplyPhase,
    ScriptError,
    bind_reply,
    fail,
    never,
    parse_script,
    raises,
    replies_of,
    reply_per_call,
    succeed,
    to_step,
)

DRIVE = SkillDeclaration(
    "navigate_to",
    "Drive",
    inputs={"way": Port(Kind.LENGTH, "how far")},
    outputs={
        "room": Port(Kind.TEXT, "where"),
        "pose": Port(Kind.POSE, "where"),
        "n": Port(Kind.INTEGER, "x", minimum=1),
    },
    failures={"blocked": "something is in the way", "no_path": "no way leads there"},
)
LOOK = SkillDeclaration("look", "Look", outputs={"poses": Port(Kind.LIST_OF_POSE, "where")})


def endings(text, count=6):
    """The endings and codes of the first calls."""
    replies = itertools.islice(reply_per_call(replies_of(text)), count)
    return [reply.code or reply.ending.value for reply in replies]


def test_the_example_of_the_documentation():
    # Each of the two failures takes 3 s; every further call succeeds at once.
    first, second = parse_script("running 3 s, then FAILURE code 203 twice, then SUCCESS")
    assert (first.ending, first.code, first.times) == (Ending.FAILURE, 203, 2)
    assert first.phases == (ReplyPhase(3.0),)
    assert second == MockReply(Ending.SUCCESS)
    assert endings("running 3 s, then FAILURE code 203 twice, then SUCCESS", 4) == [
        203,
        203,
        "success",
        "success",
    ]


def test_a_step_for_a_time():
    first, second = parse_script("running 1 s, then SUCCESS (n=2) for 10 s, then FAILURE blocked for 500 ms")
    assert (first.lasts, first.phases, first.outputs) == (10.0, (ReplyPhase(1.0),), {"n": "2"})
    assert (second.code, second.lasts) == ("blocked", 0.5)
    assert parse_script("FAILURE for 2 s")[0] == MockReply(Ending.FAILURE, lasts=2.0)
    for wrong in ("SUCCESS for", "SUCCESS for ever", "SUCCESS for 2 s twice"):
        with pytest.raises(ScriptError):
            parse_script(wrong)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("SUCCESS", ["success"] * 6),
        ("success once", ["success"]),
        ("FAILURE no_path 3 times", ["no_path"] * 3),
        ("FAILURE no_path once then FAILURE blocked then success", ["no_path", "blocked", *["success"] * 4]),
        ("failure twice, then success", ["failure", "failure", *["success"] * 4]),
        ("never ends", ["never"] * 6),
        ("FAILURE no_path always", ["no_path"] * 6),
        ("CANCELLED\nSUCCESS", ["cancelled", *["success"] * 5]),
        ("FAILURE no_path, then SUCCESS, then again", ["no_path", "success"] * 3),
        ("SUCCESS, FAILURE blocked twice, then again", ["success", "blocked", "blocked"] * 2),
        ("SUCCESS once, again", ["success"] * 6),
    ],
)
def test_counts(text, expected):
    assert endings(text) == expected


@pytest.mark.parametrize(
    ("text", "reply"),
    [
        ("running 3 s, SUCCESS", succeed(after=3)),
        ("running 500 ms then SUCCESS", succeed(after="500 ms")),
        ("running 2 min\nSUCCESS", succeed(after=120)),
        (
            "accepted after 1 s, cancel takes 2s, running 3s, SUCCESS",
            succeed(after=3, accept_after=1, cancel_takes=2),
        ),
        ('FAILURE no_path "the door, it is shut"', fail("no_path", "the door, it is shut")),
        ("FAILURE 'it rains'", fail(None, "it rains")),
        ("FAILURE code no_path", fail("no_path")),
        ("SUCCESS (room=kitchen)", succeed(room="kitchen")),
        ("SUCCESS (room='the kitchen, left', n=3)", succeed(room="the kitchen, left", n="3")),
        ("SUCCESS (pose=(1 m, 2 m, 90 deg), n=2)", succeed(pose="(1 m, 2 m, 90 deg)", n="2")),
        ("cancel takes 1 s, never ends", never(cancel_takes=1)),
    ],
)
def test_the_text_and_the_python_form_mean_the_same(text, reply):
    assert parse_script(text) == (reply,)


@pytest.mark.parametrize(
    ("text", "offset", "says", "valid"),
    [
        ("", 0, "empty", "SUCCESS"),
        ("SUCESS", 0, "'SUCESS' is not a part", "SUCCESS"),
        ("running 3 s", 11, "stops before", "then SUCCESS"),
        ("running 3, SUCCESS", 8, "needs a unit", "3 s"),
        ("running 3 sek, SUCCESS", 8, "'sek' is not a unit", "3 s"),
        ("FAILURE no_path SUCCESS", 16, "cannot follow", "then SUCCESS"),
        ("SUCCESS always, FAILURE", 16, "nothing can follow", ""),
        ("FAILURE 0 times", 8, "at least once", "once"),
        ("SUCCESS always, again", 16, "needs steps before it", "then again"),
        ("again", 0, "needs steps before it", "then again"),
        ("SUCCESS, again, FAILURE", 16, "nothing can follow 'again'", "then again"),
        ("SUCCESS (room", 8, "never closed", ""),
        ("SUCCESS (room kitchen)", 9, "is not an output", "room=kitchen"),
        ("running 3 s saying hello, SUCCESS", 19, "in quotes", '"driving"'),
        ('FAILURE "half', 8, "no partner", ""),
        # Forms of earlier versions; each error names the form that stays.
        ("succeeds", 0, "'succeeds' is not a part", "SUCCESS"),
        ("fails twice", 0, "'fails' is not a part", "FAILURE"),
        ("hangs", 0, "'hangs' is not a part", "never ends"),
        ("3 s, SUCCESS", 0, "'3' is not a part", "running 3 s"),
        ("running forever", 8, "a duration is needed", "never ends"),
        ("SUCCESS after 3 s", 8, "cannot follow", "running 3 s, then SUCCESS"),
        ("SUCCESS with (n=2)", 8, "cannot follow", "SUCCESS (room=kitchen)"),
        ("FAILURE; SUCCESS", 0, "'FAILURE;' is not a part", "FAILURE"),
        ("SUCCESS, again and again", 15, "nothing can follow 'again'", "then again"),
    ],
)
def test_what_is_wrong_with_a_text_and_where(text, offset, says, valid):
    with pytest.raises(ScriptError) as caught:
        parse_script(text)
    assert caught.value.offset == offset
    assert says in caught.value.problem
    assert valid in ", ".join(caught.value.valid)


@given(st.text(alphabet="SUCCESFAILURE ,;()=\"'{}:0123456789 sm\nthenrug_pathwice", max_size=60))
def test_any_text_is_read_or_refused(text):
    try:
        assert parse_script(text)
    except ScriptError as error:
        assert 0 <= error.offset <= len(text)


def test_outputs_are_read_with_their_units():
    step = to_step("SUCCESS (room=kitchen, pose={x: 1 m, y: 50 cm, yaw: 180 deg}, n=2)", DRIVE)
    assert step.result.outputs == {
        "room": "kitchen",
        "pose": Pose2(1.0, 0.5, pytest.approx(3.14159265)),
        "n": 2,
    }


@pytest.mark.parametrize(
    ("text", "x"),
    [
        ("[]", []),
        ("[(1 m, 2 m, 0 deg)]", [1.0]),
        ("[(1 m, 2 m, 0 deg), {x: 3 m, y: 2 m, yaw: 0 deg} ,(50 cm, 2 m, 0 deg)]", [1.0, 3.0, 0.5]),
        ([(7.0, 2.0, 0.0), "(8 m, 2 m, 0 deg)"], [7.0, 8.0]),
    ],
)
def test_lists_of_poses(text, x):
    item = f"SUCCESS (poses={text})" if isinstance(text, str) else succeed(poses=text)
    assert [pose.x for pose in to_step(item, LOOK).result.outputs["poses"]] == x


@pytest.mark.parametrize(
    "text", ["[(1 m, 2 m)]", "[(1 m, 2 m, 0 deg) (1 m, 2 m, 0 deg)]", "(1 m, 2 m, 0 deg)", "[1]"]
)
def test_what_is_no_list_of_poses_is_refused(text):
    with pytest.raises(ConfigError, match="pose is needed"):
        to_step(f"SUCCESS (poses={text})", LOOK)


@pytest.mark.parametrize(
    ("item", "code"),
    [
        ("FAILURE", "blocked"),
        ("FAILURE no_path", "no_path"),
        ("FAILURE 208", "no_path"),
        ("FAILURE 207", "timed_out"),
        ("FAILURE server_lost", "server_lost"),
        (fail(208), "no_path"),
        (fail("blocked", "a chair"), "blocked"),
        (fail("blocked", "a chair", after="3 s"), "blocked"),
    ],
)
def test_codes_that_the_declaration_knows(item, code):
    result = to_step(item, DRIVE).result
    assert (result.outcome, result.code) == (Outcome.FAILED, code)
    assert result.reason


@pytest.mark.parametrize(
    ("item", "says", "valid"),
    [
        ("FAILURE no_pth", "cannot fail with 'no_pth'", "no_path"),
        ("FAILURE 999", "no error number 999", "208 (no_path)"),
        ("SUCCESS (rom=kitchen)", "no output 'rom'", "room"),
        ("SUCCESS (n=two)", "whole number", "3"),
        ("SUCCESS (n=0)", "below the minimum", ""),
        ("SUCCESS (pose=kitchen)", "pose is needed", "(1 m, 2 m, 90 deg)"),
        ("SUCCESS (pose=(1 m, 2 m))", "pose is needed", ""),
        ("SUCCESS (pose=(1, 2, 3))", "needs a unit", "1 m"),
        ({"rom": "kitchen"}, "no output 'rom'", "room"),
        (succeed(rom="x"), "no output 'rom'", "room"),
        (succeed(n="two"), "whole number", ""),
        (fail("nope", "x"), "cannot fail with 'nope'", "no_path"),
        (succeed(n=0.5), "integer is needed", ""),
        ("SUCCESS twice", "for several calls", ""),
        (42, "cannot be 42", "succeed()"),
    ],
)
def test_a_mock_cannot_do_what_the_skill_cannot(item, says, valid):
    with pytest.raises(ConfigError) as caught:
        to_step(item, DRIVE)
    assert says in str(caught.value)
    assert valid in ", ".join(caught.value.valid)


def test_a_skill_without_declared_failures_is_rejected():
    assert to_step("FAILURE", SkillDeclaration("plain", "x")).result.code == "rejected"


def test_lists_mix_texts_and_replies():
    replies = replies_of(["FAILURE no_path twice", fail("blocked"), succeed(room="hall")])
    codes = [reply.code or "ok" for reply in itertools.islice(reply_per_call(replies), 5)]
    assert codes == ["no_path", "no_path", "blocked", "ok", "ok"]
    replies = replies_of([fail("no_path"), fail("no_path"), "FAILURE blocked once"])
    assert [reply.code for reply in reply_per_call(replies)] == ["no_path", "no_path", "blocked"]


@pytest.mark.parametrize("script", [[], 7, {"room": "kitchen"}, [7]])
def test_what_is_no_script(script):
    with pytest.raises(ConfigError):
        replies_of(script)


def test_phases_change_the_feedback():
    # 0 s on the way; 2 s nearly there; 3 s done
    clock = ManualClock()
    text = 'running 2 s saying "on the way", running 1 s saying "nearly there", then SUCCESS'
    run = ScriptedRun(clock, to_step(text, DRIVE), {})
    assert run.feedback == "on the way"
    clock.advance(2.0)
    assert (run.feedback, run.poll()) == ("nearly there", None)
    clock.advance(1.0)
    assert isinstance(run.poll(), Result)


def test_a_broken_skill_raises_when_its_time_has_come():
    clock = ManualClock()
    run = ScriptedRun(clock, bind_reply(raises("boom", after="2 s"), DRIVE), {})
    assert run.poll() is None
    clock.advance(2.0)
    with pytest.raises(RuntimeError, match="boom"):
        run.poll()


def test_a_cancel_before_a_broken_end_ends_it():
    clock = ManualClock()
    run = ScriptedRun(clock, bind_reply(raises("boom", after="2 s"), DRIVE), {})
    run.cancel()
    clock.advance(5.0)
    assert run.poll().outcome is Outcome.CANCELLED


def test_a_reply_means_something_else_to_another_skill_of_the_same_name():
    (reply,) = parse_script("FAILURE")
    other = SkillDeclaration("navigate_to", "Drive", failures={"lost": "x"})
    assert bind_reply(reply, DRIVE) == bind_reply(reply, DRIVE)
    assert bind_reply(reply, other).result.code == "lost"
    assert bind_reply(replace(reply, times=2), DRIVE).result.code == "blocked"


@pytest.mark.parametrize("first", ["SUCCESS always", "FAILURE twice, again"])
def test_nothing_follows_what_never_comes_to_an_end(first):
    with pytest.raises(ConfigError, match="nothing can follow"):
        replies_of([first, succeed()])
