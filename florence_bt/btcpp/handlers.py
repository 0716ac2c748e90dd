"""Element -> what converts it."""

from __future__ import annotations

from florence_bt.btcpp import convert_controls as controls
from florence_bt.btcpp import convert_decorators as decorators
from florence_bt.btcpp import convert_leaves as leaves
from florence_bt.btcpp.convert import Converter, Handler, Node
from florence_bt.btcpp.xml_source import Element


def other(c: Converter, e: Element) -> Node:
    """A node of another project."""
    structural = e.tag in ("Control", "Decorator") or e.children
    return controls.unknown_control(c, e) if structural else leaves.skill(c, e)


HANDLERS: dict[str | None, Handler] = {
    "Sequence": controls.sequence,
    "AsyncSequence": controls.sequence,
    "SequenceWithMemory": controls.sequence_with_memory,
    "ReactiveSequence": controls.reactive_sequence,
    "Fallback": controls.fallback,
    "AsyncFallback": controls.fallback,
    "ReactiveFallback": controls.reactive_fallback,
    "Parallel": controls.parallel,
    "ParallelAll": controls.parallel_all,
    "IfThenElse": controls.if_then_else,
    "WhileDoElse": controls.while_do_else,
    "Switch2": controls.switch,
    "Switch3": controls.switch,
    "Switch4": controls.switch,
    "Switch5": controls.switch,
    "Switch6": controls.switch,
    "TryCatch": controls.try_catch,
    "Finally": controls.finally_node,
    "ManualSelector": decorators.without_equivalent,
    "RecoveryNode": controls.recovery_node,
    "RoundRobin": controls.round_robin,
    "PipelineSequence": controls.pipeline_sequence,
    "RateController": controls.paced_child,
    "DistanceController": controls.paced_child,
    "SpeedController": controls.paced_child,
    "GoalUpdatedController": controls.paced_child,
    "GoalUpdater": controls.goal_updater,
    "Inverter": decorators.inverter,
    "ForceSuccess": decorators.force_success,
    "ForceFailure": decorators.force_failure,
    "RetryUntilSuccessful": decorators.retry,
    "RetryUntilSuccesful": decorators.retry,
    "Repeat": decorators.repeat,
    "KeepRunningUntilFailure": decorators.keep_running,
    "Timeout": decorators.timeout,
    "Delay": decorators.delay,
    "RunOnce": decorators.run_once,
    "Precondition": decorators.precondition,
    "LoopInt": decorators.loop,
    "LoopDouble": decorators.loop,
    "LoopString": decorators.loop,
    "LoopBool": decorators.loop,
    "SkipUnlessUpdated": decorators.without_equivalent,
    "WaitValueUpdate": decorators.without_equivalent,
    "BlackboardCheck": decorators.without_equivalent,
    "AlwaysSuccess": leaves.always_success,
    "AlwaysFailure": leaves.always_failure,
    "Script": leaves.script,
    "ScriptCondition": leaves.script_condition,
    "SetBlackboard": leaves.set_blackboard,
    "UnsetBlackboard": leaves.unset_blackboard,
    "Sleep": leaves.sleep,
    "WasEntryUpdated": decorators.without_equivalent,
    "SubTree": leaves.subtree,
    "FlorenceFinally": controls.own_finally,
    "FlorenceParallel": controls.own_parallel,
    "FlorenceSwitch": controls.own_switch,
    "FlorenceRetry": decorators.own_retry,
    "FlorenceTimeout": decorators.own_timeout,
    "FlorenceDelay": decorators.own_delay,
    "FlorenceCooldown": decorators.own_cooldown,
    "FlorenceGuard": decorators.own_guard,
    "FlorenceWait": leaves.own_wait,
    "FlorenceSet": leaves.own_set,
    "FlorenceCondition": leaves.own_condition,
    None: other,
}
"""The element's name -> its converter; None is for every other element."""
