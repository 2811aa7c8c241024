"""A rig: an installation of cameras, from one TOML file or from a folder in the Pose2Sim layout."""

import hashlib
from dataclasses import dataclass, field
from pathlib import Path

from common.camera.files import CalibrationError, read_calibration
from common.camera.pairs import angle_between_deg, most_orthogonal_pair
from common.runtime.animator_table import AnimatorTable
from common.runtime.recognizer_table import RecognizerError, RecognizerSpec, recognizer_spec
from common.runtime.rig_file import METHODS, TRACKER_METHODS, LogTable, RigError, ZenohTable, read_toml, rig_file
from common.runtime.rig_folder import folder_rig
from common.runtime.rig_viewers import Viewer, rig_viewers, size_notes
from common.runtime.tracker_table import TrackerError, TrackerSpec, tracker_spec

__all__ = ["Rig", "RigError", "Viewer", "demo_rig", "demo_rig_file", "load_rig"]


@dataclass(frozen=True)
class Rig:
    """base: the folder that the file's paths are relative to.  notes: what to tell the user.

    digest: of the content of the rig and calibration files, equal on every machine of the rig.
    files: the rig file and the calibration, for the log.
    person_height: metres, of a person who is not asked for the initial posture; None to measure the body.
    tracker: how it works; None for a method without one.  recognizer: None for a rig without.
    animator: where its page is, and to whom it sends poses on.  security: the folder of certificates; None for an open rig.
    """

    name: str
    method: str
    viewers: tuple[Viewer, ...]
    notes: tuple[str, ...]
    base: Path
    digest: str
    zenoh: ZenohTable
    log: LogTable
    files: tuple[Path, ...]
    person_height: float | None = None
    tracker: TrackerSpec | None = None
    recognizer: RecognizerSpec | None = None
    animator: AnimatorTable = field(default_factory=AnimatorTable)
    security: Path | None = None

    def viewer(self, id: str) -> Viewer:
        """The viewer of that id.  Raises RigError, which lists the ones there are."""
        for viewer in self.viewers:
            if viewer.id == id:
                return viewer
        raise RigError(f"rig {self.name}: no viewer {id!r}; there are: {', '.join(v.id for v in self.viewers)}")


def load_rig(path: Path | str, method: str | None = None, *, files: bool = True) -> Rig:
    """The rig of a TOML file or of a folder in the Pose2Sim layout.

    method: instead of the rig's own.  files: False where the sources may lie on other machines: a missing video or
    picture is no error then.  Raises RigError, whose text names file, key, value and what is allowed.
    """
    path = Path(path)
    if method is not None and method not in METHODS:
        raise RigError(f"method = {method!r}: allowed: {', '.join(METHODS)}")
    notes: tuple[str, ...] = ()
    if path.is_dir():
        base = path
        content, notes = folder_rig(path, method or METHODS[0])
        content_bytes = repr(content).encode()
        own_file = path / "clip.toml"
    elif path.exists():
        base, content_bytes = path.parent, path.read_bytes()
        content = rig_file(path, read_toml(path))
        own_file = path
    else:
        raise RigError(f"{path}: no such rig: allowed: a TOML file, or a folder with calibration.toml and videos/")
    method, own = method or content.method, method in (None, content.method)
    calibration = base / content.calibration
    if not calibration.is_file():
        raise RigError(f"{path}: calibration = {content.calibration!r}: no file {calibration}")
    try:
        cameras = read_calibration(calibration, content.up_axis)
        viewers = rig_viewers(path, base, content, cameras, files)
    except CalibrationError as error:
        raise RigError(str(error)) from error
    tracker = None
    if method in TRACKER_METHODS:
        try:
            tracker = tracker_spec(content.tracker, method, own, base, files=files)
        except TrackerError as error:
            raise RigError(f"{path}: tracker.{error}") from error
    recognizer = None
    if content.recognizer is not None:
        try:
            recognizer = recognizer_spec(content.recognizer, method, tracker is not None, base, files=files)
        except RecognizerError as error:
            raise RigError(f"{path}: recognizer.{error}") from error
    viewers, chosen = _enough(path, method, viewers)
    digest = hashlib.sha256(b"\0".join([content_bytes, calibration.read_bytes(), method.encode()])).hexdigest()[:16]
    all_notes = (*notes, *chosen, *size_notes(content, viewers))
    files_of_rig = tuple(file for file in (own_file, calibration) if file.is_file())
    return Rig(
        content.name,
        method,
        viewers,
        all_notes,
        base,
        digest,
        content.zenoh,
        content.log,
        files_of_rig,
        content.person_height,
        tracker,
        recognizer,
        content.animator,
        None if content.security is None else base / content.security.certificates,
    )


def demo_rig_file() -> Path:
    """The rig file of `zenocap demo`, in the checkout that this package was installed from.  Raises RigError."""
    root = Path(__file__).resolve().parents[2]
    path = root / "deploy" / "rigs" / "demo.toml"
    if not path.is_file():
        raise RigError(f"{path}: no such file: the demo needs a checkout of the project, installed with pip install -e .")
    return path


def demo_rig() -> Rig:
    """Two viewers of the synthetic actor, the paper's orthogonal rig."""
    return load_rig(demo_rig_file())


def _enough(path: Path, method: str, viewers: tuple[Viewer, ...]) -> tuple[tuple[Viewer, ...], tuple[str, ...]]:
    """The viewers that take part: of more than two, two-view takes the most nearly orthogonal pair."""
    least = 1 if method == "joint" else 2
    if len(viewers) < least:
        raise RigError(f"{path}: {len(viewers)} viewer(s): allowed: {least} or more [[viewer]] for method {method!r}")
    silent = [f"viewer {viewer.id}" for viewer in viewers if not viewer.silhouette]
    if method in TRACKER_METHODS and silent:
        raise RigError(f"{path}: {', '.join(silent)}: silhouette = False: allowed: true for method {method!r}")
    if method != "two-view" or len(viewers) == 2:
        return viewers, ()
    by_id = {viewer.id: viewer for viewer in viewers}
    pair = most_orthogonal_pair({id: viewer.camera for id, viewer in by_id.items()})
    first, second = (by_id[id] for id in pair)
    angle = angle_between_deg(first.camera, second.camera)
    note = (
        f"method two-view uses two of the {len(viewers)} cameras: {first.id} (front) and {second.id}, "
        f"{angle:.0f} degrees apart, the most nearly orthogonal pair"
    )
    return (first, second), (note,)
