"""A rig: an installation of cameras, from one TOML file or from a folder in the Pose2Sim layout."""

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from zenocap.common.camera.calibration_files import read_calibration
from zenocap.common.camera.level_view import has_level_view
from zenocap.common.camera.pinhole import angle_between_deg, most_orthogonal_pair
from zenocap.common.errors import UserError
from zenocap.common.rig.animator import AnimatorTable
from zenocap.common.rig.file import DELAYS, Delays, LogTable, RigFile, ZenohTable, rig_file
from zenocap.common.rig.folder import MEDIAN, chosen, folder_rig, rig_of_files
from zenocap.common.rig.methods import AUTO, BOTH, HYBRID, METHODS, TWO_VIEW, Method, method_of
from zenocap.common.rig.recognizer import RecognizerSpec, recognizer_spec
from zenocap.common.rig.table_errors import TableError
from zenocap.common.rig.tracker import TrackerSpec, tracker_spec, with_front_of
from zenocap.common.rig.two_view import IMPROVED, VARIANTS, Additions, additions_of
from zenocap.common.rig.viewers import Viewer, at_common_rate, rig_viewers, size_notes, video_notes
from zenocap.common.toml_file import read_toml
from zenocap.common.topics import SILHOUETTE
from zenocap.data import DEMO_RIGS

__all__ = ["Rig", "UserError", "Viewer", "demo_rig", "demo_rig_file", "load_rig", "rig_of_videos"]

EXCHANGING = " or ".join(repr(one) for one in (TWO_VIEW.name, BOTH.name))  # methods that have variants


@dataclass(frozen=True)
class Rig:
    """base: the folder that the paths in the file are relative to.  notes: messages for the user.

    digest: hash of the rig and calibration files, equal on every machine of the rig.
    files: the rig file and the calibration, for the log.
    person_height: metres, of an average body until the T-pose; None: as the cameras see it.
    tracker: None for a method without one.  recognizer: None for a rig without one.
    animator: page and outputs.  security: folder of certificates; None for an open rig.
    additions: to the paper's two-view method, see `zenocap.common.rig.two_view`.
    film: whether `zenocap film` may record the cameras while the rig runs.
    delays: whether delays of the cameras are estimated while it runs, and corrected.
    height_estimated: whether person_height is not given, but estimated.
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
    additions: Additions = IMPROVED
    film: bool = False
    delays: Delays = "report"
    height_estimated: bool = False

    @classmethod
    def load(
        cls, path: Path | str, method: str | None = None, variant: str | None = None, cameras: Sequence[str] | None = None
    ) -> "Rig":
        """Read a rig file, or a folder with `calibration.toml` and `videos/`.  See `load_rig`."""
        return load_rig(path, method, variant, cameras=cameras)

    @property
    def fps(self) -> float:
        """Frames per second of the slowest viewer."""
        return min(viewer.fps for viewer in self.viewers)

    def viewer(self, id: str) -> Viewer:
        """The viewer of that id.  Raises UserError, which lists the existing ids."""
        for viewer in self.viewers:
            if viewer.id == id:
                return viewer
        raise UserError(f"rig {self.name}: no viewer {id!r}; there are: {', '.join(v.id for v in self.viewers)}")


def load_rig(
    path: Path | str, method: str | None = None, variant: str | None = None, *, files: bool = True,
    cameras: Sequence[str] | None = None, calibration: Path | None = None, background: str | None = None,
) -> Rig:  # fmt: skip
    """The rig of a TOML file or of a folder in the Pose2Sim layout.

    method, variant: replace the rig's own.  files: False when the sources may be on other machines; missing videos and
    pictures are then no error.  cameras: names of cameras or ids of viewers, the others are not used; None: all.
    calibration: file to use instead of a folder's own.  background: the same, of all its cameras; see `parse_background`.
    Raises UserError, whose text contains file, key, value and allowed values.
    """
    path = Path(path)
    if path.is_dir():
        content, notes = folder_rig(path, method or AUTO, cameras, calibration, background)
        read = _Read(path, path, content, repr(content).encode(), path / "clip.toml", notes)
    elif path.exists():
        if background is not None:
            raise UserError(f"{path}: a rig file has the backgrounds of its viewers: allowed with a folder or with videos")
        content = rig_file(path, read_toml(path))
        used = None if cameras is None else tuple(one.id for one in chosen(path, content.viewer, cameras))
        read = _Read(path, path.parent, content, path.read_bytes(), path, (), used)
    else:
        raise UserError(f"{path}: no such rig: allowed: a TOML file, or a folder with calibration.toml and videos/")
    return _rig(read, method, variant, files)


def rig_of_videos(
    videos: Sequence[Path], calibration: Path, up_axis: str = "y", background: str = MEDIAN, method: str | None = None,
    variant: str | None = None, cameras: Sequence[str] | None = None,
) -> Rig:  # fmt: skip
    """The rig of video files and a calibration, in any folders.  cameras: see `load_rig`.  Raises UserError.

    A video belongs to the camera of its name; videos without such names to the cameras in their order.
    background: of all videos, such as "first:2s" where their first two seconds show the empty scene.
    """
    content, notes = rig_of_files(videos, calibration, up_axis, background, method or AUTO, cameras)
    return _rig(_Read(calibration, Path(), content, repr(content).encode(), calibration, notes), method, variant, True)


@dataclass(frozen=True)
class _Read:
    """A rig before its calibration is read.  path: for errors.  file: its own, where it exists.

    used: ids of the viewers that take part; None: all.
    """

    path: Path
    base: Path
    content: RigFile
    content_bytes: bytes
    file: Path
    notes: tuple[str, ...]
    used: tuple[str, ...] | None = None


def _rig(read: _Read, method: str | None, variant: str | None, files: bool) -> Rig:
    """The rig.  method, variant, files: see `load_rig`."""
    if method is not None and method not in (AUTO, *METHODS.names()):
        raise UserError(f"method = {method!r}: allowed: {', '.join((AUTO, *METHODS.names()))}")
    path, base, content = read.path, read.base, read.content
    has_variant = content.variant != VARIANTS[0] or bool(content.additions) or bool(content.without)
    own_method = _resolved(content.method, has_variant)
    method = _resolved(method or content.method, variant is not None or has_variant)
    own = method == own_method
    calibration = base / content.calibration
    if not calibration.is_file():
        raise UserError(f"{path}: calibration = {content.calibration!r}: no file {calibration}")
    additions = _additions(path, content, method, variant)
    cameras = read_calibration(calibration, content.up_axis)
    viewers = rig_viewers(path, base, content, cameras, files, read.used)
    tracker = None
    row = method_of(method)
    if row.table == "tracker":
        with _errors_of(path, "tracker"):
            tracker = tracker_spec(content.tracker, row.tracker_method, own, base, files=files)
    recognizer = None
    if content.recognizer is not None:
        with _errors_of(path, "recognizer"):
            recognizer = recognizer_spec(content.recognizer, method, base, files=files)
    viewers, pair = _viewers_in_use(path, row, viewers)
    if tracker is not None:
        with _errors_of(path, "tracker"):
            tracker = with_front_of(tracker, {viewer.id: viewer.camera.name for viewer in viewers})
    viewers, rates = at_common_rate(viewers)
    delays = _checked_delays(path, content, row, viewers)
    used = [id.encode() for id in read.used or ()]
    parts = [read.content_bytes, calibration.read_bytes(), method.encode(), *_variant_bytes(additions), *used]
    digest = hashlib.sha256(b"\0".join(parts)).hexdigest()[:16]
    sizes = (*size_notes(content, viewers, cameras), *(video_notes(viewers) if files else ()))
    notes = (*read.notes, *pair, *rates, *sizes)
    files_of_rig = tuple(file for file in dict.fromkeys((read.file, calibration)) if file.is_file())
    return Rig(
        content.name, method, viewers, notes, base, digest, content.zenoh, content.log, files_of_rig,
        content.person_height, tracker, recognizer, content.animator,
        None if content.security is None else base / content.security.certificates, additions, content.film, delays,
    )  # fmt: skip


@contextmanager
def _errors_of(path: Path, table: str) -> Iterator[None]:
    """Raises UserError for a TableError, with the file and the name of the table before its text."""
    try:
        yield
    except TableError as error:
        raise UserError(f"{path}: {table}.{error}") from error


def _resolved(method: str, variant: bool) -> str:
    """The method for "auto": that of the tracker.  variant: whether a variant of two-view is asked for."""
    if method != AUTO:
        return method
    return TWO_VIEW.name if variant else HYBRID.name


def demo_rig_file(method: str = AUTO) -> Path:
    """Return the rig file of a demo, which is package data.  method: "both", "auto" or "two-view".  Raises UserError."""
    if method not in DEMO_RIGS:
        raise UserError(f"method = {method!r}: allowed for the demo: {', '.join(DEMO_RIGS)}")
    return DEMO_RIGS[method]


def demo_rig(method: str = AUTO) -> Rig:
    """The rig of `zenocap demo`: two orthogonal viewers of the simulated person.

    method: "auto" for the tracker, "two-view" for the paper's two-view method in images of 160 x 120, "both" for both on
    the same silhouettes.  Raises UserError.
    """
    return load_rig(demo_rig_file(method))


def _variant_bytes(additions: Additions) -> list[bytes]:
    """The additions for the digest, where they are not the usual ones."""
    return [] if additions == IMPROVED else [",".join(sorted(additions)).encode()]


def _additions(path: Path, content: RigFile, method: str, variant: str | None) -> Additions:
    """Additions to the paper's two-view method.  variant: replaces that of the file.  Raises UserError."""
    if variant is not None:
        if not method_of(method).exchange:
            raise UserError(f"variant = {variant!r}: allowed: only with method {EXCHANGING}; the method is {method!r}")
        content = msgspec.structs.replace(content, variant=variant, additions=(), without=())
    elif content.variant != VARIANTS[0] and content.method != AUTO and not method_of(content.method).exchange:
        raise UserError(f"{path}: variant = {content.variant!r}: allowed: only with method = {EXCHANGING}")
    try:
        return additions_of(content.variant, content.additions, content.without)
    except ValueError as error:
        raise UserError(f"{path}: {error}") from error


def _viewers_in_use(path: Path, row: Method, viewers: tuple[Viewer, ...]) -> tuple[tuple[Viewer, ...], tuple[str, ...]]:
    """The viewers in use, and notes: a method for two uses the most nearly orthogonal pair of more."""
    method, (fewest, most) = row.name, row.views
    if len(viewers) < fewest:
        raise UserError(f"{path}: {len(viewers)} viewer(s): allowed: {fewest} or more [[viewer]] for method {method!r}")
    without_silhouette = [f"viewer {viewer.id}" for viewer in viewers if not viewer.silhouette]
    if SILHOUETTE in row.sends and without_silhouette:
        raise UserError(f"{path}: {', '.join(without_silhouette)}: silhouette = False: allowed: true for method {method!r}")
    fed = [f"viewer {viewer.id}" for viewer in viewers if viewer.feedback]
    if not row.only_silhouettes and fed:
        without = "" if row.has_tracker else ", without a tracker"
        raise UserError(f"{path}: {', '.join(fed)}: feedback = true: allowed: false for method {method!r}{without}")
    kept = [f"viewer {viewer.id}" for viewer in viewers if viewer.keep_background]
    if not row.only_silhouettes and kept:
        raise UserError(f"{path}: {', '.join(kept)}: keep_background = true: allowed: false for method {method!r}")
    if not row.only_silhouettes and (steep := [one for one in viewers if not has_level_view(one.camera)]):
        if len(viewers) - len(steep) < fewest:
            names = ", ".join(one.camera.name for one in steep)
            raise UserError(
                f"{path}: camera {names} points within 10 degrees of straight up or down: allowed for method {method!r}: "
                f"{fewest} cameras that do not; is another axis vertical (up_axis)?"
            )
        viewers = tuple(one for one in viewers if one not in steep)
    if len(viewers) <= most:
        return viewers, ()
    if most != 2:
        raise UserError(f"{path}: {len(viewers)} viewers: allowed: {fewest} to {most} [[viewer]] for method {method!r}")
    by_id = {viewer.id: viewer for viewer in viewers}
    pair = most_orthogonal_pair({id: viewer.camera for id, viewer in by_id.items()})
    first, second = (by_id[id] for id in pair)
    angle = angle_between_deg(first.camera, second.camera)
    note = (
        f"method {method} uses two of the {len(viewers)} cameras: {first.id} (front) and {second.id}, "
        f"{angle:.0f} degrees apart, the most nearly orthogonal pair"
    )
    return (first, second), (note,)


def _checked_delays(path: Path, content: RigFile, method: Method, viewers: tuple[Viewer, ...]) -> Delays:
    """Whether delays of the cameras are estimated and corrected.

    Raises UserError when that needs a tracker alone, or when the cameras of another rig are a frame period or more apart:
    each of its viewers gets the assignment of a frame before its next frame only if the others have seen that instant.
    """
    if not method.only_silhouettes:
        early, *_, late = sorted(viewers, key=lambda viewer: viewer.delay_ns)
        period_ns = 1e9 / min(viewer.fps for viewer in viewers)
        apart_ns = late.delay_ns - early.delay_ns
        if apart_ns >= period_ns:
            raise UserError(
                f"{path}: delay_ms of viewer {late.id} is {apart_ns / 1e6:g} ms above that of viewer {early.id}: "
                f"allowed for method {method.name!r}: less than a frame period, {period_ns / 1e6:.1f} ms; "
                f"{HYBRID.name!r} waits for late cameras"
            )
        if content.delays == "follow":
            raise UserError(
                f"{path}: delays = 'follow': allowed for method {method.name!r}: off, report; "
                "zenocap sync TAKE finds delay_ms of the viewers"
            )
    return next(one for one in DELAYS if one == content.delays)
