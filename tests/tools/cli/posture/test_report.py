"""Plot of the confusion matrix."""

from pathlib import Path

import pytest

from zenocap.services.recognizer.training.cross_validation import HeldOutResult, ValidationOutcome
from zenocap.tools.cli.posture.report import draw_confusion

OUTCOMES = [
    ValidationOutcome(protocol, ("右手", "kick"), 2, (HeldOutResult(0, 0, 0, 1.0), HeldOutResult(1, 1, 0, -1.0)))
    for protocol in ("paper", "subjects")
]


@pytest.mark.nightly
@pytest.mark.filterwarnings("ignore:Glyph .* missing from font")
@pytest.mark.parametrize(("suffix", "begins"), [(".png", b"\x89PNG"), (".pdf", b"%PDF"), (".svg", b"<?xml")])
def test_one_or_both_protocols_are_drawn_in_the_format_of_the_suffix(tmp_path: Path, suffix: str, begins: bytes) -> None:
    both, one = tmp_path / f"both{suffix}", tmp_path / f"one{suffix}"
    draw_confusion(both, OUTCOMES)
    draw_confusion(one, OUTCOMES[:1])
    assert both.read_bytes().startswith(begins)
    assert len(both.read_bytes()) > len(one.read_bytes())
