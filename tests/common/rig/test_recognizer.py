"""The [recognizer] table: meaning for each method, search path of models, rejected values."""

from pathlib import Path

import pytest

from tests.common.rig.test_rig import RIG, write_rig
from zenocap.common.errors import UserError
from zenocap.common.rig import recognizer as recognizer_table
from zenocap.common.rig.recognizer import RecognizerSpec, find_postures
from zenocap.common.rig.rig import load_rig
from zenocap.services.recognizer.segmentation import STRICTNESS

HYBRID = RIG.replace('"two-view"', '"hybrid"')


@pytest.fixture(autouse=True)
def shipped(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two built-in models."""
    folder = tmp_path_factory.mktemp("postures")
    for name in ("fifteen", "sports"):
        (folder / f"{name}.postures").write_bytes(b"")
    monkeypatch.setattr(recognizer_table, "POSTURES", folder)
    return folder


def test_there_is_no_recognizer_without_a_table(tmp_path: Path) -> None:
    assert load_rig(write_rig(tmp_path, RIG)).recognizer is None


@pytest.mark.parametrize(("rig", "source"), [(RIG, "integrator"), (HYBRID, "tracker")])
def test_an_empty_table_uses_the_default_model_and_the_pose_source_of_the_method(
    tmp_path: Path, shipped: Path, rig: str, source: str
) -> None:
    spec = load_rig(write_rig(tmp_path, rig + "\n[recognizer]\n")).recognizer
    assert spec == RecognizerSpec(shipped / "fifteen.postures", source, STRICTNESS)


def test_a_table_is_read(tmp_path: Path) -> None:
    (tmp_path / "mine.postures").write_bytes(b"")
    table = '\n[recognizer]\nmodel = "mine.postures"\nsource = "integrator"\nstrictness = 0.5\n'
    spec = load_rig(write_rig(tmp_path, RIG + table)).recognizer
    assert spec == RecognizerSpec(tmp_path / "mine.postures", "integrator", 0.5)


def test_a_model_is_found_by_name_or_by_path(tmp_path: Path, shipped: Path) -> None:
    (tmp_path / "sports").write_bytes(b"")
    assert find_postures("sports", tmp_path) == shipped / "sports.postures"
    assert find_postures("./sports", tmp_path) == tmp_path / "sports"


def test_a_model_may_be_on_another_machine(tmp_path: Path) -> None:
    path = write_rig(tmp_path, RIG + '\n[recognizer]\nmodel = "mine.postures"\n')
    assert load_rig(path, files=False).recognizer.model == tmp_path / "mine.postures"
    with pytest.raises(UserError, match=r"recognizer\.model = 'mine\.postures': no file .*, or a name of: fifteen, sports"):
        load_rig(path)


@pytest.mark.parametrize(
    ("rig", "line", "text"),
    [
        (RIG, 'source = "tracker"', "recognizer.source = 'tracker': allowed: 'integrator', .* of method 'two-view'"),
        (HYBRID, 'source = "integrator"', "recognizer.source = 'integrator': allowed: 'tracker', .* of method 'hybrid'"),
        (RIG, 'modle = "fifteen"', "recognizer.modle = 'fifteen': no such key; .*did you mean 'model'"),
        (RIG, "strictness = -1", "recognizer.strictness = -1: allowed: float >= 0"),
        (RIG, "model = 15", "recognizer.model = 15: allowed: str"),
    ],
)  # fmt: skip
def test_every_error_names_file_key_value_and_what_is_allowed(tmp_path: Path, rig: str, line: str, text: str) -> None:
    path = write_rig(tmp_path, f"{rig}\n[recognizer]\n{line}\n")
    with pytest.raises(UserError, match=text) as caught:
        load_rig(path)
    assert str(caught.value).startswith(str(path))
