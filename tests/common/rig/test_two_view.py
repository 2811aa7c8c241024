"""Variants of the two-view method in rig files and takes."""

from pathlib import Path

import pytest

from zenocap.common.errors import UserError
from zenocap.common.recording.setup_file import recorded_rig
from zenocap.common.rig.rig import demo_rig_file, load_rig
from zenocap.common.rig.two_view import ADDITIONS, IMPROVED, PAPER, additions_of

DEMO = demo_rig_file("two-view")


def rig_with(folder: Path, text: str) -> Path:
    """The demo's rig file with more keys."""
    path = folder / "rig.toml"
    (folder / "demo-calibration.toml").write_bytes((DEMO.parent / "demo-calibration.toml").read_bytes())
    path.write_text(text + "\n" + DEMO.read_text(encoding="utf-8").replace('method = "two-view"', ""), encoding="utf-8")
    return path


def test_every_addition_is_in_the_improved_variant_and_none_in_the_papers() -> None:
    assert set(ADDITIONS) == IMPROVED
    assert not PAPER
    assert additions_of("improved", (), ()) == IMPROVED
    assert additions_of("paper", (), ()) == PAPER


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", IMPROVED),
        ('variant = "paper"', PAPER),
        ('variant = "paper"\nadditions = ["tilt", "toes"]', {"tilt", "toes"}),
        ('without = ["toes"]', IMPROVED - {"toes"}),
    ],
)
def test_rig_file_chooses_the_additions(tmp_path: Path, text: str, expected: frozenset[str]) -> None:
    rig = load_rig(rig_with(tmp_path, text))
    assert rig.additions == expected
    assert recorded_rig(rig).added() == expected


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ('variant = "literal"', "variant = 'literal': allowed: improved, paper"),
        ('variant = "paper"\nadditions = ["slant"]', "additions: 'slant': allowed: body"),
        ('additions = ["tilt"]', "additions = .'tilt'.: allowed: only with variant = 'paper'"),
        ('variant = "paper"\nwithout = ["tilt"]', "without = .'tilt'.: allowed: only with variant = 'improved'"),
        ('variant = "paper"\nmethod = "hybrid"', "variant = 'paper': allowed: only with method = 'two-view'"),
    ],
)
def test_wrong_variant_is_an_error_that_names_the_allowed_values(tmp_path: Path, text: str, error: str) -> None:
    with pytest.raises(UserError, match=error):
        load_rig(rig_with(tmp_path, text))


def test_argument_replaces_the_variant_of_the_file(tmp_path: Path) -> None:
    path = rig_with(tmp_path, 'without = ["toes"]')
    assert load_rig(path, variant="paper").additions == PAPER
    assert load_rig(path, variant="improved").additions == IMPROVED
    assert load_rig(path, "both", "paper").additions == PAPER
    with pytest.raises(UserError, match="only with method 'two-view' or 'both'"):
        load_rig(path, "hybrid", "paper")


def test_a_variant_selects_two_view_where_the_method_is_auto_and_the_digest_depends_on_it(tmp_path: Path) -> None:
    path = rig_with(tmp_path, "")
    usual = load_rig(path, "two-view").digest
    assert usual == load_rig(path, variant="improved").digest != load_rig(path, variant="paper").digest
    assert load_rig(path).method == load_rig(path, "auto").method == "hybrid"
    assert load_rig(path, variant="paper").method == "two-view"
    path = rig_with(tmp_path, 'method = "auto"\nwithout = ["toes"]')
    assert (load_rig(path).method, load_rig(path).additions) == ("two-view", IMPROVED - {"toes"})
    assert load_rig(path, "auto").method == "two-view"
    assert load_rig(path, "hybrid").method == "hybrid"
