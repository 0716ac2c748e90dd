"""The check that all kernels are compiled, on a package of its own; two small functions are compiled here."""

import json
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import version
from pathlib import Path

import pytest

from florence_bt.app.bringup.parent import child_command
from florence_bt.app.demo import kernel_cache
from florence_bt.app.demo.kernel_cache import (
    MESSAGE,
    PACKAGE,
    STAMP,
    ensure_compiled,
    is_compiled,
    kernel_modules,
    mark_compiled,
    stamp_folders,
)
from florence_bt.core.errors import FlorenceError


@pytest.fixture(autouse=True)
def folders(monkeypatch, tmp_path):
    """The environment of a user who has chosen nothing, with a cache folder of the test's own."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.delenv("NUMBA_DISABLE_JIT", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.fixture
def package(tmp_path) -> Path:
    """A package with one kernel module, which numba has compiled."""
    package = tmp_path / "package"
    (package / "skill" / "__pycache__").mkdir(parents=True)
    (package / "skill" / "_wave_kernels.py").write_text("spread = 1\n")
    (package / "skill" / "other.py").write_text("other = 1\n")
    index_of(package).write_text("index")
    mark_compiled([str(index_of(package))], package)
    return package


def index_of(package: Path) -> Path:
    return package / "skill" / "__pycache__" / "_wave_kernels.spread-1.py311.nbi"


def test_compiled_code_is_found_beside_the_package(package):
    assert is_compiled(package)
    assert (package / "__pycache__" / STAMP).is_file()


def test_nothing_is_compiled_in_a_fresh_checkout(tmp_path):
    (tmp_path / "_kernels.py").write_text("")
    assert not is_compiled(tmp_path)


def test_a_changed_kernel_must_be_compiled_and_another_module_need_not(package):
    (package / "skill" / "other.py").write_text("other = 2\n")
    assert is_compiled(package)
    (package / "skill" / "_wave_kernels.py").write_text("spread = 2\n")
    assert not is_compiled(package)
    (package / "skill" / "_wave_kernels.py").write_text("spread = 1\n")
    assert is_compiled(package)


def test_a_new_kernel_module_must_be_compiled(package):
    (package / "_kernels.py").write_text("")
    assert not is_compiled(package)


def test_removed_code_must_be_compiled_again(package):
    index_of(package).unlink()
    assert not is_compiled(package)


@pytest.mark.parametrize("text", ["", "[]", '{"made_from": 1}', "\x00"])
def test_a_damaged_stamp_is_as_good_as_none(package, text):
    (package / "__pycache__" / STAMP).write_text(text)
    assert not is_compiled(package)


def test_another_numba_or_processor_needs_other_code(package, monkeypatch):
    monkeypatch.setattr(kernel_cache, "version", lambda name: version(name) + ".1")
    assert not is_compiled(package)
    monkeypatch.undo()
    monkeypatch.setattr(kernel_cache, "_instructions", lambda: "flags: other")
    assert not is_compiled(package)


def test_numbas_own_folder_holds_the_stamp_and_no_other_counts(package, monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert not is_compiled(package)
    mark_compiled([str(index_of(package))], package)
    assert is_compiled(package)
    assert [file.name for file in (tmp_path / "numba").rglob("*.json")] == [STAMP]


def test_two_checkouts_share_a_numba_folder(package, monkeypatch, tmp_path):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert {*stamp_folders(package)}.isdisjoint(stamp_folders(tmp_path / "second"))


def test_a_package_that_cannot_be_written_has_its_stamp_in_the_users_cache(tmp_path):
    package = tmp_path / "package"
    package.mkdir()
    (package / "_kernels.py").write_text("")
    (package / "__pycache__").write_text("a file, so that nobody can make the folder, not even root")
    mark_compiled([], package)
    assert is_compiled(package)
    assert [file.name for file in (tmp_path / "cache" / "numba").rglob("*.json")] == [STAMP]


def test_without_compiler_nothing_has_to_be_compiled(tmp_path, monkeypatch):
    (tmp_path / "_kernels.py").write_text("")
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert is_compiled(tmp_path)


def test_compiling_is_announced_and_happens_in_a_child_process(tmp_path, monkeypatch):
    said, called = [], []

    def run(command, **_):
        called.append((command, list(said)))
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(subprocess, "run", run)
    ensure_compiled(said.append, tmp_path)
    assert called == [(child_command("florence_bt.app.demo.warm_up"), [MESSAGE])]
    assert said == [MESSAGE]


def test_what_is_compiled_costs_no_process_and_no_word(package, monkeypatch):
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("a process was started"))
    ensure_compiled(pytest.fail, package)


def test_a_computer_that_cannot_compile_says_why_and_goes_on(tmp_path, monkeypatch):
    done = subprocess.CompletedProcess(
        [], 1, "", "Traceback\nModuleNotFoundError: No module named 'mujoco'\n"
    )
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: done)
    said = []
    ensure_compiled(said.append, tmp_path)
    assert said[0] == MESSAGE
    assert "first drive may stop for seconds" in said[1]
    assert said[1].endswith("No module named 'mujoco'")


def test_every_function_that_numba_compiles_is_in_a_kernel_module():
    decorated = [file for file in PACKAGE.rglob("*.py") if "njit(" in file.read_text(encoding="utf-8")]
    assert kernel_modules() == sorted(decorated)


def test_the_check_loads_neither_numba_nor_numpy():
    code = (
        "import sys; from florence_bt.app.demo.kernel_cache import is_compiled; is_compiled();"
        "print([name for name in ('numba', 'numpy', 'scipy') if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ}
    )
    assert done.stdout.strip() == "[]"


def test_the_stamp_names_what_it_was_made_from(package):
    stamp = json.loads((package / "__pycache__" / STAMP).read_text())
    assert stamp["files"] == [str(index_of(package))]


def test_a_kernel_that_the_warm_up_did_not_call_is_named(tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    from florence_bt.app.demo import warm_up

    folder = tmp_path / "some_loops"
    folder.mkdir()
    (folder / "__init__.py").touch()
    file = folder / "_some_kernels.py"
    file.write_text(
        "from numba import njit\n\n\n@njit(cache=True)\ndef double(x):\n    return 2 * x\n\n\n"
        "@njit(cache=True)\ndef halve(x):\n    return x // 2\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(warm_up, "PACKAGE", folder)
    monkeypatch.setattr(warm_up, "kernel_modules", lambda: [file])
    from some_loops import _some_kernels  # type: ignore[import-not-found]

    assert _some_kernels.double(2) == 4
    with pytest.raises(FlorenceError, match=r"some_loops\._some_kernels\.halve was not compiled"):
        warm_up.compiled_files()
    assert _some_kernels.halve(4) == 2
    assert len(warm_up.compiled_files()) == 2


@pytest.fixture
def warm_up(monkeypatch):
    pytest.importorskip("mujoco")
    from numba.core.caching import IndexDataCacheFile

    from florence_bt.app.demo import warm_up

    for name in ("load", "save"):  # what it changes there is taken back
        monkeypatch.setattr(IndexDataCacheFile, name, getattr(IndexDataCacheFile, name))
    return warm_up


def test_processes_that_compile_beside_each_other_lose_nothing(warm_up, tmp_path):
    from numba.core.caching import IndexDataCacheFile

    warm_up._share_the_cache()
    caches = [IndexDataCacheFile(str(tmp_path), "spread", "stamp") for _ in range(2)]
    keys = [[f"signature {number} of {who}" for number in range(30)] for who in range(2)]
    together = threading.Barrier(2)

    def compile_all(who: int) -> None:
        together.wait(30.0)
        for key in keys[who]:
            caches[who].save(key, f"code of {key}")

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(compile_all, range(2)))
    for key in (*keys[0], *keys[1]):
        assert caches[0].load(key) == f"code of {key}"


@pytest.mark.parametrize(("cores", "in_this_process"), [({0}, ["rest", "mission"]), ({0, 1}, ["mission"])])
def test_a_second_core_compiles_the_rest(warm_up, tmp_path, monkeypatch, cores, in_this_process):
    done: list[str] = []
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: cores)
    monkeypatch.setattr(warm_up, "_run_mission", lambda: done.append("mission"))
    monkeypatch.setattr(warm_up, "_warm_up_rest", lambda: done.append("rest"))
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\necho "$@" > {tmp_path}/beside\n')
    python.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    warm_up.warm_up()
    assert done == in_this_process
    if len(cores) > 1:
        told = (tmp_path / "beside").read_text().split()
        assert told == child_command("florence_bt.app.demo.warm_up", "rest")[1:]


def test_why_the_second_process_failed_is_told(warm_up, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    monkeypatch.setattr(warm_up, "_run_mission", lambda: None)
    python = tmp_path / "python"
    python.write_text('#!/bin/sh\necho Traceback >&2\necho "OSError: no space left" >&2\nexit 1\n')
    python.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    with pytest.raises(FlorenceError, match=r"^OSError: no space left$"):
        warm_up.warm_up()
