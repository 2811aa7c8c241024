"""Folders that tests read: the checkout, the golden takes, and the test data beside the checkout."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
GOLDEN = ROOT / "tests" / "golden"
SHARED = ROOT.parent / "shared"
CLIPS = SHARED / "clips"
MOTIONS = SHARED / "motions"
