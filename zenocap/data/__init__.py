"""Package data: motion priors, posture models and the demo rig."""

from pathlib import Path

DATA = Path(__file__).resolve().parent
PRIORS = DATA / "priors"  # *.prior
POSTURES = DATA / "postures"  # *.postures
DEMO_RIG = DATA / "rigs" / "demo.toml"
