"""What ``florence check`` costs: many missions, a large one, the start-up, and a file that means harm."""

from __future__ import annotations

import os
import queue
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from florence_bt.app.mission_files.checking import check_files
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.runtime.background_check import BackgroundCheck
from florence_bt.runtime.missions import MissionFolders

MISSIONS = 200
SLEEP_S = 0.001
"""Of the executor's thread between two looks; what a look takes beyond it is a pause."""

BODY = """\
mission: {name}
description: One of many.
inputs:
  room: {{type: text, default: kitchen}}
  times: {{type: integer, default: 3, min: 1, max: 9}}
outputs:
  user: {{type: pose}}
keys:
  rounds: {{type: integer, default: 0}}
tree:
  sequence:
    - get_hotspot: {{label: $room}}
      out: {{pose: hotspot}}
    - name: get there
      selector:
        - robot_in_room: {{room: $room}}
        - timeout: 2 min
          do: {{navigate_to: {{goal: $hotspot}}}}
    - retry: $times
      on: [no_user_seen]
      attempt: look
      because: {{no_user_seen: "nobody in $look looks"}}
      do:
        sequence:
          - start_tracker:
          - if: $rounds < 2 and $look > 1
            then: {{turn: {{angle: "${{45 deg * $look}}"}}}}
            else: {{turn: {{angle: 45 deg}}}}
          - set: {{rounds: "${{$rounds + 1}}"}}
          - look_for_user: {{window: 3 s}}
            out: {{user: user}}
      finally:
        stop_tracker:
{calls}"""


def write_missions(folder: Path) -> None:
    for number in range(MISSIONS):
        callees = [2 * number + 1, 2 * number + 2]
        calls = "".join(
            f"    - run: m{callee}\n      with: {{room: hall}}\n      when: $rounds > {callee}\n"
            for callee in callees
            if callee < MISSIONS
        )
        name = f"m{number}"
        (folder / f"{name}.yaml").write_text(BODY.format(name=name, calls=calls))


def test_two_hundred_missions(benchmark, figures, tmp_path):
    write_missions(tmp_path)
    report, errors = benchmark.pedantic(check_files, args=([tmp_path],), rounds=5, warmup_rounds=1)
    assert not errors, report
    begin = time.process_time()
    check_files([tmp_path])
    cpu = time.process_time() - begin
    figures.add(
        f"check of {MISSIONS} missions that call each other",
        f"{benchmark.stats.stats.median:.2f} s",
        f"{cpu:.2f} s of one core; 20 nodes and 40 lines each; limit 2 s",
    )
    assert cpu < 2.0


def test_a_mission_of_ten_thousand_nodes(benchmark, figures, tmp_path):
    file = tmp_path / "large.yaml"
    body = "    - turn: {angle: 45 deg}\n" * 10_000
    file.write_text(f"mission: large\ndescription: Long.\ntree:\n  sequence:\n{body}")
    report, errors = benchmark.pedantic(check_files, args=([file],), rounds=3, warmup_rounds=1)
    assert not errors, report
    figures.add("check of one mission of 10,000 nodes", f"{benchmark.stats.stats.median:.2f} s")


def test_start_up(benchmark, figures, tmp_path):
    file = tmp_path / "small.yaml"
    file.write_text("mission: small\ndescription: Waits.\ntree:\n  wait: 1 s\n")

    def check() -> None:
        command = [sys.executable, "-m", "florence_bt.cli", "check", str(file)]
        subprocess.run(command, check=True, capture_output=True, env=environment)

    # As installed: the compiled code is kept, whatever the environment of this benchmark says.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    benchmark.pedantic(check, rounds=7, warmup_rounds=1)
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", "pass"], check=True)
    bare = time.perf_counter() - begin
    figures.add(
        "start-up and check of one small mission",
        f"{benchmark.stats.stats.median:.2f} s",
        f"limit 0.4 s; Python alone {bare:.2f} s",
    )


def test_a_file_that_means_harm(benchmark, figures, tmp_path):
    file = tmp_path / "harm.yaml"
    file.write_text("mission: harm\ntree:\n  sequence:\n" + "    - flyaway: {where: $x, how: 5}\n" * 7_000)
    _, errors = benchmark.pedantic(check_files, args=([file],), rounds=3)
    assert errors
    figures.add(
        "check of a file with 21,000 mistakes",
        f"{benchmark.stats.stats.median:.2f} s",
        "limit 1 s; the first 200 are told",
    )


def test_an_edit_beside_a_running_mission(benchmark, figures, tmp_path):
    """How long the executor's thread is held up while a file of 300 kB is read, checked and loaded."""
    file, lines = tmp_path / "large.yaml", "    - turn: {{angle: {} deg}}\n" * 10_000
    pauses: list[float] = []
    calls: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()

    def edit(degrees: int) -> None:
        body = lines.format(*[degrees] * 10_000)
        file.write_text(f"mission: large\ndescription: Long.\ntree:\n  sequence:\n{body}")

    def reload() -> None:
        edit(len(pauses) + 1)
        answers: list[str] = []
        calls.put(lambda: check.when_fresh(lambda problem, report: answers.append(problem)))
        longest = 0.0
        while not answers:
            begin = time.perf_counter()
            if not calls.empty():
                calls.get()()
            time.sleep(SLEEP_S)
            longest = max(longest, time.perf_counter() - begin - SLEEP_S)
        assert answers == [""]
        pauses.append(longest)

    edit(0)
    declarations = {"turn": SkillDeclaration("turn", "Turn.", inputs={"angle": Port(Kind.ANGLE, "how far")})}
    missions = MissionFolders.of([tmp_path], declarations, built_in=False)
    check = BackgroundCheck(missions, lambda missions: None, calls.put, ManualClock())
    try:
        benchmark.pedantic(reload, rounds=10, warmup_rounds=1)
    finally:
        check.close()
    figures.add(
        "longest pause of the executor's thread while a file of 300 kB is loaded",
        f"{statistics.median(pauses) * 1000:.1f} ms",
        f"the worst of {len(pauses)} edits {max(pauses) * 1000:.1f} ms; limit 5 ms; "
        f"an edit counts after {benchmark.stats.stats.median:.1f} s",
    )
    assert statistics.median(pauses) < 0.005
