"""The [tracker] table: meaning for each method, search path of priors, rejected values."""

from pathlib import Path
from typing import get_args

import msgspec
import pytest

from tests.common.rig.test_rig import RIG, SECOND, write_folder, write_rig
from zenocap.common.errors import UserError
from zenocap.common.rig import tracker as tracker_table
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.table_errors import TableError
from zenocap.common.rig.tracker import ITERATIONS, PARTICLES, PRESETS, FilterOptions, TrackerSpec, find_prior
from zenocap.common.rig.tracker import TrackerOverrides as Overrides
from zenocap.common.rig.tracker import with_overrides as overridden
from zenocap.services.tracker.filter.particles import Refinement

HYBRID = RIG.replace('"two-view"', '"hybrid"')
TABLE = """
[tracker]
prior = "walk.prior"
particles = 60
points = 300
iterations = 3
seed = 7
anatomy = "ten-parts"
refinement = "force"
"""


@pytest.fixture(autouse=True)
def shipped(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two built-in priors."""
    folder = tmp_path_factory.mktemp("priors")
    for name in ("walking", "general", "general-paper"):
        (folder / f"{name}.prior").write_bytes(b"")
    monkeypatch.setattr(tracker_table, "PRIORS", folder)
    return folder


def spec_of(path: Path, method: str | None = None, *, files: bool = True) -> TrackerSpec:
    return load_rig(path, method, files=files).tracker


def test_a_table_is_read_and_has_defaults(tmp_path: Path) -> None:
    (tmp_path / "walk.prior").write_bytes(b"")
    expected = TrackerSpec(tmp_path / "walk.prior", 60, 300, 3, 7, "ten-parts", "force")
    assert spec_of(write_rig(tmp_path, HYBRID + TABLE)) == expected
    assert spec_of(write_rig(tmp_path, HYBRID)) == TrackerSpec(None, 40, 400, 4, 0, "fourteen-parts", "gauss-newton")


@pytest.mark.parametrize("method", list(PARTICLES))
def test_rig_file_or_method_sets_the_refinement_and_the_refinement_its_iterations(tmp_path: Path, method: str) -> None:
    spec = spec_of(write_rig(tmp_path, HYBRID), method)
    assert spec.refinement == ("force" if method == "image-force" else "gauss-newton")
    assert spec.iterations == ITERATIONS[spec.refinement]
    spec = spec_of(write_rig(tmp_path, HYBRID + '\n[tracker]\nrefinement = "force-printed"\n'), method)
    assert (spec.refinement, spec.iterations) == ("force-printed", ITERATIONS["force-printed"])


def test_the_table_and_the_tracker_name_the_same_refinements() -> None:
    assert tuple(ITERATIONS) == get_args(Refinement)


def test_two_view_has_no_tracker(tmp_path: Path) -> None:
    assert load_rig(write_rig(tmp_path, RIG + TABLE.replace('"walk.prior"', '"none"'))).tracker is None


@pytest.mark.parametrize("method", ["image-force", "particle-filter"])
def test_the_number_of_particles_applies_only_to_the_rigs_own_method(tmp_path: Path, method: str) -> None:
    """The same rig with a baseline method has the baseline's number of particles; all else is equal."""
    path = write_rig(tmp_path, HYBRID + TABLE.replace('"walk.prior"', '"walking"'))
    hybrid, other = spec_of(path), spec_of(path, method)
    assert other.particles == PARTICLES[method] != hybrid.particles
    assert (other.seed, other.points, other.prior) == (hybrid.seed, hybrid.points, hybrid.prior)


def test_a_prior_is_found_by_name_or_by_path(tmp_path: Path, shipped: Path) -> None:
    assert find_prior("walking", tmp_path) == shipped / "walking.prior"
    (tmp_path / "walking").write_bytes(b"")
    assert find_prior("walking", tmp_path) == shipped / "walking.prior"
    assert find_prior("./walking", tmp_path) == tmp_path / "walking"


def test_a_prior_may_be_on_another_machine(tmp_path: Path) -> None:
    path = write_rig(tmp_path, HYBRID + TABLE)
    assert spec_of(path, files=False).prior == tmp_path / "walk.prior"
    with pytest.raises(UserError, match=r"rig\.toml: tracker\.prior = 'walk\.prior': no file .*; allowed: a file, or"):
        load_rig(path)


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("particles = 60", "particles = 0", "tracker.particles = 0: allowed: int >= 1"),
        ("particles = 60", "particels = 60", "tracker.particels = 60: no such key; .*did you mean 'particles'"),
        ("points = 300", "points = 5", "tracker.points = 5: allowed: int >= 20"),
        ("iterations = 3", "iterations = -1", "tracker.iterations = -1: allowed: int >= 0"),
        ("seed = 7", "seed = -7", "tracker.seed = -7: allowed: int >= 0"),
        ('"ten-parts"', '"six-parts"', "tracker.anatomy = 'six-parts': allowed: ten-parts, fourteen-parts"),
        ('"force"', '"newton"', "tracker.refinement = 'newton': allowed: gauss-newton, force, force-printed"),
        ("seed = 7", 'preset = "papers"', "tracker.preset = 'papers': allowed: default, paper"),
        ("seed = 7", 'distance = "plain"', "tracker.distance = 'plain': allowed: contact, modulated"),
        ("seed = 7", 'association = "any"', "tracker.association = 'any': allowed: modulated, closest"),
        ("seed = 7", 'force_law = "cubic"', "tracker.force_law = 'cubic': allowed: quadratic, linear"),
        ("seed = 7", 'ends = "sharp"', "tracker.ends = 'sharp': allowed: round, flat"),
        ("seed = 7", "prior_share = 1.5", r"tracker.prior_share = 1.5: allowed: 0 to 1, adaptive"),
        ("seed = 7", 'prior_share = "all"', r"tracker.prior_share = 'all': allowed: 0 to 1, adaptive"),
        ("seed = 7", 'cost_terms = "no"', r"tracker.cost_terms = 'no': allowed: bool"),
        ('"walk.prior"', '"running"', "tracker.prior = 'running': no file .*: general, general-paper, walking"),
        ('prior = "walk.prior"', "prior_share = 0.5", "tracker.prior_share = 0.5: allowed without a prior: 0, 'adaptive'"),
        ('"hybrid"', '"image-force"', "tracker.particles = 60: allowed: 1 for method 'image-force'"),
        (SECOND, "", r"1 viewer\(s\): allowed: 2 or more \[\[viewer\]\] for method 'hybrid'"),
        ('id = "2"', 'id = "2"\nsilhouette = false', "viewer 2: silhouette = False: allowed: true for method 'hybrid'"),
    ],
)  # fmt: skip
def test_every_error_names_file_key_value_and_what_is_allowed(tmp_path: Path, old: str, new: str, text: str) -> None:
    rig = HYBRID + (TABLE.replace('"walk.prior"', '"walking"') if "walk.prior" not in old else TABLE)
    assert old in rig
    path = write_rig(tmp_path, rig.replace(old, new))
    with pytest.raises(UserError, match=text) as caught:
        load_rig(path)
    assert str(caught.value).startswith(str(path))


def test_preset_paper_sets_the_printed_options(tmp_path: Path, shipped: Path) -> None:
    path = write_rig(tmp_path, HYBRID + '\n[tracker]\npreset = "paper"\n')
    printed = FilterOptions(
        distance="modulated", association="closest", force_law="quadratic", ends="flat", cost_terms=False, prior_share=1.0,
        relocalization=False, velocity_prediction=False, shape_estimation=False, limb_search=False,
        other_postures=False, start="t-pose",
    )  # fmt: skip
    assert PRESETS["paper"].filter == printed
    prior = shipped / "general-paper.prior"
    assert spec_of(path) == TrackerSpec(prior, 40, 400, 100, 0, "ten-parts", "force-printed", "paper", printed)
    for method in ("image-force", "particle-filter"):
        other = spec_of(path, method)
        assert (other.prior, other.filter, other.particles) == (None, printed, PARTICLES[method])
        assert other.refinement == "force-printed"


def test_a_key_replaces_the_value_of_the_preset(tmp_path: Path) -> None:
    keys = 'prior = "walking"\nprior_share = 0.5\nrelocalization = true\nanatomy = "fourteen-parts"\n'
    spec = spec_of(write_rig(tmp_path, HYBRID + '\n[tracker]\npreset = "paper"\n' + keys))
    expected = msgspec.structs.replace(PRESETS["paper"].filter, prior_share=0.5, relocalization=True)
    assert (spec.filter, spec.anatomy, spec.prior.stem) == (expected, "fourteen-parts", "walking")


def test_a_preset_of_the_command_line_replaces_the_options_of_the_rig(tmp_path: Path, shipped: Path) -> None:
    table = '\n[tracker]\nprior = "walking"\nparticles = 60\nseed = 7\n'
    spec = spec_of(write_rig(tmp_path, HYBRID + table))
    paper = overridden(spec, "hybrid", Overrides(preset="paper"))
    assert (paper.particles, paper.iterations, paper.seed, paper.anatomy) == (40, 100, 7, "ten-parts")
    assert (paper.prior, paper.filter) == (shipped / "general-paper.prior", PRESETS["paper"].filter)
    assert overridden(spec, "hybrid", Overrides("general", preset="paper")).prior == shipped / "general.prior"
    assert overridden(spec, "hybrid", Overrides(preset="default")) == spec


@pytest.mark.parametrize("method", list(PARTICLES))
def test_all_cameras_of_a_folder_are_used(tmp_path: Path, method: str) -> None:
    rig = load_rig(write_folder(tmp_path / "take", [0, 60, 120], "empty_frames = 3"), method)
    assert [viewer.id for viewer in rig.viewers] == ["cam01", "cam02", "cam03"]
    assert rig.notes == ()
    assert rig.tracker.particles == PARTICLES[method]


def test_the_command_line_overrides_the_rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = spec_of(write_rig(tmp_path, HYBRID))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.prior").write_bytes(b"")
    changed = overridden(spec, "hybrid", Overrides("mine.prior", particles=5, points=100, iterations=2, seed=3))
    assert (changed.particles, changed.points, changed.iterations, changed.seed) == (5, 100, 2, 3)
    assert changed.prior.resolve() == tmp_path / "mine.prior"
    assert overridden(spec, "hybrid", Overrides()) == spec
    forced = overridden(spec, "hybrid", Overrides(refinement="force-printed"))
    assert (forced.refinement, forced.iterations) == ("force-printed", ITERATIONS["force-printed"])
    assert overridden(spec, "hybrid", Overrides(iterations=7, refinement="force")).iterations == 7


@pytest.mark.parametrize(
    ("method", "overrides", "words"),
    [
        ("hybrid", Overrides("none.prior"), "prior = 'none.prior': no file"),
        ("image-force", Overrides(particles=5), "particles = 5: allowed: 1"),
        ("hybrid", Overrides(refinement="none"), "refinement = 'none': allowed: gauss-newton"),
        ("hybrid", Overrides(preset="none"), "preset = 'none': allowed: default, paper"),
    ],
)
def test_wrong_options_of_the_command_line_are_errors(tmp_path, method, overrides, words):
    with pytest.raises(TableError, match=words):
        overridden(spec_of(write_rig(tmp_path, HYBRID)), method, overrides)
