"""Package data: motion priors, posture models, statistics of body measures, and the demo rig."""

from pathlib import Path

DATA = Path(__file__).resolve().parent
PRIORS = DATA / "priors"  # *.prior
POSTURES = DATA / "postures"  # *.postures
PEOPLE = DATA / "people"  # *.json: body measures of adults and children
DEMO_RIGS = {  # by method
    "both": DATA / "rigs" / "demo-both.toml",
    "auto": DATA / "rigs" / "demo.toml",
    "two-view": DATA / "rigs" / "demo-two-view.toml",
}
