"""Body measures of adults from ANSUR II, for `zenocap/data/people/adults.json`.

python -m zenocap.tools.teach.dataset.build_anthropometry ANSUR_II_FEMALE_Public.csv ANSUR_II_MALE_Public.csv [--to FILE]

ANSUR II: Gordon et al., 2012 Anthropometric Survey of U.S. Army Personnel, Natick/TR-15/007 (2014); public domain.
"""

import argparse
import csv
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError
from zenocap.data import PEOPLE
from zenocap.simulation.body.anthropometry import MEASURES

DIGITS = 6  # of means and covariances of logarithms


def statistics(path: Path) -> dict[str, object]:
    """Number of people, and means (m,) and covariances (m, m), as lower triangle, of the logarithms of MEASURES in metres.

    Raises UserError for a file without these columns, or with a measure that is no positive number.
    """
    logarithms = np.log(_measures(path))
    covariance = np.cov(logarithms.T)
    return {
        "count": len(logarithms),
        "mean": [round(float(value), DIGITS) for value in logarithms.mean(axis=0)],
        "covariance": [[round(float(value), DIGITS) for value in row[: k + 1]] for k, row in enumerate(covariance)],
    }


def _measures(path: Path) -> Floats:
    """(people, m) measures, metres."""
    rows = []
    with path.open(encoding="latin-1", newline="") as file:
        reader = csv.DictReader(file)
        missing = [name for name in MEASURES if name not in (reader.fieldnames or ())]
        if missing:
            raise UserError(f"{path}: no column {', '.join(missing)}; expected the CSV file of ANSUR II")
        for number, row in enumerate(reader, 2):
            try:
                values = [float(row[name]) / 1000 for name in MEASURES]
            except ValueError as error:
                raise UserError(f"{path}: line {number}: {error}") from error
            if min(values) <= 0:
                raise UserError(f"{path}: line {number}: a measure is 0 or negative; expected millimetres")
            rows.append(values)
    if len(rows) <= len(MEASURES):
        raise UserError(f"{path}: {len(rows)} people; at least {len(MEASURES) + 1} are needed")
    return np.array(rows)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("women", type=Path)
    parser.add_argument("men", type=Path)
    parser.add_argument("--to", type=Path, default=PEOPLE / "adults.json")
    options = parser.parse_args(arguments)
    content = {
        "source": "ANSUR II (Gordon et al. 2014): logarithms of measures in metres; covariance as lower triangle",
        "measures": list(MEASURES),
        "women": statistics(options.women),
        "men": statistics(options.men),
    }
    text = json.dumps(content, separators=(",", ":")).replace('"women"', '\n"women"').replace('"men"', '\n"men"')
    write_atomically(options.to, f"{text}\n".encode())


if __name__ == "__main__":
    main()
