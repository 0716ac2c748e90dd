"""Tests of each line: measured by coverage.py, with a context for each test, and kept.

A file of tests is measured again when it, the code, or what tests share has changed.
"""

from __future__ import annotations

import ast
import hashlib
import math
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from functools import cached_property
from pathlib import Path

from coverage import CoverageData

from tools.tables import BUILD, ROOT, git

QUICK = ("-m", "not slow and not sweep")
WITHOUT_ROS = ("tests/unit/*test_*.py", "tests/emulators/*test_*.py", "packages/*test_*.py")
OVER_ROS = "tests/ros/*test_*.py"
"""The tests of what imports rclpy."""
MOST = 400
"""Tests that are tried of a line; the ones that run little else come first."""
MOST_THAT_IMPORT = 6
"""Files of tests that are tried whole of a line that none of them is seen to run."""
MOST_OVER_ROS = 3
"""Files of tests over ROS that are tried of a module."""


class Covering:
    """Knows the tests of each line.

    Args:
        batches: Data of coverage.py, measured with ``--cov-context=test``, and the files whose tests count.
        root: Where the modules were when it was measured.
    """

    def __init__(self, batches: Iterable[tuple[Path, Collection[str]]], root: Path) -> None:
        self._batches = [(CoverageData(str(file)), files) for file, files in batches]
        for data, _ in self._batches:
            data.read()
        self._root = root

    def tests_of(self, path: str, line: int) -> list[str]:
        """Return ids of the tests that run a line of a module.

        Where none does (constants, compiled functions), those of its function; then some files that import
        its module, and the tests that run others of its lines or else the modules that import it.
        """
        contexts = self._contexts(path)
        for lines in (_statement(path, line), _function(path, line)):
            tests = Counter(test for each in lines for test in contexts.get(each, ()))
            if tests:
                return self._specific_first(tests)
        above = [contexts] if contexts else map(self._contexts, importers([path], "florence_bt/*.py"))
        around = Counter(test for each in above for tests in each.values() for test in tests)
        files = files_that_import(path)
        return [*files, *(test for test in self._specific_first(around) if _file_of(test) not in files)]

    def _contexts(self, path: str) -> dict[int, list[str]]:
        """Return the ids of the tests that run each line of a module, by the line."""
        found: dict[int, list[str]] = {}
        for data, files in self._batches:
            for line, contexts in data.contexts_by_lineno(str(self._root / path)).items():
                tests = {context.partition("|")[0] for context in contexts}
                found.setdefault(line, []).extend(test for test in tests if _file_of(test) in files)
        return {line: tests for line, tests in found.items() if tests}

    def _specific_first(self, tests: Counter[str]) -> list[str]:
        return sorted(tests, key=lambda test: (-tests[test] / self._sizes[test], test))[:MOST]

    @cached_property
    def _sizes(self) -> Counter[str]:
        """Count the lines of all modules that each test runs."""
        sizes: Counter[str] = Counter()
        for path in {
            str(Path(file).relative_to(self._root))
            for data, _ in self._batches
            for file in data.measured_files()
        }:
            for tests in self._contexts(path).values():
                sizes.update(set(tests))
        return sizes


def _file_of(test: str) -> str:
    return test.partition("::")[0]


def measure(paths: Collection[str], workers: int, until: float = math.inf) -> Covering:
    """Run with coverage.py the tests that import modules, directly or through one other module.

    What was measured before of the same code and the same tests is taken as it is.

    Args:
        paths: The modules.
        workers: Processes.
        until: Begin no tests after this moment of ``time.monotonic``; the nearest ones are measured first.

    Raises:
        RuntimeError: A test fails without any change: its word would be worth nothing.
    """
    folder = BUILD / "mutants" / f"coverage-{_code_and_helpers()}"
    folder.mkdir(parents=True, exist_ok=True)
    near = tests_near(paths)
    wanted = {(file, _sha(ROOT / file)) for file in near}
    known = {line for listed in folder.glob("*.files") for line in _read_list(listed)}
    new = [file for file in near if (file, _sha(ROOT / file)) not in known]
    size = len(new) if until == math.inf else TOGETHER
    while new and time.monotonic() < until:
        some, new = new[:size], new[size:]
        _run(some, folder / f"{len(list(folder.glob('*.files')))}.data", workers)
    if new:
        print(f"{len(new)} of {len(near)} files of tests were left out: the time was over", file=sys.stderr)
    batches = [
        (listed.with_suffix(".data"), _read_list(listed) & wanted) for listed in folder.glob("*.files")
    ]
    return Covering([(data, {file for file, _ in files}) for data, files in batches], ROOT)


TOGETHER = 12
"""So many files of tests are measured at a time when the time is limited."""


def _run(tests: Sequence[str], data: Path, workers: int) -> None:
    """Measure files of tests into a file, beside which they are listed when all is done."""
    settings = data.with_suffix(".ini")
    settings.write_text(f"[run]\ndata_file = {data}\n")
    command = [sys.executable, "-m", "pytest", "-q", "-n", str(workers), "--dist", "loadgroup", *QUICK]
    options = ["--cov=florence_bt", "--cov-context=test", "--cov-report=", f"--cov-config={settings}"]
    listed = "".join(f"{file} {_sha(ROOT / file)}\n" for file in tests)
    done = subprocess.run([*command, *options, *sorted(tests)], cwd=ROOT, stdout=sys.stderr, check=False)
    if done.returncode:
        raise RuntimeError("tests fail without any mutation: mend them first")
    data.with_suffix(".files").write_text(listed)


def _read_list(listed: Path) -> set[tuple[str, str]]:
    """Return the files of tests that were measured together, each with the sum of its content."""
    return {(file, sha) for file, _, sha in (line.partition(" ") for line in listed.read_text().splitlines())}


def _code_and_helpers() -> str:
    """Return a sum of all on which it depends which lines a test runs, but for the tests themselves."""
    return _sum(file for file in _code_and_tests() if not Path(file).name.startswith("test_"))


def sum_of_code_and_tests() -> str:
    """Return a sum of all on which it depends whether a test fails."""
    return _sum(_code_and_tests())


def _code_and_tests() -> list[str]:
    files = git("ls-files", "florence_bt", "tests", "packages", ":!tests/equivalent_mutants.yaml")
    return [file for file in files.splitlines() if (ROOT / file).is_file()]


def _sum(files: Iterable[str]) -> str:
    return hashlib.sha256("".join(_sha(ROOT / file) for file in files).encode()).hexdigest()[:12]


def _sha(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def tests_near(paths: Collection[str]) -> list[str]:
    """Return the files of tests that import one of the modules, then of a module that imports one of them."""
    return list(
        dict.fromkeys(file for near in (paths, _near(paths)) for file in importers(near, *WITHOUT_ROS))
    )


def files_that_import(path: str) -> list[str]:
    """Return the files of tests that import a module, those that import little else first."""
    found = importers([path], *WITHOUT_ROS)
    return sorted(found, key=lambda file: (len(_imports(file)), file))[:MOST_THAT_IMPORT]


def files_over_ros(path: str) -> list[str]:
    """Return the files of tests over ROS of a module that imports rclpy, those that import little else first.

    What such a module does nobody can test without ROS. Which lines these tests run is not measured: they
    wait most of their time.
    """
    if not _imports_rclpy(path):
        return []
    levels = ([path], [path, *_package_of(path)], _near([path]))
    found = next(filter(None, (importers(level, OVER_ROS) for level in levels)), [])
    return sorted(found, key=lambda file: (len(_imports(file)), file))[:MOST_OVER_ROS]


def _near(paths: Collection[str]) -> set[str]:
    with_packages = {*paths, *(each for path in paths for each in _package_of(path))}
    return with_packages | set(importers(with_packages, "florence_bt/*.py"))


def _package_of(path: str) -> list[str]:
    """Return the package of a private module, by which others import what is in it."""
    return [str(Path(path).parent / "__init__.py")] if Path(path).name.startswith("_") else []


def _imports_rclpy(path: str) -> bool:
    """Tell whether a module lies where rclpy may be imported (the contracts of ``pyproject.toml``)."""
    parts = Path(path).with_suffix("").parts
    return "node" in parts or parts[1:2] in (("ros",), ("app",))


def importers(paths: Collection[str], *where: str) -> list[str]:
    """Return the files that import one of some modules."""
    modules = {_module(path) for path in paths}
    words = [word for name in modules for word in ("-e", name.rpartition(".")[2])]
    mentioned = git("grep", "-l", "-w", "-F", *words, "--", *where).splitlines() if words else []
    return [each for each in mentioned if each not in paths and _imports(each) & modules]


def _module(path: str) -> str:
    return path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def _imports(path: str) -> set[str]:
    """Return the modules that a file imports, and the names in them: either may be a module."""
    found: set[str] = set()
    for node in ast.walk(ast.parse((ROOT / path).read_text())):
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{each.name}" for each in node.names)}
    return found


def _statement(path: str, line: int) -> Iterable[int]:
    """Return the lines of the smallest statement around a line."""
    nodes = [node for node in _nodes(path, line) if isinstance(node, ast.stmt)]
    small = [node for node in nodes if not hasattr(node, "body")]
    return range(small[-1].lineno, (small[-1].end_lineno or 0) + 1) if small else (line,)


def _function(path: str, line: int) -> Iterable[int]:
    nodes = [node for node in _nodes(path, line) if isinstance(node, ast.FunctionDef)]
    return range(nodes[-1].body[0].lineno, (nodes[-1].end_lineno or 0) + 1) if nodes else ()


def _nodes(path: str, line: int) -> list[ast.AST]:
    """Return the nodes around a line, the outer ones first."""
    tree = ast.parse((ROOT / path).read_text())
    return [
        node
        for node in ast.walk(tree)
        if hasattr(node, "lineno") and node.lineno <= line <= (node.end_lineno or node.lineno)
    ]
