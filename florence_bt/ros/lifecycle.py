"""A managed node (https://design.ros2.org/articles/node_lifecycle.html): its states, services and topic.

The state machine is rcl's own. The node class of ``rclpy.lifecycle`` would not do: its transitions end within
the callback of their service, and a robot that has to stop first takes longer; its services do not go through
:class:`FlorenceNode`, which checks requests and repeats answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from lifecycle_msgs.msg import State, Transition, TransitionDescription, TransitionEvent
from lifecycle_msgs.srv import ChangeState, GetAvailableStates, GetAvailableTransitions, GetState
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.type_support import check_is_valid_srv_type

from florence_bt.ros.answers import Deferred
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE

Done = Callable[[bool], None]
"""Told whether the work of a transition went well; a node whose work did not stays in the state it was in."""
CONFIGURE, ACTIVATE, DEACTIVATE, SHUTDOWN = "configure", "activate", "deactivate", "shutdown"


class Lifecycle:
    """The states of a node, and its services ``~/change_state``, ``~/get_state`` and so on.

    Args:
        node: The node that serves them.
        work: What a transition does: the label of the transition -> a function, given what to call when it is
            done. A transition that is not named does nothing.
        on_state: Called after each change of the state.
    """

    def __init__(
        self,
        node: FlorenceNode,
        work: Mapping[str, Callable[[Done], None]],
        on_state: Callable[[], None] = lambda: None,
    ) -> None:
        self._node = node
        self._work = work
        self._on_state = on_state
        for service in (ChangeState, GetState, GetAvailableStates, GetAvailableTransitions):
            check_is_valid_srv_type(service)  # imports the type supports that rcl wants
        with node.handle:
            self._machine: Any = _rclpy.LifecycleStateMachine(node.handle, False)
        node.on_destroy(self._machine.destroy_when_not_in_use)
        self._events = node.create_publisher(TransitionEvent, "~/transition_event", RELIABLE)
        node.create_service(ChangeState, "~/change_state", self._on_change_state)
        node.create_service(GetState, "~/get_state", self._on_get_state)
        node.create_service(GetAvailableStates, "~/get_available_states", self._on_states)
        node.create_service(GetAvailableTransitions, "~/get_available_transitions", self._on_transitions)
        node.create_service(GetAvailableTransitions, "~/get_transition_graph", self._on_graph)

    @property
    def state(self) -> str:
        """The label of the present state, e.g. ``active``; ``deactivating`` while that goes on."""
        return str(self._machine.current_state[1])

    @property
    def active(self) -> bool:
        """Tell whether the node does its work."""
        return bool(self._machine.current_state[0] == State.PRIMARY_STATE_ACTIVE)

    def change(self, label: str, done: Done = lambda succeeded: None) -> None:
        """Begin a transition.

        Args:
            label: ``configure``, ``activate``, ``deactivate``, ``cleanup`` or ``shutdown``.
            done: Told whether the node is in the state that was asked for; False at once when the present
                state has no such transition.
        """
        found = [each[0] for each in self._machine.available_transitions if each[1] == label]
        if found:
            self._begin(found[0], done)
        else:
            done(False)

    def _begin(self, transition: int, done: Done) -> None:
        labels = {each[0]: each[1] for each in self._machine.available_transitions}
        if transition not in labels:
            done(False)
            return
        self._trigger(transition)

        def end(succeeded: bool) -> None:
            outcome = "transition_success" if succeeded else "transition_failure"
            (number,) = (each[0] for each in self._machine.available_transitions if each[1] == outcome)
            self._trigger(number)
            done(succeeded)

        try:
            self._work.get(labels[transition], lambda end: end(True))(end)
        except Exception:
            end(False)
            raise

    def _trigger(self, transition: int) -> None:
        (label,) = (each[1] for each in self._machine.available_transitions if each[0] == transition)
        start = self._machine.current_state
        self._machine.trigger_transition_by_id(transition, False)
        self._events.publish(
            TransitionEvent(
                timestamp=self._node.get_clock().now().nanoseconds,
                transition=Transition(id=transition, label=label),
                start_state=_state(start),
                goal_state=_state(self._machine.current_state),
            )
        )
        self._on_state()

    def _on_change_state(self, request: ChangeState.Request, response: ChangeState.Response) -> Any:
        later = Deferred()

        def answer(succeeded: bool) -> None:
            response.success = succeeded
            later.answer(response)

        # As in rcl: the label counts when there is one.
        if request.transition.label:
            self.change(request.transition.label, answer)
        else:
            self._begin(request.transition.id, answer)
        return later

    def _on_get_state(self, request: GetState.Request, response: GetState.Response) -> GetState.Response:
        response.current_state = _state(self._machine.current_state)
        return response

    def _on_states(
        self, request: GetAvailableStates.Request, response: GetAvailableStates.Response
    ) -> GetAvailableStates.Response:
        response.available_states = [_state(each) for each in self._machine.available_states]
        return response

    def _on_transitions(
        self, request: GetAvailableTransitions.Request, response: GetAvailableTransitions.Response
    ) -> GetAvailableTransitions.Response:
        response.available_transitions = _descriptions(self._machine.available_transitions)
        return response

    def _on_graph(
        self, request: GetAvailableTransitions.Request, response: GetAvailableTransitions.Response
    ) -> GetAvailableTransitions.Response:
        response.available_transitions = _descriptions(self._machine.transition_graph)
        return response


def _state(state: tuple[int, str]) -> State:
    return State(id=state[0], label=state[1])


def _descriptions(transitions: Iterable[tuple[int, str, int, str, int, str]]) -> list[TransitionDescription]:
    return [
        TransitionDescription(
            transition=Transition(id=number, label=label),
            start_state=_state((start, start_label)),
            goal_state=_state((goal, goal_label)),
        )
        for number, label, start, start_label, goal, goal_label in transitions
    ]
