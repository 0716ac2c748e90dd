"""The example of a package works as its README says: it is installed, checked, tested and run."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[3] / "examples" / "florence_greeter"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """A copy of the package, and an environment in which it is installed."""
    home = tmp_path_factory.mktemp("package")
    source, site = home / "source", home / "site"
    shutil.copytree(EXAMPLE, source)
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*pip, "--target", str(site), str(source)], check=True, timeout=300)
    path = os.pathsep.join([str(site), str(EXAMPLE.parents[1])])
    return source, {**os.environ, "PYTHONPATH": path, "COLUMNS": "200"}


def florence(package, *words):
    source, environment = package
    done = subprocess.run(
        [sys.executable, "-m", "florence_bt.cli", *words],
        cwd=source,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    return done.returncode, done.stdout + done.stderr


def test_the_mission_is_there(package):
    code, text = florence(package, "missions")
    assert code == 0 and "welcome_user" in text and "package" not in text


def test_the_check_knows_the_skill(package):
    assert florence(package, "check", "florence_greeter/missions/welcome_user.yaml", "--strict")[0] == 0
    mission = package[0] / "wrong.yaml"
    mission.write_text("mission: wrong\ntree: {greet_user: {nam: Ana}}\n")
    code, text = florence(package, "check", "wrong.yaml")
    assert code == 1 and "greet_user has no input 'nam'" in text and "would have worked: name" in text


def test_its_scenarios_pass(package):
    code, text = florence(package, "test", "scenarios")
    assert code == 0 and "5 passed" in text


def test_its_own_tests_pass(package):
    source, environment = package
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"]
    done = subprocess.run(command, cwd=source, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "5 passed" in done.stdout, done.stdout
