"""Statistics of body measures from a CSV file in the layout of ANSUR II."""

import json
from pathlib import Path

import numpy as np
import pytest

from zenocap.common.errors import UserError
from zenocap.simulation.body.anthropometry import MEASURES
from zenocap.tools.teach.dataset.build_anthropometry import main, statistics


def survey(path: Path, count: int = 60, header: tuple[str, ...] = MEASURES, seed: int = 0) -> np.ndarray:
    values = np.exp(np.random.default_rng(seed).normal(6.0, 0.1, (count, len(header))))
    lines = [",".join(("subjectid", *header)), *(",".join(map(str, (1, *row))) for row in values)]
    path.write_text("\n".join(lines), encoding="latin-1")
    return values


def test_means_and_covariances_are_those_of_the_logarithms(tmp_path: Path) -> None:
    women, men, table = tmp_path / "f.csv", tmp_path / "m.csv", tmp_path / "adults.json"
    values = survey(women)
    survey(men, 40, seed=1)
    main([str(women), str(men), "--to", str(table)])
    content = json.loads(table.read_text())
    logarithms = np.log(values / 1000)
    assert content["measures"] == list(MEASURES)
    assert (content["women"]["count"], content["men"]["count"]) == (60, 40)
    assert np.allclose(content["women"]["mean"], logarithms.mean(axis=0), atol=1e-6)
    triangle = content["women"]["covariance"]
    expected = np.cov(logarithms.T)
    assert all(np.allclose(row, expected[k, : k + 1], atol=1e-6) for k, row in enumerate(triangle))


def test_wrong_files_are_named_with_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "f.csv"

    def refused(text: str) -> None:
        with pytest.raises(UserError, match=rf"f\.csv: {text}"):
            statistics(path)

    survey(path, header=MEASURES[1:])
    refused("no column stature; expected the CSV file of ANSUR II")
    survey(path, 20)
    refused("20 people; at least 28 are needed")
    for value, text in (("x", "could not convert"), ("0", "a measure is 0 or negative; expected millimetres")):
        path.write_text(",".join(MEASURES) + "\n" + ",".join([value] * len(MEASURES)))
        refused(f"line 2: {text}")
