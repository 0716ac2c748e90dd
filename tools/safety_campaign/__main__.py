"""Attacks a simulated system, and writes what it stood into docs/safety.md.

``python tools/safety_campaign overrides --count 500 --write docs/safety.md``; ``--help`` lists the attacks.
Each brings systems up by itself, in the ROS domain of ROS_DOMAIN_ID, and ends them. All are bounded in time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from safety_campaign.kills import kill_many, kills_table
from safety_campaign.overrides import override_many, overrides_table
from safety_campaign.tables import write_between_marks


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _overrides(options: argparse.Namespace) -> str:
    return overrides_table(override_many(options.count or 500, options.seed, _say))


def _kills(options: argparse.Namespace) -> str:
    return kills_table(kill_many(options.count or 60, options.others, options.seed, _say))


ATTACKS: dict[str, Callable[[argparse.Namespace], str]] = {"overrides": _overrides, "kills": _kills}


def main() -> int:
    """Run one attack and print its table."""
    parser = argparse.ArgumentParser(prog="python tools/safety_campaign", description=__doc__)
    parser.add_argument("attack", choices=sorted(ATTACKS))
    parser.add_argument("--count", type=int, help="how often (default: the figure of docs/safety.md)")
    parser.add_argument("--others", type=int, default=5, help="kills of each process but the mission server")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the table between the marks of this page"
    )
    options = parser.parse_args()
    text = ATTACKS[options.attack](options)
    print(text)
    if options.write:
        write_between_marks(options.write, options.attack, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
