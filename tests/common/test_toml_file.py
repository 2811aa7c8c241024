"""TOML files that are small and costly to parse are refused in one line."""

from pathlib import Path

import pytest

from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.errors import UserError
from zenocap.common.toml_file import read_toml
from zenocap.tools.setup.calibration.lines_file import read_measurements

COSTLY = {
    "nested": ("a = " + "[" * 5000 + "]" * 5000, "too deeply nested"),
    "dotted": (".".join("a" * 5000) + " = 1", "4999 dots: allowed: up to 64 in a key"),
    "dotted inline table": ("a = {" + ".".join("a" * 5000) + " = 1}", "4999 dots: allowed: up to 64 in a key"),
    "quoted parts": (".".join(['"a,="'] * 5000) + " = 1", "dots: allowed: up to 64 in a key"),
    "large": ("#" * (1 << 20) + "\n", "1048577 bytes: allowed: up to 1048576"),
}


@pytest.mark.parametrize("read", [read_toml, read_calibration, read_measurements])
@pytest.mark.parametrize(("text", "reason"), COSTLY.values(), ids=COSTLY)
def test_costly_files_are_refused(tmp_path: Path, read, text: str, reason: str) -> None:
    path = tmp_path / "costly.toml"
    path.write_text(text)
    with pytest.raises(UserError, match=reason) as raised:
        read(path)
    assert str(raised.value).startswith(f"{path}: ")
    assert len(str(raised.value)) < 400


def test_many_numbers_in_a_line_are_no_dotted_key(tmp_path: Path) -> None:
    path = tmp_path / "numbers.toml"
    path.write_text("numbers = [" + "0.5, " * 500 + "]")
    assert len(read_toml(path)["numbers"]) == 500
