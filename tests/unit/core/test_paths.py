"""Where the data of Florence is found: in a checkout, in a prefix, or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import find_data, share_folder


def test_in_a_checkout() -> None:
    assert (share_folder() / "pyproject.toml").is_file()
    assert find_data("maps", "flat.yaml").is_file()


def test_in_a_prefix(tmp_path: Path) -> None:
    package = tmp_path / "lib" / "python3.12" / "site-packages" / "florence_bt"
    (tmp_path / "share" / "florence_bt" / "maps").mkdir(parents=True)
    assert share_folder(package) == tmp_path / "share" / "florence_bt"


def test_nowhere(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as caught:
        share_folder(tmp_path / "florence_bt")
    assert str(tmp_path / "share" / "florence_bt") in str(caught.value)


def test_a_wrong_name_or_kind() -> None:
    with pytest.raises(ConfigError, match=r"'flat\.yml'.*flat\.yaml"):
        find_data("maps", "flat.yml")
    with pytest.raises(ConfigError, match="maps"):
        find_data("map", "flat.yaml")
