from py_trees.behaviours import Success as Succeed
from py_trees.common import ParallelPolicy, Status
from py_trees.composites import Parallel, Sequence
from py_trees.decorators import Inverter

from florence_bt.behaviours.annotations import annotations_of
from florence_bt.behaviours.composites import Selector
from florence_bt.behaviours.decorators import ForceSuccess, Invert
from florence_bt.behaviours.keys import KeyReference, KeyStore, TextTemplate
from florence_bt.behaviours.leaves import Fail
from florence_bt.behaviours.looping import Retry
from florence_bt.behaviours.parallel import CountingParallel
from florence_bt.behaviours.why import Because, Why, explain, remember_failure
from tests.ticking import make_context, tick_until


def run(clock, build):
    context = make_context(clock)
    root = build(context)
    tick_until(root, clock, context)
    return root


def test_nothing_to_explain_after_success(clock):
    assert explain(run(clock, lambda c: Succeed("s"))) is None


def test_sequence_points_to_the_child_that_failed(clock):
    root = run(
        clock, lambda c: Sequence("root", True, [Succeed("a"), Fail("b", c, "no b", "code_b"), Succeed("c")])
    )
    assert explain(root) == Why("root/b", "code_b", "no b")


def test_selector_points_to_the_last_child_and_tells_why_the_others_failed(clock):
    def build(c):
        return Selector("root", True, [Fail("a", c, "no a"), Fail("b", c, "x" * 200), Fail("c", c, "no c")])

    reason = f"no c (before that, a: no a; b: {'x' * 77}...)"
    assert explain(run(clock, build)) == Why("root/c", "failed", reason)


def test_selector_says_a_reason_that_several_branches_share_only_once(clock):
    def build(c):
        return Selector("root", True, [Fail("a", c, "same"), Fail("b", c, "same"), Fail("c", c, "last")])

    assert explain(run(clock, build)).reason == "last (before that, a, b: same)"


def test_selector_does_not_repeat_the_reason_of_its_last_branch(clock):
    def build(c):
        branches = [Fail("a", c, "nobody"), Fail("b", c, "shut"), Fail("c", c, "nobody")]
        return Selector("root", True, branches)

    assert explain(run(clock, build)).reason == "nobody (before that, a too; b: shut)"


def test_parallel_points_to_the_child_that_failed(clock):
    def build(c):
        return Parallel("root", ParallelPolicy.SuccessOnAll(), [Succeed("a"), Fail("b", c, "no b")])

    assert explain(run(clock, build)) == Why("root/b", "failed", "no b")


def test_invert_explains_itself(clock):
    root = run(clock, lambda c: Invert("not at home", Succeed("at home")))
    assert explain(root) == Why(
        "not at home", "unexpected_success", "at home succeeded, but the opposite was wanted"
    )
    assert run(clock, lambda c: Invert("not", Fail("f", c, "x"))).status is Status.SUCCESS


def test_force_success_hides_a_failure(clock):
    assert run(clock, lambda c: ForceSuccess("try", Fail("f", c, "x"))).status is Status.SUCCESS


def test_a_foreign_decorator_without_a_failing_child(clock):
    why = explain(run(clock, lambda c: Inverter("not", Succeed("s"))))
    assert (why.path, why.code) == ("not", "failed")


def test_nested_retries_tell_all_attempts(clock):
    root = run(clock, lambda c: Retry("outer", Retry("inner", Fail("f", c, "no"), c, 2), c, 3))
    assert explain(root).reason == "3 of 3 attempts failed; last: 2 of 2 attempts failed; last: no"


def test_because_replaces_the_reason_and_keeps_the_rest(clock):
    keys = KeyStore({"n": 3})
    template = TextTemplate(("failed ", KeyReference("n"), " times"))
    root = run(clock, lambda c: Sequence("root", True, [Fail("a", c, "no", "code_a")]))
    annotations_of(root).because = Because(keys, always=template)
    assert explain(root) == Why("root/a", "code_a", "failed 3 times")
    annotations_of(root).because = Because(keys, by_code={"other": template})
    assert explain(root).reason == "no"
    annotations_of(root).because = Because(keys, by_code={"code_a": template})
    assert explain(root).reason == "failed 3 times"


def test_because_with_a_missing_key_keeps_the_reason(clock):
    root = run(clock, lambda c: Fail("a", c, "no"))
    annotations_of(root).because = Because(KeyStore(), always=TextTemplate((KeyReference("gone"),)))
    assert explain(root).reason == "no"


def test_a_selector_forgets_earlier_rounds(clock):
    context = make_context(clock)
    fail_once = [True]

    class Once(Succeed):
        def update(self):
            return Status.FAILURE if fail_once.pop() else Status.SUCCESS

    fail_once[:] = [False, True]  # popped from the end: fails, then succeeds
    root = Selector("root", True, [Once("a"), Fail("b", context, "no b")])
    root.tick_once()
    assert root.children[1].status is Status.FAILURE
    root.tick_once()
    assert (root.status, root.children[1].status) == (Status.SUCCESS, Status.INVALID)


def test_a_branch_that_was_left_is_named_by_what_was_remembered_of_it(clock):
    context = make_context(clock)
    root = Selector("root", True, [Fail("a", context, "no a"), Fail("b", context, "no b")])
    root.tick_once()
    first = root.children[0]
    remember_failure(first, explain(first))
    first.stop(Status.INVALID)
    assert explain(root).reason == "no b (before that, a: no a)"
    remember_failure(first, None)
    assert explain(root).reason == "no b"


def test_a_parallel_that_counts_says_how_many_branches_failed(clock):
    def build(c):
        return CountingParallel("root", [Fail("a", c, "no a"), Succeed("b"), Fail("c", c, "no c")], 2, 2)

    root = run(clock, build)
    assert explain(root) == Why("root/a", "failed", "2 of 3 branches failed; first: no a")
    one = run(clock, lambda c: CountingParallel("root", [Fail("a", c, "no a"), Succeed("b")], 2))
    assert explain(one).reason == "no a"
