"""Files that would hurt: each is refused with a clear message, with little work and within bounded memory.

One child process with a limit on its memory checks them all, as ``florence check`` does. The work is counted
in calls of functions, so that no machine is too slow for the test.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("hostile files")]  # one child for all

MEMORY = 400_000_000
"""Bytes of address space that the child may have; Python with the checks takes about 100 MB."""
MAX_CALLS = 8_000_000
"""Calls of functions, in Python and C, that one file may cost: a second or two of processor time."""

HEAD = "mission: {name}\ndescription: A hostile file.\ntree:\n"


def leaves(count: int, leaf: str) -> str:
    return HEAD + "  sequence:\n" + f"    - {leaf}\n" * count


def billion_laughs() -> str:
    rows = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    rows += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
    return "\n".join(rows) + "\n"


HOSTILE: dict[str, tuple[str | bytes, str]] = {
    # name -> (content, part of the message)
    "bomb": (billion_laughs(), "anchors and aliases are not allowed"),
    "self": ("a: &a [*a]\n", "anchors and aliases are not allowed"),
    "merge": ("a: {b: 1}\nc: {<<: {b: 2}}\n", "merges (<<) are not allowed"),
    "tag": ("tree: !!python/object/apply:os.system ['touch /tmp/pwned']\n", "the tag"),
    "tag2": ("tree: !!python/name:os.system\n", "the tag"),
    "flow": ("[" * 10_000 + "]" * 10_000, "nested more than 100 deep"),
    "flow_maps": ("{a: " * 10_000 + "}" * 10_000, "nested more than 100 deep"),
    "block": ("".join(" " * n + "a:\n" for n in range(400)), "nested more than 100 deep"),
    "dashes": ("- " * 49_000, "nested more than 100 deep"),
    "questions": ("? " * 49_000, "nested more than 100 deep"),
    "invert": (HEAD + "  " + "{invert: " * 5000 + "{wait: 1 s}" + "}" * 5000, "nested more than 100 deep"),
    "nodes": (leaves(6_000, "wait: 1"), "a duration needs a unit"),
    "flow_list": ("[" + "a," * 49_000 + "a]", "a mission file must be a mapping"),
    "skills": (leaves(5_000, "fly_away:"), "there is no skill"),
    "calls": (leaves(5_000, "run: nowhere"), "there is no mission 'nowhere'"),
    "modifiers": (leaves(2_300, "becaus: x\n      wait: 1 s"), "unknown modifier"),
    "many_keys": (
        HEAD + "  set:\n" + "".join(f"    k{n}: 1\n" for n in range(6_500)),
        "nothing reads the key",
    ),
    "many_inputs": (
        "mission: {name}\ninputs:\n" + "".join(f"  i{n}: {{type: txt}}\n" for n in range(4_000)),
        "txt",
    ),
    "sections": (
        "mission: sections\n" + "".join(f"inpts{n}: 1\n" for n in range(6_500)),
        "unknown key of a mission",
    ),
    "close_names": (leaves(4_000, "turn: {angel: 5}"), "turn has no input 'angel'"),
    "codes": (leaves(2_200, "{fail: x, because: {flyin: y}}"), "cannot fail with 'flyin'"),
    "tall": (HEAD + "  " + "{invert: " * 99 + "{wait: 1 s}" + "}" * 99, "nested more than"),
    "tall_enough": (HEAD + "  " + "{invert: " * 97 + "{wait: 1}" + "}" * 97, "a duration needs a unit"),
    "twins": (HEAD + "  set: {" + "a: 1, " * 16_000 + "}\n", "the key 'a' is duplicated"),
    "scalar": (HEAD + "  fail: " + "x" * 99_000 + "\n", "at most 10000 are read"),
    "key": (HEAD + "  " + "x" * 99_000 + ": 1\n", "at most 10000 are read"),
    "number": (HEAD + "  wait: " + "1" * 9000 + " x y\n", "a duration is needed"),
    "numbers": (leaves(10, "wait: " + "1" * 9000 + " x y"), "a duration is needed"),
    "dollars": (leaves(10, "fail: " + "$a" * 4500), "no node writes a key"),
    "expression": (HEAD + "  condition: " + "(" * 4000 + "1" + ")" * 4000 + "\n", "expression"),
    "expressions": (leaves(10, "condition: " + "1 + " * 2400 + "1 > 2"), "expression"),
    "nots": (HEAD + "  condition: " + "not " * 2000 + "true\n", "expression"),
    "lines": ("\n" * 99_000, "the file is empty"),
    "comments": ("#\n" * 49_000, "the file is empty"),
    "open_quote": (HEAD + '  fail: "' + "a\n   " * 19_000, "not YAML"),
    "loops": (
        HEAD
        + "  "
        + "".join(f"{{retry: 2, attempt: a{n}, do: {{repeat: 3, do: " for n in range(20))
        + "{sequence: [{fail: $a1}, {wait: 1 s}]}"
        + "}}" * 20,
        "there is never a second round",
    ),
    "documents": (HEAD + "  wait: 1 s\n" + "---\na: 1\n" * 10_000, "a second document"),
    "utf16": (HEAD.encode("utf-16"), "UTF-16"),
    "latin1": (HEAD.encode() + "  fail: f\xfcr\n".encode("latin-1"), "byte 0xfc is not UTF-8"),
    "nul": (HEAD.encode() + b"  fail: a\x00b\n", "the character U+0000 is not allowed"),
    "escape": (HEAD.encode() + b"  fail: a\x1b[31mb\n", "the character U+001B is not allowed"),
    "separator": (HEAD + "  fail: a\u2028b\n", "the character U+2028 (line separator) is not allowed"),
    "tabs": (HEAD + "\tfail: x\n", "a tab in the indentation"),
    "empty": ("", "the file is empty"),
    "null": ("~\n", "the file is empty"),
    "word": ("hello\n", "a mission file must be a mapping"),
    "list": ("- a\n", "a mission file must be a mapping"),
}

MORE = ("nodes", "calls", "modifiers", "flow_list", "sections", "twins", "expressions", "numbers")
"""Those that cost much and are like another one."""

PROGRAM = """
import cProfile, json, re, resource, sys
from pathlib import Path
limit = int(sys.argv[1])
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
from florence_bt.app.mission_files.checking import CheckOptions, check_files

for file in sys.argv[2:]:
    profile = cProfile.Profile()
    report, errors = profile.runcall(check_files, [Path(file)])
    calls = sum(entry.callcount for entry in profile.getstats())
    print(json.dumps([Path(file).stem, errors, calls, len(report), report[:600]]), flush=True)
# Not ru_maxrss: that begins with the size of the process that started this one.
status = Path("/proc/self/status").read_text()
print(json.dumps({name: int(kib) for name, kib in re.findall(r"(VmHWM|VmPeak):\\s+(\\d+) kB", status)}))
"""


def written(folder, names):
    files = []
    for name in names:
        content, _ = HOSTILE[name]
        files.append(folder / f"{name}.yaml")
        data = content.encode() if isinstance(content, str) else content
        files[-1].write_bytes(data.replace(b"{name}", name.encode()))
    return files


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile")
    files = written(folder, [name for name in HOSTILE if name not in MORE])
    huge = folder / "huge.yaml"
    with huge.open("wb") as stream:
        stream.truncate(100_000_000)
    os.mkfifo(folder / "pipe.yaml")
    (folder / "folder.yaml").mkdir()
    (folder / "folder.yaml" / "inside.yaml").write_text("- a\n")
    (folder / "device.yaml").symlink_to("/dev/zero")
    return check([*files, huge, folder / "pipe.yaml", folder / "device.yaml", folder / "folder.yaml"])


@pytest.fixture(scope="module")
def more_checked(tmp_path_factory):
    return check(written(tmp_path_factory.mktemp("more"), MORE))


def check(files):
    """Check files in a child process; gives errors, calls of functions and the report of each."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(MEMORY), *map(str, files)],
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    return {line[0]: line[1:] for line in lines[:-1]} | {"peak": lines[-1]}


@pytest.mark.parametrize(
    ("name", "child"),
    [(name, "checked") for name in HOSTILE if name not in MORE]
    + [pytest.param(name, "more_checked", marks=pytest.mark.sweep) for name in MORE],
)
def test_a_hostile_file_is_refused_with_little_work_and_clearly(request, name, child):
    errors, calls, length, report = request.getfixturevalue(child)[name]
    assert HOSTILE[name][1] in report, report
    assert errors or "warning" in report
    assert calls < MAX_CALLS
    assert length < 400_000
    assert "Traceback" not in report and "RecursionError" not in report


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("huge", "more than 100000 bytes"),
        ("pipe", "it is a pipe"),
        ("device", "it is a device"),
        ("folder", "a mission file must be a mapping"),
    ],
)
def test_what_is_no_file_is_refused(checked, name, problem):
    errors, calls, _, report = checked[name]
    assert errors and problem in report
    assert calls < MAX_CALLS


def test_all_together_stay_within_the_memory(checked):
    resident, addressed = (checked["peak"][name] * 1024 for name in ("VmHWM", "VmPeak"))
    assert 10_000_000 < resident < MEMORY, f"{resident / 1e6:.0f} MB resident"
    assert resident <= addressed <= MEMORY, f"{addressed / 1e6:.0f} MB of addresses"
