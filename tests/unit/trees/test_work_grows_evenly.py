"""Twice as large a file costs about twice the work, however it is made: counted in calls of functions."""

import cProfile

import pytest

from florence_bt.app.mission_files.checking import check_files
from tests.sweeps import sweep

SEQUENCE = "mission: m\ntree:\n  sequence:\n"


def checked(folder, files):
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text)
    return calls_of(check_files, [folder])


def calls_of(function, *arguments):
    profile = cProfile.Profile()
    profile.runcall(function, *arguments)
    return sum(entry.callcount for entry in profile.getstats())


def caller(name, *called):
    return f"mission: {name}\ntree:\n  sequence:\n" + "".join(f"    - run: {each}\n" for each in called)


def keys_misspelt(n):
    lines = [f"    - set: {{key_{i}: 1}}\n    - condition: $kye_{i} > 0\n" for i in range(n)]
    return {"m": SEQUENCE + "".join(lines)}


def keys_read_too_early(n):
    lines = [f"    - condition: $key_{i} > 0\n    - set: {{key_{i}: 1}}\n" for i in range(n)]
    return {"m": SEQUENCE + "".join(lines)}


def skills_misspelt(n):
    return {"m": SEQUENCE + "".join(f"    - trun_{i}: {{angle: 1 deg}}\n" for i in range(n))}


def chain(n):
    return {f"m{i}": caller(f"m{i}", f"m{i + 1}") for i in range(n)} | {
        f"m{n}": "mission: x\ntree: {wait: 1 s}\n"
    }


def ring(n):
    return {f"m{i}": caller(f"m{i}", f"m{(i + 1) % n}") for i in range(n)}


def valid(n):
    lines = [f"    - set: {{k{i}: 1}}\n    - condition: $k{i} == 1 or $k{i} > 3\n" for i in range(n)]
    return {"m": SEQUENCE + "".join(lines)}


def branches_that_wait(n):
    lines = [f"    - sequence: [{{wait_until: $k{i} == 1}}, {{set: {{k{i}: 1}}}}]\n" for i in range(n)]
    return {"m": "mission: m\ntree:\n  parallel:\n" + "".join(lines)}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "n"),
    sweep(
        [
            (keys_misspelt, 300),
            (keys_read_too_early, 300),
            (skills_misspelt, 300),
            (chain, 75),
            (ring, 75),
            (valid, 150),
            (branches_that_wait, 150),
        ],
        every=3,
    ),
)
def test_checking(tmp_path, shape, n):
    folders = [tmp_path / name for name in ("first", "small", "large")]
    for folder in folders:
        folder.mkdir()
    checked(folders.pop(0), shape(2))  # which also reads what is read once in a process
    small, large = (checked(folder, shape(size)) for folder, size in zip(folders, (n, 2 * n), strict=True))
    assert large < 2.6 * small
