"""Attacks a simulated system, and writes what it stood into docs/notes/safety.md.

``python tools/safety_campaign overrides --count 500 --write docs/notes/safety.md``; ``--help`` lists
the attacks.
Each brings systems up by itself, in the ROS domain of ROS_DOMAIN_ID, and ends them. All are bounded in time.
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tools.safety_campaign.busy import goto_user_beside_load
from tools.safety_campaign.hands import drive_by_hand_many, hands_table
from tools.safety_campaign.hangs import PROCESSES, hang_many, hangs_table
from tools.safety_campaign.kills import kill_many, kills_table
from tools.safety_campaign.messages import attack_with_messages
from tools.safety_campaign.overrides import override_many, overrides_table
from tools.safety_campaign.pauses import stand_many, stands_table
from tools.safety_campaign.restarts import restart_many
from tools.safety_campaign.running_system import BringUp, RunningSystem
from tools.tables import command_of, table, write_table

ATTACK_S = 120.0
WAY_TO = (7.3, 4.9)
"""The bedroom of the flat, two rooms from where the robot begins."""


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _overrides(options: argparse.Namespace, bring_up: BringUp) -> str:
    return overrides_table(override_many(options.count or 500, options.seed, _say, bring_up))


def _kills(options: argparse.Namespace, bring_up: BringUp) -> str:
    return kills_table(kill_many(options.count or 60, options.others, options.seed, _say, bring_up))


def _hangs(options: argparse.Namespace, bring_up: BringUp) -> str:
    return hangs_table(hang_many(options.count or 20, options.seed, _say, bring_up, options.processes))


def _pauses(options: argparse.Namespace, bring_up: BringUp) -> str:
    return stands_table(stand_many(options.count or 12, options.seed, _say, bring_up))


def _hands(options: argparse.Namespace, bring_up: BringUp) -> str:
    return hands_table(
        drive_by_hand_many(options.count or 3, options.seed, _say, bring_up, options.processes)
    )


def _messages(options: argparse.Namespace, bring_up: BringUp) -> str:
    """Send messages for a while; then undo what any program may set, and drive the robot by a mission."""
    with bring_up(options.seed) as system:
        before = system.pids()
        report = attack_with_messages(float(options.count or ATTACK_S), options.seed)
        ended = [name for name, pid in before.items() if system.pid(name) != pid]
        system.put_back()
        status = system.runs_to_pose(*WAY_TO)
        if ended:
            _say(system.output)
    rows = []
    for kind in ("msg", "srv", "action"):
        mine = {name: count for name, count in report.sent.items() if f"/{kind}/" in name}
        types = {name.partition("(")[2] for name in mine}
        what = {"msg": "topics", "srv": "services", "action": "parts of actions"}[kind]
        rows.append((what, str(len(mine)), str(len(types)), str(sum(mine.values()))))
    afterwards = f"{status.state}{status.reason and ': '}{status.reason}"
    lines = (
        table(("attacked", "names", "types", "messages"), rows),
        f"Processes ended: {', '.join(ended) or 'none'}. "
        f"Nodes lost: {', '.join(report.nodes_lost) or 'none'}. "
        f"goto_pose afterwards, once mode of the base, map and place are set again: {afterwards}.",
    )
    return "\n\n".join(lines)


def _presses(options: argparse.Namespace, _bring_up: BringUp) -> str:
    from tools.safety_campaign.presses import press_many, presses_table  # needs a browser

    return presses_table(press_many(options.count or 100, options.seed, _say))


def _restarts(options: argparse.Namespace, _bring_up: BringUp) -> str:
    return f"{restart_many(options.count or 200, options.seed)}."


def _busy(options: argparse.Namespace, _bring_up: BringUp) -> str:
    return f"{goto_user_beside_load(options.count or 50, options.seed).text()}."


ATTACKS: dict[str, Callable[[argparse.Namespace, BringUp], str]] = {
    "overrides": _overrides,
    "kills": _kills,
    "hangs": _hangs,
    "pauses": _pauses,
    "hands": _hands,
    "messages": _messages,
    "presses": _presses,
    "restarts": _restarts,
    "busy": _busy,
}


def main(arguments: Sequence[str] | None = None, bring_up: BringUp = RunningSystem) -> int:
    """Run one attack and print what came of it."""
    parser = argparse.ArgumentParser(prog="python tools/safety_campaign", description=__doc__)
    parser.add_argument("attack", choices=sorted(ATTACKS))
    parser.add_argument(
        "--count", type=int, help="how often; of messages how many seconds (default: as in the docs)"
    )
    parser.add_argument(
        "--others",
        type=int,
        default=5,
        help="kills of each process but the mission server",
    )
    parser.add_argument(
        "--processes", nargs="+", choices=PROCESSES, default=PROCESSES, help="that hang, one after the other"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the result between the marks of this page"
    )
    options = parser.parse_args(arguments)
    text = ATTACKS[options.attack](options, bring_up)
    print(text)
    if options.write:
        write_table(options.write, options.attack, text, command_of("tools/safety_campaign", arguments))
    return 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # what was started is ended, too
    sys.exit(main())
