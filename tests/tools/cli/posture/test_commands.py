"""`zenocap posture train`, `evaluate` and `info`."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from tests.support.command import printed, refused, zenocap
from tests.support.places import MOTIONS
from tests.support.posture_cases import LABELS
from zenocap.common.errors import UserError
from zenocap.common.formats.joint_map import JointMap
from zenocap.services.recognizer.features import Kind
from zenocap.services.recognizer.model_file import read_model
from zenocap.services.recognizer.training import example_files
from zenocap.services.recognizer.training.example_files import Features
from zenocap.services.recognizer.training.manifest import ManifestRow
from zenocap.tools.cli.posture import tracked_sources
from zenocap.tools.cli.posture.tracked_sources import take_name, with_takes

FEW = ("--symbols", 24)  # symbols: trained quickly


def rows_of(text: str) -> dict[str, list[str]]:
    """Words of each line by the first one."""
    return {line.split()[0]: line.split() for line in text.splitlines() if line.strip()}


@pytest.fixture
def trained(manifest: Path, tmp_path: Path) -> Path:
    """A model of the manifest."""
    printed("posture", "train", manifest, "-o", tmp_path / "mine.postures", *FEW)
    return tmp_path / "mine.postures"


@pytest.mark.slow
def test_train_writes_a_model_and_info_prints_the_same_summary(manifest: Path, tmp_path: Path) -> None:
    out = tmp_path / "mine.postures"
    status, output, _ = zenocap("posture", "train", manifest, "-o", out, "--json", *FEW)
    assert (status, json.loads(output)["labels"]) == (0, list(LABELS))
    assert read_model(out).training.people == ("1", "2", "3")
    assert json.loads(printed("posture", "info", out, "--json")) == json.loads(output)
    rows = rows_of(printed("posture", "info", out))
    assert [rows[label][1:3] for label in LABELS] == [["6", "3"]] * 3


@pytest.mark.nightly
def test_the_same_manifest_gives_the_same_bytes(manifest: Path, trained: Path, tmp_path: Path) -> None:
    printed("posture", "train", manifest, "-o", tmp_path / "other.postures", *FEW)
    assert (tmp_path / "other.postures").read_bytes() == trained.read_bytes()


@pytest.mark.nightly
def test_training_options_are_applied(manifest: Path, tmp_path: Path) -> None:
    out = tmp_path / "mine.postures"
    options = "--symbols 20 --states 3 --topology ergodic --scale none --rate 30 --features joint-angles --seed 4"
    printed("posture", "train", manifest, "-o", out, *options.split())
    model = read_model(out)
    assert (model.symbols, model.states, model.rate, model.features) == (20, 3, 30.0, "joint-angles")
    assert (model.transition > 0).all()
    assert model.training.settings["seed"] == "4"


@pytest.mark.nightly
def test_evaluate_uses_both_protocols_and_writes_the_confusion_matrix(manifest: Path, tmp_path: Path) -> None:
    table, figure = tmp_path / "confusion.csv", tmp_path / "confusion.png"
    status, text, _ = zenocap("posture", "evaluate", manifest, "--confusion", table, "--plot", figure, *FEW)
    assert (status, text.split()[:3]) == (0, ["posture", "paper", "subjects"])
    assert rows_of(text)["all"] == ["all", "18/18", "18/18"]
    rows = list(csv.reader(table.open(encoding="utf-8")))
    assert rows[0] == ["protocol", "posture", *LABELS]
    assert rows[1] == ["paper", "wave", "6", "0", "0"]
    assert len(rows) == 7
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.nightly
def test_evaluate_prints_json(manifest: Path) -> None:
    status, text, _ = zenocap("posture", "evaluate", manifest, "--protocol", "subjects", "--json", *FEW)
    assert status == 0
    (found,) = json.loads(text)["protocols"]
    assert (found["protocol"], found["right"], found["total"], found["people"]) == ("subjects", 18, 18, 3)
    assert np.array(found["confusion"]).sum() == 18
    assert found["wrong"] == []


@pytest.mark.slow
def test_examples_of_one_person_are_evaluated_without_the_subjects_protocol(manifest: Path) -> None:
    rows = [line for line in manifest.read_text().splitlines() if not line.endswith((",2", ",3"))]
    manifest.write_text("\n".join(rows) + "\n")
    text = printed("posture", "evaluate", manifest, *FEW)
    assert "note: subjects: 6 examples by 1 people: allowed: two people or more" in text
    assert "6/6" in text
    assert "error: subjects: " in printed("posture", "evaluate", manifest, "--protocol", "subjects", status=1)


@pytest.mark.nightly
def test_rows_without_angles_are_an_error_or_skipped_and_reported(manifest: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    unreadable, read = manifest.parent / "lost.mcap", example_files.read_features
    unreadable.touch()

    def read_or_fail(path: Path, kind: Kind, joints: JointMap | None = None) -> Features:
        if path == unreadable:
            raise UserError(f"{path}: no universal BDP")
        return read(path, kind, joints)

    monkeypatch.setattr(example_files, "read_features", read_or_fail)
    manifest.write_text(manifest.read_text() + "lost.mcap,wave,1\n")
    assert "line 20: " in printed("posture", "evaluate", manifest, *FEW, status=1)
    status, text, errors = zenocap("posture", "evaluate", manifest, "--skip-missing", "--json", *FEW)
    assert status == 0
    assert errors.startswith("missing: ")
    assert len(json.loads(text)["missing"]) == 1
    assert json.loads(text)["protocols"][0]["total"] == 18


@pytest.mark.nightly
def test_a_joint_map_is_read_and_passed_to_the_reader_of_sources(
    manifest: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[JointMap | None] = []
    read = example_files.read_features

    def read_and_note(path: Path, kind: Kind, joints: JointMap | None = None) -> Features:
        given.append(joints)
        return read(path, kind, joints)

    monkeypatch.setattr(example_files, "read_features", read_and_note)
    names = tmp_path / "map.toml"
    names.write_text('[joints]\nRHip = "thigh"\n')
    printed("posture", "train", manifest, "-o", tmp_path / "a.postures", *FEW, "--joints", names)
    assert {joints.joints["RHip"] for joints in given if joints} == {("thigh",)}
    assert None not in given
    names.write_text("[joints]\nHip = 3\n")
    error = refused("posture", "train", manifest, "-o", tmp_path / "b.postures", "--joints", names)
    assert f"{names}: joints.Hip: allowed: Head, RHip" in error


@pytest.mark.nightly
def test_a_rate_of_false_postures_is_stated_with_its_limit(manifest: Path, tmp_path: Path) -> None:
    (tmp_path / "bow-8-0.bvh").touch()
    with manifest.open("a") as file:
        file.write("bow-8-0.bvh,-,8\n")
    out = tmp_path / "mine.postures"
    arguments = ("posture", "train", manifest, "-o", out, *FEW, "--false-per-hour", 30)
    status, text, errors = zenocap(*arguments)
    assert status == 0
    assert "warning: the background does not show 30 an hour: " in errors
    assert "needed for 30 an hour: 6 min without a false one, or more" in errors
    assert "false       30/h asked for; thresholds of at least " in text
    found = json.loads(printed("posture", "info", out, "--json"))["false_postures"]
    assert found["per_hour"] <= 30 < found["most_per_hour"]
    manifest.write_text("\n".join(manifest.read_text().splitlines()[:-1]))
    assert "false_per_hour = 30: no background" in refused(*arguments)


@pytest.mark.nightly
def test_a_model_is_evaluated_on_whole_sources_as_streams(manifest: Path, trained: Path, tmp_path: Path) -> None:
    figure = tmp_path / "curve.png"
    arguments = ("posture", "evaluate", manifest, "--model", trained)
    status, text, errors = zenocap(*arguments, "--plot", figure)
    assert status == 0
    assert "note: 18 of 18 sources are named in the model's training: the figures flatter it" in errors
    assert [rows_of(text)[name][1] for name in ("all", "wave")] == ["18", "6"]
    assert figure.read_bytes().startswith(b"\x89PNG")
    found = json.loads(zenocap(*arguments, "--json")[1])
    assert found["all"]["labelled"] == 18
    assert found["all"]["right"] + found["all"]["wrong"] == sum(
        one["right"] + one["wrong"] for one in found["postures"].values()
    )
    error = printed(*arguments, "--skip-missing", status=2)
    assert "--model: allowed without --confusion and --skip-missing" in error


@pytest.mark.nightly
def test_ignored_parts_are_stored_or_refused_in_one_line(manifest: Path, tmp_path: Path) -> None:
    out = tmp_path / "mine.postures"
    arguments = ("posture", "train", manifest, "-o", out, *FEW, "--ignore")
    assert "ignored head" in printed(*arguments, "head")
    assert read_model(out).ignored == ("head",)
    error = refused(*arguments, "legs")
    assert "ignored = legs: posture 'kick', 'bow' moves the other limbs by less than" in error


@pytest.mark.slow
def test_posture_with_a_single_example_is_reported(manifest: Path, tmp_path: Path) -> None:
    manifest.write_text("\n".join(manifest.read_text().splitlines()[:2]) + "\n")
    text = printed("posture", "train", manifest, "-o", tmp_path / "one.postures")
    assert "note: 'wave' has one example" in text
    assert "note: nothing to hold out: no movement will be rejected" in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("train nowhere.csv -o x.postures", "error: nowhere.csv: cannot be read"),
        ("train m.csv -o nowhere/x.postures", "there is no folder nowhere"),
        ("evaluate m.csv --confusion nowhere/c.csv", "there is no folder nowhere"),
        ("evaluate m.csv --plot x.gif", "suffix '.gif': allowed: .png, .jpg, .pdf, .svg"),
        ("info nowhere", "model = 'nowhere': no file nowhere; allowed: a file, or a name of: "),
        ("info m.csv", "m.csv: begins with b'take,posture"),
    ],
)
def test_invalid_input_is_a_one_line_error(
    manifest: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, arguments: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert words in refused("posture", *arguments.split())
    assert not (tmp_path / "x.postures").exists()


def test_takes_of_rigs_are_named_by_path_and_method(tmp_path: Path) -> None:
    (tmp_path / "clips" / "a b").mkdir(parents=True)
    (tmp_path / "studio.toml").touch()
    for manifest, rig, method, name in (
        ("m.csv", "clips/a b", "two-view", "clips-a-b-two-view.mcap"),
        ("m.csv", "studio.toml", "hybrid", "studio-hybrid.mcap"),
        ("clips/m.csv", "studio.toml", "hybrid", f"{tmp_path.name}-studio-hybrid.mcap"),
    ):
        assert take_name(tmp_path / manifest, tmp_path / rig, method) == name


def test_rig_of_several_rows_is_tracked_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tracked: list[str] = []

    def track_once(manifest: Path, source: Path, folder: Path, method: str | None) -> Path:
        tracked.append(source.name)
        return folder / f"{source.name}.mcap"

    monkeypatch.setattr(tracked_sources, "_take", track_once)
    (tmp_path / "clip").mkdir()
    rows = [
        ManifestRow(2, tmp_path / "clip", 0.0, 1.0, "wave", "1", "1"),
        ManifestRow(3, tmp_path / "clip", 1.0, 2.0, "wave", "1", "2"),
        ManifestRow(4, tmp_path / "a.bvh", None, None, "wave", "1", "3"),
    ]
    found = with_takes(tmp_path / "m.csv", rows, tmp_path / "tracked", None, lambda done, of, words: None)
    assert tracked == ["clip"]
    assert [row.source.name for row in found] == ["clip.mcap", "clip.mcap", "a.bvh"]
    assert [row.line for row in found] == [2, 3, 4]


def test_rigs_that_cannot_be_tracked_are_reported_with_their_line(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "bad.toml").write_text("name = 3")
    rows = [ManifestRow(k, tmp_path / name, None, None, "a", "1", "1") for k, name in ((2, "empty"), (3, "bad.toml"))]
    with pytest.raises(UserError) as raised:
        with_takes(tmp_path / "m.csv", rows, tmp_path / "tracked", None, lambda done, of, words: None)
    lines = str(raised.value).splitlines()
    assert [line.split(": ")[1] for line in lines] == ["line 2", "line 3"]


@pytest.mark.nightly
@pytest.mark.clips
def test_walking_and_kicking_are_distinguished_on_recorded_motion(tmp_path: Path) -> None:
    rows = ["source,posture,person"]
    walks = (("02_01", "02"), ("02_02", "02"), ("07_01", "07"), ("07_02", "07"))
    rows += [f"{MOTIONS / f'cmu_{name}.bvh'},walk,{person}" for name, person in walks]
    rows += [f"{MOTIONS / f'cmu_{name}_01.bvh'},kick,{name}" for name in ("10", "11")]
    (tmp_path / "m.csv").write_text("\n".join(rows))
    status, text, _ = zenocap("posture", "evaluate", tmp_path / "m.csv", "--protocol", "subjects", "--json")
    assert status == 0
    (found,) = json.loads(text)["protocols"]
    assert (found["right"], found["total"]) == (6, 6)
