"""What ``florence check`` costs: many missions, a large one, the start-up, and a file that means harm."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.measure import size
from florence_bt.app.mission_files.checking import check_files
from florence_bt.runtime.missions import MissionFolders
from florence_bt.trees.language.declarations import collect_declarations

MISSIONS = size(200, 3)
NODES = size(3_000, 30)
HARM = size(2_900, 300)
"""Nodes of a large mission, and of one that means harm: a file may have 100 kB."""
EDITS = size([(130, "4 kB"), (3_200, "100 kB")], [(130, "4 kB")])

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


def test_many_missions(benchmark, figures, tmp_path):
    write_missions(tmp_path)
    report, errors = benchmark.pedantic(
        check_files, args=([tmp_path],), rounds=size(5, 1), warmup_rounds=size(1, 0)
    )
    assert not errors, report
    begin = time.process_time()
    check_files([tmp_path])
    cpu = time.process_time() - begin
    figures.add(
        f"check of {MISSIONS} missions that call each other",
        f"{benchmark.stats.stats.median:.2f} s",
        f"{cpu:.2f} s of one core; 20 nodes and 40 lines each; limit 2 s",
    )
    figures.limit(cpu, most=2.0)


def test_a_large_mission(benchmark, figures, tmp_path):
    file = tmp_path / "large.yaml"
    body = "    - turn: {angle: 45 deg}\n" * NODES
    file.write_text(f"mission: large\ndescription: Long.\ntree:\n  sequence:\n{body}")
    report, errors = benchmark.pedantic(
        check_files, args=([file],), rounds=size(3, 1), warmup_rounds=size(1, 0)
    )
    assert not errors, report
    figures.add(f"check of one mission of {NODES:,} nodes", f"{benchmark.stats.stats.median:.2f} s")


def test_start_up(benchmark, figures, tmp_path):
    file = tmp_path / "small.yaml"
    file.write_text("mission: small\ndescription: Waits.\ntree:\n  wait: 1 s\n")

    def check() -> None:
        command = [sys.executable, "-m", "florence_bt.cli", "check", str(file)]
        subprocess.run(command, check=True, capture_output=True, env=environment)

    # As installed: the compiled code is kept, whatever the environment of this benchmark says.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    benchmark.pedantic(check, rounds=size(7, 1), warmup_rounds=size(1, 0))
    begin = time.perf_counter()
    subprocess.run([sys.executable, "-c", "pass"], check=True)
    bare = time.perf_counter() - begin
    figures.add(
        "start-up and check of one small mission",
        f"{benchmark.stats.stats.median:.2f} s",
        f"limit 0.4 s; Python alone {bare:.2f} s",
    )


def test_the_list_of_verbs(benchmark, figures):
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, "-m", "florence_bt.cli", "--help"]
    benchmark.pedantic(
        lambda: subprocess.run(command, check=True, capture_output=True, env=environment),
        rounds=size(15, 1),
        warmup_rounds=size(1, 0),
    )
    stats = benchmark.stats.stats
    figures.add("florence --help", f"{stats.median:.2f} s", f"longest {stats.max:.2f} s; aim: under 0.3 s")


def test_a_file_that_means_harm(benchmark, figures, tmp_path):
    file = tmp_path / "harm.yaml"
    file.write_text("mission: harm\ntree:\n  sequence:\n" + "    - flyaway: {where: $x, how: 5}\n" * HARM)
    _, errors = benchmark.pedantic(check_files, args=([file],), rounds=size(3, 1))
    assert errors
    figures.add(
        f"check of a file with {3 * HARM:,} mistakes",
        f"{benchmark.stats.stats.median:.2f} s",
        "limit 1 s; the first 200 are told",
    )


@pytest.mark.parametrize(("nodes", "bytes_of"), EDITS)
def test_an_edit_at_a_trigger(benchmark, figures, tmp_path, nodes, bytes_of):
    """How long a trigger holds the executor up when a file was edited."""
    file, lines = tmp_path / "edited.yaml", "    - turn: {{angle: {} deg}}\n" * nodes
    numbers = itertools.count(1)

    def edit() -> None:
        body = lines.format(*[next(numbers)] * nodes)
        file.write_text(f"mission: edited\ndescription: Turns.\ntree:\n  sequence:\n{body}")

    edit()
    missions = MissionFolders.of([tmp_path], collect_declarations())
    benchmark.pedantic(missions.refresh, setup=edit, rounds=size(10, 1), warmup_rounds=size(1, 0))
    assert missions.held == {}
    figures.add(
        f"a mission of {bytes_of} that was edited: until it is in force",
        f"{benchmark.stats.stats.median * 1000:.0f} ms",
        "on the executor's thread",
    )
