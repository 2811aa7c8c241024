"""The priors that come with zenocap, by name."""

from pathlib import Path

from services.tracker.prior.file import PriorError

FOLDER = Path(__file__).resolve().parents[3] / "deploy" / "priors"
SUFFIX = ".prior"


def shipped_names() -> tuple[str, ...]:
    return tuple(sorted(path.stem for path in FOLDER.glob(f"*{SUFFIX}")))


def find_prior(text: str) -> Path:
    """The file that `text` names: a shipped prior's name, or a path.  Raises PriorError.

    A name is a word without a dot or slash; a file of that name is meant by ./NAME.
    """
    if text in shipped_names():
        return FOLDER / f"{text}{SUFFIX}"
    path = Path(text)
    if not path.is_file():
        raise PriorError(f"prior = {text!r}: allowed: a file of `zenocap prior train`, or {', '.join(shipped_names())}")
    return path
