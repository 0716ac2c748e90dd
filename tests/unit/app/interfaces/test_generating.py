"""The sources of interface packages: one process writes what each generator of ROS writes alone."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rosidl_generator_py")

from florence_bt.app.interfaces import building, generating

FILES = {
    "msg/Finger.msg": "# Pressed.\nfloat64 force 0.5\nstring<=8 name\ngeometry_msgs/Point[] path\n",
    "srv/Open.srv": "Finger[2] fingers\n---\nbool opened\nstring reason\n",
    "action/Grip.action": "Finger finger\n---\nbool held\n---\nfloat32 done\n",
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("generated")
    for name, text in FILES.items():
        (folder / "source" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "source" / name).write_text(text)
    run(str(Path(generating.__file__)), str(folder), "hand_msgs", sys.prefix, *FILES)
    return folder


def run(*words: str) -> None:
    """Run Python with the same order of sets every time."""
    done = subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, env={"PYTHONHASHSEED": "0"}, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("generator", generating.LIBRARIES)
def test_each_generator_alone_writes_the_same(written, tmp_path, generator):
    told = json.loads((written / f"{generator}.json").read_text())
    (tmp_path / "alone.json").write_text(json.dumps(told | {"output_dir": str(tmp_path / "alone")}))
    (tmp_path / "alone").mkdir()
    program = Path(sys.prefix) / "lib" / generator / generator
    options = {
        generating.DISPATCH: ["--typesupports", generating.FAST_DDS, generating.INTROSPECTION],
        generating.PYTHON: ["--typesupport-impls", generating.DISPATCH],
    }
    run(
        str(program),
        "--generator-arguments-file",
        str(tmp_path / "alone.json"),
        *options.get(generator, []),
    )
    alone = {str(file.relative_to(tmp_path / "alone")) for file in (tmp_path / "alone").rglob("*.*")}
    assert len(alone) >= len(FILES)
    for file in alone:
        assert (written / generator / "hand_msgs" / file).read_text() == (
            tmp_path / "alone" / file
        ).read_text()


def test_all_sources_of_a_library_are_in_one_file(written):
    assert set(generating.LIBRARIES) == set(building.LINKED_WITH)
    for generator, suffix in generating.LIBRARIES.items():
        included = (written / f"{generator}{suffix}").read_text().count("#include")
        sources = [
            file
            for file in (written / generator / "hand_msgs").rglob(f"*{suffix}")
            if ".ep." not in file.name
        ]
        assert included == len(sources) >= len(FILES), generator
