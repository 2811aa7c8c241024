"""The [tracker] table: what it means for each method, where priors are found, and what is refused."""

from pathlib import Path
from typing import get_args

import pytest
from test_rig import RIG, write_folder, write_rig

from common.runtime import tracker_table
from common.runtime.rig import RigError, load_rig
from common.runtime.tracker_table import ITERATIONS, PARTICLES, TrackerError, TrackerSpec, Wanted, chosen, find_prior
from services.tracker.phases import Refinement
from services.tracker.refinements import REFINEMENTS

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
    """Two priors that come with the project."""
    folder = tmp_path_factory.mktemp("priors")
    for name in ("walking", "general"):
        (folder / f"{name}.prior").write_bytes(b"")
    monkeypatch.setattr(tracker_table, "PRIORS", folder)
    return folder


def spec_of(path: Path, method: str | None = None, *, files: bool = True) -> TrackerSpec:
    spec = load_rig(path, method, files=files).tracker
    assert spec is not None
    return spec


def test_a_table_is_read(tmp_path: Path) -> None:
    path = write_rig(tmp_path, HYBRID + TABLE)
    (tmp_path / "walk.prior").write_bytes(b"")
    assert spec_of(path) == TrackerSpec(tmp_path / "walk.prior", 60, 300, 3, 7, "ten-parts", "force")


def test_without_a_table_the_defaults_hold(tmp_path: Path) -> None:
    expected = TrackerSpec(None, 40, 400, 4, 0, "fourteen-parts", "gauss-newton")
    assert spec_of(write_rig(tmp_path, HYBRID)) == expected


@pytest.mark.parametrize("method", list(PARTICLES))
def test_the_method_decides_the_refinement_and_that_its_iterations(tmp_path: Path, method: str) -> None:
    spec = spec_of(write_rig(tmp_path, HYBRID), method)
    assert spec.refinement == ("force" if method == "image-force" else "gauss-newton")
    assert spec.iterations == ITERATIONS[spec.refinement]


def test_what_the_rig_says_of_the_refinement_holds_for_every_method(tmp_path: Path) -> None:
    path = write_rig(tmp_path, HYBRID + '\n[tracker]\nrefinement = "force-printed"\n')
    for method in PARTICLES:
        spec = spec_of(path, method)
        assert (spec.refinement, spec.iterations) == ("force-printed", ITERATIONS["force-printed"])


def test_the_table_and_the_tracker_name_the_same_refinements() -> None:
    assert tuple(ITERATIONS) == REFINEMENTS == get_args(Refinement)


def test_two_view_has_no_tracker(tmp_path: Path) -> None:
    assert load_rig(write_rig(tmp_path, RIG + TABLE.replace('"walk.prior"', '"none"'))).tracker is None


@pytest.mark.parametrize("method", ["image-force", "particle-filter"])
def test_the_number_of_particles_is_for_the_rigs_own_method(tmp_path: Path, method: str) -> None:
    """The same rig tracked by a baseline has that one's particles, and everything else alike."""
    path = write_rig(tmp_path, HYBRID + TABLE.replace('"walk.prior"', '"walking"'))
    hybrid, other = spec_of(path), spec_of(path, method)
    assert other.particles == PARTICLES[method] != hybrid.particles
    assert (other.seed, other.points, other.prior) == (hybrid.seed, hybrid.points, hybrid.prior)


def test_a_prior_is_a_file_of_the_rig_or_one_by_name(tmp_path: Path, shipped: Path) -> None:
    assert find_prior("walking", tmp_path) == shipped / "walking.prior"
    (tmp_path / "walking").write_bytes(b"")
    assert find_prior("walking", tmp_path) == shipped / "walking.prior"
    assert find_prior("./walking", tmp_path) == tmp_path / "walking"


def test_a_prior_may_lie_on_another_machine(tmp_path: Path) -> None:
    path = write_rig(tmp_path, HYBRID + TABLE)
    assert spec_of(path, files=False).prior == tmp_path / "walk.prior"
    with pytest.raises(RigError, match=r"rig\.toml: tracker\.prior = 'walk\.prior': no file .*; allowed: a file, or"):
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
        ('"walk.prior"', '"running"', "tracker.prior = 'running': no file .*, or a name of: general, walking"),
    ],
)  # fmt: skip
def test_every_error_names_file_key_value_and_what_is_allowed(tmp_path: Path, old: str, new: str, text: str) -> None:
    table = TABLE.replace('"walk.prior"', '"walking"') if "walk.prior" not in old else TABLE
    assert old in table
    path = write_rig(tmp_path, HYBRID + table.replace(old, new))
    with pytest.raises(RigError, match=text) as caught:
        load_rig(path)
    assert str(caught.value).startswith(str(path))


def test_image_force_has_one_particle(tmp_path: Path) -> None:
    path = write_rig(tmp_path, RIG.replace('"two-view"', '"image-force"') + "\n[tracker]\nparticles = 2\n")
    with pytest.raises(RigError, match=r"tracker.particles = 2: allowed: 1 for method 'image-force'"):
        load_rig(path)


def test_a_tracker_needs_two_views_and_all_silhouettes(tmp_path: Path) -> None:
    one = HYBRID.split("[[viewer]]")
    with pytest.raises(RigError, match=r"1 viewer\(s\): allowed: 2 or more \[\[viewer\]\] for method 'hybrid'"):
        load_rig(write_rig(tmp_path, one[0] + "[[viewer]]" + one[1]))
    silent = HYBRID.replace('id = "2"', 'id = "2"\nsilhouette = false')
    with pytest.raises(RigError, match="viewer 2: silhouette = False: allowed: true for method 'hybrid'"):
        load_rig(write_rig(tmp_path, silent))


@pytest.mark.parametrize("method", list(PARTICLES))
def test_all_cameras_of_a_folder_take_part(tmp_path: Path, method: str) -> None:
    rig = load_rig(write_folder(tmp_path / "take", [0, 60, 120], "empty_frames = 3"), method)
    assert [viewer.id for viewer in rig.viewers] == ["cam01", "cam02", "cam03"]
    assert rig.notes == ()
    assert rig.tracker is not None
    assert rig.tracker.particles == PARTICLES[method]


def test_the_command_line_goes_before_the_rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = spec_of(write_rig(tmp_path, HYBRID))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.prior").write_bytes(b"")
    changed = chosen(spec, "hybrid", Wanted("mine.prior", particles=5, points=100, iterations=2, seed=3))
    assert (changed.particles, changed.points, changed.iterations, changed.seed) == (5, 100, 2, 3)
    assert changed.prior is not None
    assert changed.prior.resolve() == tmp_path / "mine.prior"
    assert chosen(spec, "hybrid", Wanted()) == spec
    forced = chosen(spec, "hybrid", Wanted(refinement="force-printed"))
    assert (forced.refinement, forced.iterations) == ("force-printed", ITERATIONS["force-printed"])
    assert chosen(spec, "hybrid", Wanted(iterations=7, refinement="force")).iterations == 7
    with pytest.raises(TrackerError, match=r"prior = 'none.prior': no file"):
        chosen(spec, "hybrid", Wanted("none.prior"))
    with pytest.raises(TrackerError, match="particles = 5: allowed: 1"):
        chosen(spec, "image-force", Wanted(particles=5))
    with pytest.raises(TrackerError, match=r"refinement = 'none': allowed: gauss-newton"):
        chosen(spec, "hybrid", Wanted(refinement="none"))
