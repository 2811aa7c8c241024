"""Examples of postures for the commands."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.posture_cases import LABELS, RATE, movement
from zenocap.common.formats.joint_map import JointMap
from zenocap.services.recognizer.features import Kind
from zenocap.services.recognizer.training import example_files
from zenocap.services.recognizer.training.example_files import Features


@pytest.fixture
def manifest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three people, three postures, two repetitions; real files are covered by the tests of their reader."""

    def read(path: Path, kind: Kind, joints: JointMap | None = None) -> Features:
        label, person, repetition = path.stem.split("-")
        features = movement(label, int(person), int(repetition))
        return Features(RATE, np.arange(len(features)) / RATE, features)

    monkeypatch.setattr(example_files, "read_features", read)
    rows = ["take,posture,person"]
    for person in (1, 2, 3):
        for label in LABELS:
            for repetition in (0, 1):
                (tmp_path / f"{label}-{person}-{repetition}.bvh").touch()
                rows.append(f"{label}-{person}-{repetition}.bvh,{label},{person}")
    (tmp_path / "m.csv").write_text("\n".join(rows) + "\n")
    return tmp_path / "m.csv"
