"""The [recognizer] table: what it means by the rig's method, where models are found, and what is refused."""

from pathlib import Path

import pytest
from test_rig import RIG, write_rig

from common.runtime import recognizer_table
from common.runtime.recognizer_table import RecognizerSpec, find_postures
from common.runtime.rig import RigError, load_rig
from services.recognizer.spotting import STRICTNESS

HYBRID = RIG.replace('"two-view"', '"hybrid"')


@pytest.fixture(autouse=True)
def shipped(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two models that come with the project."""
    folder = tmp_path_factory.mktemp("postures")
    for name in ("fifteen", "sports"):
        (folder / f"{name}.postures").write_bytes(b"")
    monkeypatch.setattr(recognizer_table, "POSTURES", folder)
    return folder


def test_without_a_table_there_is_none(tmp_path: Path) -> None:
    assert load_rig(write_rig(tmp_path, RIG)).recognizer is None


@pytest.mark.parametrize(("rig", "source"), [(RIG, "integrator"), (HYBRID, "tracker")])
def test_an_empty_table_means_the_fifteen_and_who_finds_the_poses(
    tmp_path: Path, shipped: Path, rig: str, source: str
) -> None:
    spec = load_rig(write_rig(tmp_path, rig + "\n[recognizer]\n")).recognizer
    assert spec is not None
    assert (spec.model, spec.source, spec.strictness) == (shipped / "fifteen.postures", source, STRICTNESS)


def test_a_table_is_read(tmp_path: Path) -> None:
    (tmp_path / "mine.postures").write_bytes(b"")
    table = '\n[recognizer]\nmodel = "mine.postures"\nsource = "integrator"\nstrictness = 0.5\n'
    spec = load_rig(write_rig(tmp_path, RIG + table)).recognizer
    assert spec == RecognizerSpec(tmp_path / "mine.postures", "integrator", 0.5)


def test_a_model_is_a_file_of_the_rig_or_one_by_name(tmp_path: Path, shipped: Path) -> None:
    (tmp_path / "sports").write_bytes(b"")
    assert find_postures("sports", tmp_path) == shipped / "sports.postures"
    assert find_postures("./sports", tmp_path) == tmp_path / "sports"


def test_a_model_may_lie_on_another_machine(tmp_path: Path) -> None:
    path = write_rig(tmp_path, RIG + '\n[recognizer]\nmodel = "mine.postures"\n')
    spec = load_rig(path, files=False).recognizer
    assert spec is not None
    assert spec.model == tmp_path / "mine.postures"
    with pytest.raises(RigError, match=r"recognizer\.model = 'mine\.postures': no file .*, or a name of: fifteen, sports"):
        load_rig(path)


@pytest.mark.parametrize(
    ("rig", "line", "text"),
    [
        (RIG, 'source = "tracker"', "recognizer.source = 'tracker': allowed: 'integrator', .* by method 'two-view'"),
        (HYBRID, 'source = "integrator"', "recognizer.source = 'integrator': allowed: 'tracker', .* by method 'hybrid'"),
        (RIG, 'modle = "fifteen"', "recognizer.modle = 'fifteen': no such key; .*did you mean 'model'"),
        (RIG, "strictness = -1", "recognizer.strictness = -1: allowed: float >= 0"),
        (RIG, "model = 15", "recognizer.model = 15: allowed: str"),
    ],
)  # fmt: skip
def test_every_error_names_file_key_value_and_what_is_allowed(tmp_path: Path, rig: str, line: str, text: str) -> None:
    path = write_rig(tmp_path, f"{rig}\n[recognizer]\n{line}\n")
    with pytest.raises(RigError, match=text) as caught:
        load_rig(path)
    assert str(caught.value).startswith(str(path))
