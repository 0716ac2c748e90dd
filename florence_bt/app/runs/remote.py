"""The verbs of the command line on a running system: run, look, stop, pause, reload.

``stop`` must be quick: what only some verbs need, such as the drawing of trees, is imported by those.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import closing
from typing import TYPE_CHECKING, Any

from florence_interfaces.srv import MissionStatus

from florence_bt.app.bringup.signals import held_back
from florence_bt.app.runs.client import LOCATOR, STATUS_SERVICE, MissionClient, RunWatch
from florence_bt.app.wrapping import hanging

if TYPE_CHECKING:
    from rich.console import Console

FOREVER_S = float("inf")
STOP_BUDGET_S = 20.0
"""Wall seconds to wait for the end of a run that was stopped; skills may take some to end."""


def run_mission(
    mission: str,
    inputs: Mapping[str, str],
    *,
    policy: str,
    priority: int,
    console: Console,
    headless: bool,
    detach: bool,
    whole: bool = False,
) -> bool:
    """Trigger a mission and watch it; Ctrl-C stops the mission, ``q`` leaves it to itself.

    Returns:
        Whether it succeeded, or goes on when detached or left.
    """
    with MissionClient() as client:
        said: deque[str] = deque()
        client.follow_speech(said.append)  # before the first sentence
        answer: Any = None
        try:
            # A Ctrl-C between the question and the answer would leave a mission running.
            with held_back():
                answer = client.run(mission, inputs, caller="florence run", policy=policy, priority=priority)
            name = f" (run {answer.run_id})" if answer.accepted else ""
            _say(f"{answer.message}{name}", console)
            if not answer.accepted or detach:
                return bool(answer.accepted)
            status = _watch(client, answer.run_id, console, said, headless=headless, whole=whole)
        except KeyboardInterrupt:
            if answer is not None and answer.accepted and not detach:
                _stop(client, answer.run_id, console, whole=whole)
            raise
        if status is None:
            _say("the mission goes on; florence status shows it, florence stop stops it", console)
            return True
        _print_end(status, console, whole=whole)
        return bool(status.state == "SUCCEEDED")


def _stop(client: MissionClient, run_id: str, console: Console, *, whole: bool) -> None:
    """Stop a run that is watched and show how it ended; a second Ctrl-C leaves it to end by itself."""
    client.stop("Ctrl-C at florence run", run_id)
    # Not before: a terminal that was closed takes no words.
    _say("the mission stops; another Ctrl-C does not wait for its end", console)
    watch = RunWatch(client, run_id)
    if client.spin_until(watch.over, STOP_BUDGET_S):
        _print_end(watch.result(), console, whole=whole)


def _watch(
    client: MissionClient,
    run_id: str,
    console: Console,
    said: deque[str],
    *,
    headless: bool,
    whole: bool = False,
) -> Any:
    """Show a run until it is over, or without an id what runs until Ctrl-C.

    Returns:
        Its status; None when the person at the keyboard left before its end.
    """
    from florence_bt.app.runs.live import make_display
    from florence_bt.app.runs.screen import KEYS_OF_RUN, KEYS_OF_STATUS
    from florence_bt.app.runs.watching import RunFeed

    watch, keys = RunWatch(client, run_id), KEYS_OF_RUN if run_id else KEYS_OF_STATUS
    with closing(make_display(console, headless=headless, keys=keys, whole=whole)) as display:
        feed = RunFeed(client, display, run_id)

        def look() -> None:
            while said:
                display.say(f"the robot says: {said.popleft()}")
            feed.look()

        client.spin_until(lambda: display.left or watch.over(), FOREVER_S, watch=look)
        look()
    return None if display.left else watch.result()


def show_status(run_id: str, console: Console, *, watch: bool, whole: bool = False) -> bool:
    """Print the status of a run, once or until Ctrl-C. False when no such run is known."""
    with MissionClient() as client:
        client.expect(MissionStatus, STATUS_SERVICE)
        # While the mission server is being discovered.
        from florence_bt.app.runs.run_trees import run_tree_from_ros
        from florence_bt.app.runs.screen import print_status

        status = client.status(run_id)
        if not watch:
            if run_id and not status.found:
                _say(status.tree, console)
            else:
                print_status(run_tree_from_ros(status.run_tree), console, unfolded=whole, durations=True)
            for line in _waiting_lines(status):
                _say(line, console)
            return bool(status.found or not run_id)
        client.told_tree = status.run_tree
        said: deque[str] = deque()
        client.follow_speech(said.append)
        _watch(client, "", console, said, headless=False, whole=whole)
    return True


def _print_end(status: Any, console: Console, *, whole: bool) -> None:
    """Print how a run ended; without ``whole`` what was not reached is left out."""
    from florence_bt.app.runs.run_trees import run_tree_from_ros
    from florence_bt.app.runs.screen import print_end

    print_end(run_tree_from_ros(status.run_tree), console, whole=whole)


def _say(line: str, console: Console) -> None:
    line = hanging(line, console.width if console.is_terminal else None)
    console.print(line, highlight=False, markup=False, soft_wrap=True)


def _waiting_lines(status: Any) -> list[str]:
    lines = [f"no mission may start: {status.blocked_by}"] if status.blocked_by else []
    lines += [f"no mission owns the goal of {goal}; florence stop ends it" for goal in status.unowned_goals]
    return [*lines, f"waiting: {', '.join(status.waiting)}"] if status.waiting else lines


def stop_mission(run_id: str, reason: str = "") -> tuple[bool, str]:
    """Stop a run, or the current one: (whether there was one, a message)."""
    with MissionClient() as client:
        answer = client.stop(reason or "florence stop", run_id)
        return bool(answer.success), str(answer.message)


def pause_mission(run_id: str, reason: str) -> tuple[bool, str]:
    """Pause a run, or the current one: (whether it is paused, a message)."""
    with MissionClient() as client:
        answer = client.pause(reason or "florence pause", run_id)
        return bool(answer.success), str(answer.message)


def resume_mission(run_id: str) -> tuple[bool, str]:
    """Go on with a paused run, or the current one: (whether it goes on, a message)."""
    with MissionClient() as client:
        answer = client.resume(run_id)
        return bool(answer.success), str(answer.message)


def step_mission(run_id: str) -> tuple[bool, str]:
    """Let a run, or the current one, go on to its next leaf: (whether it does, a message)."""
    with MissionClient() as client:
        answer = client.step(run_id)
        return bool(answer.success), str(answer.message)


def set_breakpoints(add: Sequence[str], remove: Sequence[str], *, clear: bool) -> tuple[bool, str]:
    """Set breakpoints and take others away: (whether it was done, what there is now)."""
    with MissionClient() as client:
        answer = client.breakpoints(add, remove, clear=clear)
    names = ", ".join(answer.breakpoints)
    now = f"runs are paused before: {names}" if names else "there are no breakpoints"
    return bool(answer.success), f"{answer.message}\n{now}" if answer.message else now


def answer_question(text: str) -> tuple[bool, str]:
    """Answer the open question, or without a text tell which it is: (whether there is one, a message)."""
    with MissionClient() as client:
        answer = client.answer(text)
        return bool(answer.accepted), str(answer.message)


def reload_files() -> tuple[bool, str]:
    """Read the files of missions and of hotspots again: (whether all of it went well, a report)."""
    with MissionClient() as client:
        answer = client.reload()
        success, report = bool(answer.success), str(answer.report)
        if client.sees(LOCATOR):  # --missions-only has none
            places = client.reload_places()
            success, report = success and bool(places.success), f"{report}\n{places.message}"
    return success, report


def live_missions() -> str:
    """List the missions of the running system with their inputs, as text."""
    with MissionClient() as client:
        answer = client.missions()
    lines = [line for mission in answer.missions for line in _mission_lines(mission)]
    return "\n".join([*lines, *answer.findings])


def _mission_lines(mission: Any) -> list[str]:
    lines = [f"{mission.name:<16} {mission.description}"]
    for port in mission.inputs:
        limits = [
            f"from {port.minimum}" if port.minimum else "",
            f"to {port.maximum}" if port.maximum else "",
        ]
        given = "required" if port.required else f"default {port.default_value}"
        details = ", ".join(part for part in (port.type, given, *limits) if part)
        about = f" -- {port.description}" if port.description else ""
        lines.append(f"{'':<16}   {port.name}: {details}{about}")
    if mission.problem:
        lines += [f"{'':<16}   cannot run: {line}" for line in mission.problem.splitlines()]
    return lines
