"""Every element of BehaviorTree.CPP does as a mission what it does there."""

# ruff: noqa: E501  (XML and missions on one line)

import pytest

S, F, R = "SUCCESS", "FAILURE", "RUNNING"

CASES = [
    # elements, what the skills do, the end, which skills were started
    ("<Sequence><A/><B/></Sequence>", {"a": "S", "b": "F"}, F, "ab"),
    ("<AsyncSequence><A/><B/></AsyncSequence>", {}, S, "ab"),
    ("<Fallback><A/><B/></Fallback>", {"a": "F"}, S, "ab"),
    ("<AsyncFallback><A/><B/></AsyncFallback>", {"a": "F", "b": "F"}, F, "ab"),
    ("<ReactiveSequence><A/><B/></ReactiveSequence>", {"b": [1.0]}, S, "aba"),
    ("<ReactiveFallback><A/><B/></ReactiveFallback>", {"a": ["F", "S"], "b": [1.0]}, S, "aba"),
    ("<Inverter><A/></Inverter>", {"a": "F"}, S, "a"),
    ("<ForceSuccess><A/></ForceSuccess>", {"a": "F"}, S, "a"),
    ("<ForceFailure><A/></ForceFailure>", {"a": "S"}, F, "a"),
    ("<RetryUntilSuccessful num_attempts='3'><A/></RetryUntilSuccessful>", {"a": ["F", "F", "S"]}, S, "aaa"),
    ("<RetryUntilSuccessful num_attempts='2'><A/></RetryUntilSuccessful>", {"a": "F"}, F, "aa"),
    (
        "<RetryUntilSuccessful num_attempts='-1'><A/></RetryUntilSuccessful>",
        {"a": [*"FFFFFFF", "S"]},
        S,
        "a" * 8,
    ),
    ("<Repeat num_cycles='3'><A/></Repeat>", {"a": ["S", "F"]}, F, "aa"),
    ("<Repeat num_cycles='-1'><A/></Repeat>", {"a": [*"SSS", "F"]}, F, "aaaa"),
    ("<KeepRunningUntilFailure><A/></KeepRunningUntilFailure>", {"a": [*"SS", "F"]}, F, "aaa"),
    ("<RunOnce then_skip='false'><A/></RunOnce>", {"a": "F"}, F, "a"),
    ("<Parallel><A/><B/></Parallel>", {"a": [1.0], "b": [2.0]}, S, "ab"),
    ("<Parallel><A/><B/></Parallel>", {"a": "F", "b": "R"}, F, "ab"),
    ("<Parallel success_count='1' failure_count='2'><A/><B/></Parallel>", {"a": "F", "b": [1.0]}, S, "ab"),
    ("<Parallel success_count='2' failure_count='2'><A/><B/><C/></Parallel>", {"a": "F", "b": "F"}, F, "abc"),
    ("<Parallel success_count='-2'><A/><B/><C/></Parallel>", {"a": [1.0], "b": [1.0], "c": "R"}, S, "abc"),
    ("<ParallelAll><A/><B/></ParallelAll>", {"a": "F", "b": [5.0]}, F, "ab"),
    ("<ParallelAll max_failures='2'><A/><B/></ParallelAll>", {"a": "F", "b": [5.0]}, S, "ab"),
    ("<IfThenElse><A/><B/><C/></IfThenElse>", {}, S, "ab"),
    ("<IfThenElse><A/><B/><C/></IfThenElse>", {"a": "F"}, S, "ac"),
    ("<IfThenElse><A/><B/></IfThenElse>", {"a": "F"}, F, "a"),
    ("<WhileDoElse><A/><B/><C/></WhileDoElse>", {"a": ["S", "F"], "b": [1.0]}, S, "abac"),
    ("<WhileDoElse><A/><B/></WhileDoElse>", {"a": "F"}, F, "a"),
    ("<TryCatch><A/><B/><C/></TryCatch>", {"b": "F"}, F, "abc"),
    ("<TryCatch><A/><B/><C/></TryCatch>", {}, S, "ab"),
    ("<AlwaysSuccess/>", {}, S, ""),
    ("<AlwaysFailure/>", {}, F, ""),
    ("<Sequence><Script code='x:=1'/><ScriptCondition code='x==1'/><A/></Sequence>", {}, S, "a"),
    (
        "<Sequence><Script code='x:=1; x+=2; y:=x*2'/><ScriptCondition code='y==6'/><A/></Sequence>",
        {},
        S,
        "a",
    ),
    (
        "<Sequence><SetBlackboard value='5' output_key='{k}'/><ScriptCondition code='k &gt;= 5'/></Sequence>",
        {},
        S,
        "",
    ),
    ("<Sequence><Script code='x:=2'/><A _skipIf='x==2'/><B/></Sequence>", {}, S, "b"),
    ("<Fallback><Sequence><Script code='x:=2'/><A _skipIf='x==2'/></Sequence><B/></Fallback>", {}, S, ""),
    ("<Sequence><Script code='x:=2'/><A _failureIf='x==2'/><B/></Sequence>", {}, F, ""),
    ("<Sequence><Script code='x:=2'/><A _successIf='x==2'/><B/></Sequence>", {}, S, "b"),
    ("<Sequence><Script code='x:=2'/><A _failureIf='x==2' _skipIf='x==2'/></Sequence>", {}, F, ""),
    ("<Sequence><Script code='x:=1'/><A _while='x==1'/><B/></Sequence>", {}, S, "ab"),
    ("<Sequence><A _onSuccess='k:=1'/><ScriptCondition code='k==1'/></Sequence>", {}, S, "a"),
    ("<Fallback><A _onFailure='k:=1'/><ScriptCondition code='k==1'/></Fallback>", {"a": "F"}, S, "a"),
    ("<Fallback><A _post='k:=1'/><ScriptCondition code='k==1'/></Fallback>", {"a": "F"}, S, "a"),
    (
        "<Sequence><Script code='x:=0'/><Precondition if='x==1' else='SKIPPED'><A/></Precondition></Sequence>",
        {},
        S,
        "",
    ),
    ("<Sequence><Script code='x:=0'/><Precondition if='x==1'><A/></Precondition></Sequence>", {}, F, ""),
    (
        "<Sequence><Script code='x:=0'/><Precondition if='x==0' else='FAILURE'><A/></Precondition></Sequence>",
        {},
        S,
        "a",
    ),
    (
        "<Sequence><Script code='x:=0'/><Precondition if='x==1' else='SUCCESS'><A/></Precondition></Sequence>",
        {},
        S,
        "",
    ),
    (
        "<Sequence><Script code='m:=\"b\"'/><A/></Sequence>".replace('"', "&apos;")
        .replace("'m", '"m')
        .replace("'/>", '"/>', 1),
        {},
        S,
        "a",
    ),
    (
        '<Sequence><Script code="m:=\'b\'"/><Switch2 variable="{m}" case_1="a" case_2="b"><A/><B/><C/></Switch2></Sequence>',
        {},
        S,
        "b",
    ),
    (
        '<Sequence><Script code="m:=7"/><Switch2 variable="{m}" case_1="1" case_2="2"><A/><B/><C/></Switch2></Sequence>',
        {},
        S,
        "c",
    ),
    ("<LoopInt queue='1;2;3' value='{v}'><A at='{v}'/></LoopInt>", {}, S, "aaa"),
    ("<LoopString queue='x;y' value='{v}'><A at='{v}'/></LoopString>", {"a": ["S", "F"]}, F, "aa"),
    ("<LoopInt queue='' value='{v}' if_empty='FAILURE'><A at='{v}'/></LoopInt>", {}, F, ""),
    # a sequence with memory goes on where it failed
    (
        "<RetryUntilSuccessful num_attempts='3'><SequenceWithMemory><A/><B/><C/></SequenceWithMemory></RetryUntilSuccessful>",
        {"b": ["F", "S"], "c": ["F", "S"]},
        S,
        "abbcc",
    ),
    # Nav2
    ("<RecoveryNode number_of_retries='2'><A/><B/></RecoveryNode>", {"a": ["F", "F", "S"]}, S, "ababa"),
    ("<RecoveryNode number_of_retries='1'><A/><B/></RecoveryNode>", {"a": "F"}, F, "aba"),
    ("<RecoveryNode number_of_retries='5'><A/><B/></RecoveryNode>", {"a": "F", "b": "F"}, F, "ab"),
    (
        "<RecoveryNode number_of_retries='2'><A/><RecoveryNode number_of_retries='1'><B/><C/></RecoveryNode></RecoveryNode>",
        {"a": "F", "b": "F", "c": "S"},
        F,
        "abcb",
    ),
    ("<Repeat num_cycles='4'><RoundRobin><A/><B/><C/></RoundRobin></Repeat>", {"b": "F"}, S, "abcabc"),
    ("<RoundRobin><A/><B/></RoundRobin>", {"a": "F", "b": "F"}, F, "ab"),
    ("<PipelineSequence><A/><B/></PipelineSequence>", {}, S, "ab"),
]


@pytest.mark.parametrize(("nodes", "told", "end", "calls"), CASES)
def test_element(run_tree, nodes, told, end, calls):
    status, started, _, _ = run_tree(nodes, **told)
    assert (status, "".join(started)) == (end, calls)


@pytest.mark.parametrize(
    ("nodes", "end", "seconds"),
    [
        ("<Timeout msec='1500'><A/></Timeout>", F, 1.5),
        ("<Delay delay_msec='250'><B/></Delay>", S, 0.25),
        ("<Sleep msec='400'/>", S, 0.4),
        ("<Sequence><Script code='t:=300'/><Sleep msec='{t}'/></Sequence>", S, 0.3),
    ],
)
def test_times_are_in_milliseconds(run_tree, nodes, end, seconds):
    status, _, _, now = run_tree(nodes, a="R")
    assert (status, now) == (end, seconds)


def test_a_condition_that_is_waited_for_is_polled_without_running_hot(run_tree):
    nodes = (
        "<Sequence><Script code='x:=0'/><Precondition if='x==1' else='RUNNING'><A/></Precondition></Sequence>"
    )
    status, started, _, now = run_tree(nodes, limit_s=1.0)
    assert (status, started) == (R, []) and 0.9 < now <= 1.0


def test_a_switch_whose_variable_changes_below_it_leaves_the_branch(run_tree):
    nodes = (
        "<Parallel><Switch2 variable='{m}' case_1='1' case_2='2'><A/><B/><C/></Switch2>"
        "<Sequence><Sleep msec='500'/><Script code='m:=2'/></Sequence></Parallel>"
    )
    status, started, _, now = run_tree(f"<Sequence><Script code='m:=1'/>{nodes}</Sequence>", a="R")
    assert (status, started, now) == (S, ["a", "b"], 0.5)


def test_scripts_write_what_they_say(run_tree):
    code = "a := 5; b := 2.5; c := 'x'; d := true; e := a &lt; 6 &amp;&amp; !false; f := a &gt; 9 ? 1 : 2; a *= 2"
    _, _, keys, _ = run_tree(f'<Script code="{code}"/>')
    assert keys == {"a": 10, "b": 2.5, "c": "x", "d": True, "e": True, "f": 2}


def test_logical_operators_bind_equally_as_they_do_there(run_tree):
    # a || b && c is (a || b) && c in BehaviorTree.CPP
    status, _, _, _ = run_tree(
        '<Sequence><Script code="a:=1"/><ScriptCondition code="a==1 || a==2 &amp;&amp; a==3"/></Sequence>'
    )
    assert status == F
