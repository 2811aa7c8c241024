"""Model files that are not shipped: added from a file or by pip, checked, listed, removed."""

import hashlib
import json
import os
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import zenocap
from tests.support.small_disk import small_disk
from zenocap.common.rig.detectors import DETECTORS, PEOPLE, SELFIE
from zenocap.common.rig.rig import demo_rig_file
from zenocap.services.viewer.people.network import load_network
from zenocap.tools.setup.models.wheel import INSIDE, LARGEST, download_command

pytestmark = pytest.mark.slow
CONTENT = b"a model" * 1000


@pytest.fixture(autouse=True)
def data_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The user's data folder is a new one, and the right model is CONTENT."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    row = replace(PEOPLE, files=(replace(SELFIE, sha256=hashlib.sha256(CONTENT).hexdigest()),))
    monkeypatch.setitem(DETECTORS._rows, "people", row)
    return tmp_path / "data"


def model_path() -> Path:
    return PEOPLE.folder / SELFIE.name


def written(folder: Path, content: bytes = CONTENT) -> tuple[Path, Path]:
    """A wheel and a model file."""
    model = folder / "selfie_segmentation.tflite"
    model.write_bytes(content)
    with zipfile.ZipFile(folder / "mediapipe-0.10.21-x.whl", "w") as wheel:
        wheel.writestr(INSIDE, content)
    return folder / "mediapipe-0.10.21-x.whl", model


@pytest.mark.parametrize("which", [0, 1])
def test_a_model_is_added_from_a_file_listed_and_removed(tmp_path: Path, which: int) -> None:
    assert "missing" in zenocap("models", "list")[1]
    status, text, _ = zenocap("models", "add", "people", "--from", written(tmp_path)[which])
    assert status == 0
    assert str(model_path()) in text
    assert model_path().read_bytes() == CONTENT
    assert "Apache" in model_path().with_name("LICENCE.txt").read_text()
    assert json.loads(zenocap("models", "list", "--json")[1])["models"][0]["state"] == "present"
    assert zenocap("models", "remove", "people")[0] == 0
    assert not model_path().parent.exists()
    assert "was not there" in zenocap("models", "remove", "people")[1]


def test_another_file_is_refused_and_the_old_one_stays(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    assert zenocap("models", "add", "people", "--from", written(tmp_path)[0])[0] == 0
    model_path().write_bytes(b"damaged")
    assert "damaged" in zenocap("models", "list")[1]
    for file in written(tmp_path / "other", b"another"):
        status, _, error = zenocap("models", "add", "people", "--from", file)
        assert status == 1
        assert error.startswith(f"error: {file}")
        assert "SHA-256" in error
    assert model_path().read_bytes() == b"damaged"


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    (tmp_path / "broken.whl").write_bytes(b"no zip")
    for name in ("missing.whl", "missing.tflite", "broken.whl", "model.onnx"):
        status, _, error = zenocap("models", "add", "people", "--from", tmp_path / name)
        assert status == 1
        assert name in error
        assert error.count("\n") == 1


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_false_wheel_is_one_error_and_nothing_is_kept(tmp_path: Path, method: int) -> None:
    """One with megabytes of zeros in kilobytes, and one that is damaged: lzma has an exception of its own."""
    path = tmp_path / "mediapipe-0.10.21-x.whl"
    with zipfile.ZipFile(path, "w", method) as wheel:
        wheel.writestr(INSIDE, bytes(3 * LARGEST))
    content = bytearray(path.read_bytes())
    for words in ("SHA-256", ""):
        status, _, error = zenocap("models", "add", "people", "--from", path)
        assert (status, error.count("\n")) == (1, 1)
        assert error.startswith(f"error: {path}: ")
        assert words in error
        assert not model_path().exists()
        begin = content.index(INSIDE.encode()) + len(INSIDE) + 12
        content[begin : begin + 40] = b"\xa5" * 40
        path.write_bytes(content)


@pytest.mark.nightly
def test_pip_without_an_index_is_one_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path))
    status, _, error = zenocap("models", "add", "people")
    assert status == 1
    assert error.count("\n") == 1
    assert "--from FILE" in error
    assert not model_path().exists()


@pytest.mark.core
def test_a_full_disk_is_one_error(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    _, model = written(tmp_path)
    with small_disk(tmp_path / "full", 4) as folder:
        monkeypatch.setenv("XDG_DATA_HOME", str(folder))
        status, _, error = zenocap("models", "add", "people", "--from", model)
        assert status == 1
        assert "No space left" in error
        assert not model_path().exists()


@pytest.mark.nightly
def test_the_real_model_finds_no_person_in_an_empty_picture(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.undo()
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "real"))
    probe = subprocess.run(download_command(tmp_path), capture_output=True, text=True)
    wheels = list(tmp_path.glob("*.whl"))
    if probe.returncode or not wheels:
        pytest.skip("pip fetches no wheel of mediapipe here")
    command = [sys.executable, "-m", "zenocap", "models", "add", "people", "--from", str(wheels[0])]
    subprocess.run(command, check=True)
    found = load_network()(np.full((300, 300, 3), 120, np.uint8))
    assert found.shape == (300, 300)
    assert 0.0 <= found.min() <= found.max() < 0.5


@pytest.mark.nightly
def test_without_a_route_nothing_is_fetched_and_each_command_gives_one_error(tmp_path: Path, data_folder: Path) -> None:
    isolated = ["unshare", "--net"]
    if subprocess.run([*isolated, "true"], capture_output=True).returncode:
        pytest.skip("network namespaces may not be made here")
    for arguments in (
        ["models", "add", "people"],
        ["track", str(demo_rig_file()), "--people", "-o", str(tmp_path / "a.mcap")],
    ):
        command = [*isolated, sys.executable, "-m", "zenocap", *arguments]
        environment = os.environ | {"PIP_RETRIES": "0", "XDG_DATA_HOME": str(data_folder)}
        done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tmp_path)
        assert done.returncode == 1
        errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
        assert len(errors) == 1
        assert ("--from FILE" if arguments[0] == "models" else "zenocap models add people") in errors[0]
    assert not list(tmp_path.rglob("*.tflite"))
