"""Sets up the folder ``.venv``: the pinned dependencies, Florence itself, its interface packages and
compiled hot loops.

Runs on a bare Python 3.11 or 3.12 (standard library only) and is called by the Makefile::

    python3 tools/setup.py            # set up, or bring up to date; does nothing when nothing changed
    python3 tools/setup.py demo       # the same without the packages that only tests and checks need
    python3 tools/setup.py lock       # choose the newest fitting versions and write requirements.lock

Each step leaves a stamp with a hash of what it was made from, written when the step is through: what is up to
date is skipped, and an interrupted run goes on where it was.
"""

from __future__ import annotations

import os
import signal
import sys

if sys.version_info < (3, 11):  # noqa: UP036 (it may be run by any Python)
    found = ".".join(map(str, sys.version_info[:2]))
    sys.exit(f"Florence needs Python 3.11 or 3.12, and this is {found}: make setup PYTHON=python3.12")

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from setup_steps import dependencies, interfaces, kernels, machine
from setup_steps.progress import Log, Step, StepFailed


def set_up(*, for_tests: bool = True) -> None:
    """Bring ``.venv`` up to date.

    Args:
        for_tests: With the packages that only tests and checks need.
    """
    machine.check()
    log = Log(machine.STATE / "setup.log")

    def packages(section: str) -> Step:
        return dependencies.packages_step(log, section)

    first = [dependencies.python_step(), packages(dependencies.BASE)]
    ros = [packages(dependencies.BUILD), interfaces.step(log)]
    ros += [packages(dependencies.TEST)] if for_tests else []
    own = [packages(dependencies.RUN), dependencies.florence_step(log), kernels.step(log)]
    steps = [*first, *ros, *own]
    labels = {step.title: f"[{number}/{len(steps)}]" for number, step in enumerate(steps, 1)}

    def do(*some: Step) -> None:
        for step in some:
            log.do(labels[step.title], step)

    if all(step.is_done() for step in steps):
        return
    do(*first)
    # Neither half needs a package of the other; each keeps a core busy.
    log.side_by_side(lambda: do(*ros), lambda: do(*own))
    print(f"ready: {machine.VENV.name}/bin/florence --help", flush=True)


def main() -> int:
    """Run the verb of the command line.

    Returns:
        0 when everything is in place, 1 when a step failed, 2 for a wrong command line.
    """
    verbs = {"": set_up, "demo": lambda: set_up(for_tests=False), "lock": dependencies.lock}
    verb = " ".join(sys.argv[1:])
    if verb not in verbs:
        print(f"unknown: {verb} (would have worked: nothing, demo, lock)", file=sys.stderr)
        return 2
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with machine.only_one():
            verbs[verb]()
    except StepFailed as failed:
        print(failed, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\ninterrupted; run it again to go on", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
