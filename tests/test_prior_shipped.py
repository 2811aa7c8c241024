"""The priors that come with zenocap, and finding a prior by name or path."""

from pathlib import Path

import numpy as np
import pytest

from common.body.anatomy import FOURTEEN_PARTS
from services.tracker.prior.file import PriorError, read_prior
from services.tracker.prior.model import reconstruction_error
from services.tracker.prior.ship import HELD_PERSON, KINDS, PEOPLE, RATE, recording
from services.tracker.prior.shipped import find_prior, shipped_names

MAX_BYTES = 300_000


def test_every_kind_is_there_and_nothing_else() -> None:
    assert shipped_names() == tuple(sorted(KINDS))


@pytest.mark.parametrize("kind", KINDS)
def test_a_shipped_prior_is_of_this_version_and_of_these_people(kind: str) -> None:
    path = find_prior(kind)
    prior = read_prior(path, FOURTEEN_PARTS)
    assert path.stat().st_size < MAX_BYTES
    assert prior.rate == RATE
    assert len(prior.training.motions) == len(PEOPLE)
    assert prior.training.held == (f"actor-{kind}-{HELD_PERSON}-{HELD_PERSON}",)
    assert prior.dimensions == 3


def test_a_shipped_prior_reconstructs_the_held_person_as_well_as_it_says() -> None:
    """Fails when the actor has changed since `make priors`."""
    prior = read_prior(find_prior("walking"))
    told = next(row.held for row in prior.training.errors if row.regions >= prior.regions)
    found = reconstruction_error(prior, recording("walking", HELD_PERSON).poses)
    assert found == pytest.approx(told, rel=0.05)
    assert np.degrees(found) < 3.0


def test_a_path_is_taken_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "own.prior").touch()
    assert find_prior(str(tmp_path / "own.prior")) == tmp_path / "own.prior"


@pytest.mark.parametrize("text", ["swimming", "", "walking.prior", "/nowhere/own.prior"])
def test_a_name_of_no_prior_is_refused_with_those_there_are(text: str) -> None:
    with pytest.raises(PriorError, match=r"prior = '.*': no file .*; allowed: .*boxing, general, running, walking"):
        find_prior(text)
