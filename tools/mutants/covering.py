"""Which tests run a line: measured by coverage.py, with a context for each test, and kept.

A file of tests is measured again when it, the code, or what tests share has changed.
"""

from __future__ import annotations

import ast
import hashlib
import subprocess
import sys
from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from functools import cached_property
from pathlib import Path

from coverage import CoverageData

from tools.tables import BUILD, ROOT, git

QUICK = ("-m", "not slow and not sweep")
WITHOUT_ROS = ("tests/unit/*test_*.py", "tests/emulators/*test_*.py", "packages/*test_*.py")
OVER_ROS = "tests/ros/"
"""Where the tests of what imports rclpy lie."""
MOST = 400
"""Tests that are tried of a line; the ones that run little else come first."""


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

        Where none does (constants, compiled functions), those of its function, then of its module, then of
        the modules that import it.
        """
        contexts = self._contexts(path)
        for lines in (_statement(path, line), _function(path, line), contexts):
            tests = Counter(test for each in lines for test in contexts.get(each, ()))
            if tests:
                return self._specific_first(tests)
        above = [self._contexts(each) for each in importers([path], "florence_bt/*.py")]
        return self._specific_first(
            Counter(test for each in above for tests in each.values() for test in tests)
        )

    def _contexts(self, path: str) -> dict[int, list[str]]:
        """Return the ids of the tests that run each line of a module, by the line."""
        found: dict[int, list[str]] = {}
        for data, files in self._batches:
            for line, contexts in data.contexts_by_lineno(str(self._root / path)).items():
                tests = {context.partition("|")[0] for context in contexts}
                found.setdefault(line, []).extend(test for test in tests if _file_of(test) in files)
        return {line: tests for line, tests in found.items() if tests}

    def _specific_first(self, tests: Counter[str]) -> list[str]:
        """Return the tests that run little else first, those over ROS, which take long, at the end."""
        return sorted(tests, key=lambda test: (over_ros(test), -tests[test] / self._sizes[test], test))[:MOST]

    @cached_property
    def _sizes(self) -> Counter[str]:
        """How many lines of all modules each test runs."""
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


def measure(paths: Collection[str], workers: int) -> Covering:
    """Run with coverage.py the tests that import modules, directly or through one other module.

    What was measured before of the same code and the same tests is taken as it is.

    Raises:
        RuntimeError: A test fails without any change: its word would be worth nothing.
    """
    folder = BUILD / "mutants" / f"coverage-{_code_and_helpers()}"
    folder.mkdir(parents=True, exist_ok=True)
    wanted = {(file, _sha(ROOT / file)) for file in tests_near(paths)}
    known = {line for listed in folder.glob("*.files") for line in _read_list(listed)}
    new = sorted(file for file, _ in wanted - known)
    if new:
        _run(new, folder / f"{len(list(folder.glob('*.files')))}.data", workers)
    batches = [
        (listed.with_suffix(".data"), _read_list(listed) & wanted) for listed in folder.glob("*.files")
    ]
    return Covering([(data, {file for file, _ in files}) for data, files in batches], ROOT)


def _run(tests: Sequence[str], data: Path, workers: int) -> None:
    """Measure files of tests into a file, beside which they are listed when all is done."""
    settings = data.with_suffix(".ini")
    settings.write_text(f"[run]\ndata_file = {data}\n")
    command = [sys.executable, "-m", "pytest", "-q", "-n", str(workers), "--dist", "loadgroup", *QUICK]
    options = ["--cov=florence_bt", "--cov-context=test", "--cov-report=", f"--cov-config={settings}"]
    listed = "".join(f"{file} {_sha(ROOT / file)}\n" for file in tests)
    done = subprocess.run([*command, *options, *tests], cwd=ROOT, stdout=sys.stderr, check=False)
    if done.returncode:
        raise RuntimeError("tests fail without any mutation: mend them first")
    data.with_suffix(".files").write_text(listed)


def _read_list(listed: Path) -> set[tuple[str, str]]:
    """Return the files of tests that were measured together, each with the sum of its content."""
    return {(file, sha) for file, _, sha in (line.partition(" ") for line in listed.read_text().splitlines())}


def _code_and_helpers() -> str:
    """Return a sum of all on which it depends which lines a test runs, but for the tests themselves."""
    files = git("ls-files", "florence_bt", "tests", "packages").splitlines()
    helpers = [file for file in files if not Path(file).name.startswith("test_") and (ROOT / file).is_file()]
    return hashlib.sha256("".join(_sha(ROOT / file) for file in helpers).encode()).hexdigest()[:12]


def _sha(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def tests_near(paths: Collection[str]) -> list[str]:
    """Return the files of tests that import one of the modules, or a module that imports one of them.

    Those over ROS are among them for modules that import rclpy: what they do nobody can test without.
    """
    nodes = [path for path in paths if _imports_rclpy(path)]
    return [*importers(_near(paths), *WITHOUT_ROS), *importers(_near(nodes), f"{OVER_ROS}*test_*.py")]


def over_ros(test: str) -> bool:
    """Tell whether a test, by its id, needs ROS."""
    return test.startswith(OVER_ROS)


def _near(paths: Collection[str]) -> set[str]:
    packages = {str(Path(path).parent / "__init__.py") for path in paths if Path(path).name.startswith("_")}
    return {*paths, *packages, *importers({*paths, *packages}, "florence_bt/*.py")}


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
