"""Everyday movement: sessions without postures, rows equal to those of a take."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.recognition.bench import Bench
from benchmarks.recognition.everyday import AWAY, everyday_examples, session_of, stretches_of, true_rows
from zenocap.services.recognizer.features import DEFAULT
from zenocap.services.recognizer.training.example_files import read_features
from zenocap.simulation.motion.timeline import Segment
from zenocap.tools.dataset.generate import dataset_rig, generate_take

SEED = 20_000


def test_stretches_are_the_session_without_its_postures() -> None:
    script = session_of(SEED, 4.0)
    postures = [segment for segment in script.segments if segment.name == AWAY]
    assert postures
    spans = list(stretches_of(script))
    assert spans[0][0] == script.motion_from_s
    assert spans[-1][1] == script.duration_s
    total = sum(end - begin for begin, end in spans) + sum(one.end_s - one.start_s for one in postures)
    assert total == pytest.approx(script.duration_s - script.motion_from_s)
    for begin, end in spans:
        assert not any(_overlap(one, begin, end) for one in postures)


def _overlap(segment: Segment, begin_s: float, end_s: float) -> bool:
    return min(segment.end_s, end_s) - max(segment.start_s, begin_s) > 1e-9


@pytest.mark.nightly
def test_rows_equal_those_of_a_take_of_true_poses(tmp_path: Path) -> None:
    script = session_of(SEED, 0.05)
    take = tmp_path / "take.mcap"
    generate_take(dataset_rig("truth"), "truth", script, SEED, take)
    motion = read_features(take, DEFAULT)
    first = int(np.flatnonzero(np.isfinite(motion.features).all(axis=1))[0])
    np.testing.assert_allclose(true_rows(script, motion.times_s[first:]), motion.features[first:], atol=1e-6)


@pytest.mark.nightly
def test_examples_are_kept_and_equal(tmp_path: Path) -> None:
    bench = Bench(tmp_path, tmp_path, 1, 3, 1)
    made, read = (everyday_examples(bench, "truth", SEED, 0.05) for _ in range(2))
    assert made
    for one, other in zip(made, read, strict=True):
        assert (one.label, one.person, one.repetition) == (other.label, other.person, other.repetition)
        np.testing.assert_array_equal(one.features, other.features)
        assert np.isfinite(one.features).all()
