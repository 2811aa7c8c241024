"""Assignments on disk: a camera host that is started again goes on with its viewers."""

import os
from pathlib import Path

import msgspec

from zenocap.common.atomic_write import write_atomically
from zenocap.common.errors import UserError
from zenocap.common.messages import AssignQuery
from zenocap.common.rig.hosted import hosted_rig
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.source_kinds import parse_source
from zenocap.common.rig.sources import LiveSource


class SavedAssignment(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """query: as received.  source: of the camera on this machine, as in a rig file.  previews: see `hosted_rig`."""

    query: AssignQuery
    source: str
    previews: bool


def data_folder(machine: str) -> Path:
    """Folder of a camera host's assignments: of the user who runs it."""
    home = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
    return Path(home) / "zenocap" / "discover" / machine


def write_saved(path: Path, saved: SavedAssignment) -> None:
    """Write an assignment; only its owner may read it, for the source may have a password.  Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    path.parent.chmod(0o700)
    write_atomically(path, msgspec.json.encode(saved))


def read_saved(path: Path) -> SavedAssignment:
    """Raises UserError."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=SavedAssignment)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise UserError(f"{path}: no assignment of this version of zenocap: {error}: remove it") from error


def saved_rig(path: Path, films: Path) -> tuple[Rig, str]:
    """The rig of a saved assignment, and the id of its viewer.  films: folder of films.  Raises UserError."""
    saved = read_saved(path)
    source = parse_source(saved.source, Path(), installed=False)
    if not isinstance(source, LiveSource):
        raise UserError(f"{path}: source: no camera and no stream")
    rig = hosted_rig(saved.query, source, films, previews=saved.previews)
    return rig, rig.viewers[0].id
