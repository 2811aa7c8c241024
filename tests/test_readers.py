"""Readers of files that users give: of damaged content a UserError, and no other exception."""

import ast
import random
import re
import sys
import zipfile
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from inspect import isfunction
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType

import cv2
import numpy as np
import pytest
import typer

from tests.common.recording.test_writer import record_take
from tests.common.rig.test_hosted import STREAM
from tests.common.rig.test_hosted import rig as hosted_studio
from tests.measures.house import PACKAGE, sources
from tests.support import forked_readers
from tests.support.board_pictures import before, picture_of, plain_camera
from tests.support.marker_files import acted_centres, write_points
from tests.support.opensim_models import write_model as write_osim
from tests.support.places import ROOT
from tests.support.pose_tracks import moving
from tests.support.posture_cases import examples, quick_model
from tests.support.prior_cases import known_prior
from tests.support.simulated_cameras import paper_cameras
from tests.support.video_file import Sound, write_video
from tests.support.videos import grey_frames
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.access import Member
from zenocap.common.bus.revocations import read_revocations
from zenocap.common.camera.calibration_files import read_calibration, write_layout
from zenocap.common.camera.lens_files import read_lenses
from zenocap.common.errors import UserError
from zenocap.common.formats import text_file
from zenocap.common.formats.angle_series import angle_series, read_source
from zenocap.common.formats.bvh_writer import write_bvh
from zenocap.common.formats.joint_map import read_joint_map
from zenocap.common.formats.mot import write_mot
from zenocap.common.formats.motion_files import read_centres
from zenocap.common.formats.opensim_coordinates import coordinates_of
from zenocap.common.formats.opensim_model import read_model as read_osim
from zenocap.common.formats.take_poses import read_poses
from zenocap.common.formats.trc import write_trc
from zenocap.common.observe.account import METADATA, Account, Life, Report, Sender
from zenocap.common.recording import writer
from zenocap.common.recording.mcap_records import Attachment
from zenocap.common.recording.reader import TakeReader, items_of
from zenocap.common.recording.setup_file import read_parameters, read_setup
from zenocap.common.recording.summary import read_summary
from zenocap.common.recording.take_account import take_account
from zenocap.common.rig.folder import read_offsets
from zenocap.common.rig.hosted import assignment
from zenocap.common.rig.rig import demo_rig, load_rig
from zenocap.common.rig.sources import BackgroundImage, Images
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.video.reader import VideoReader, until_cut
from zenocap.common.vision.adaptive.model import start
from zenocap.common.vision.adaptive.saved import Owner, packed, read
from zenocap.services.animator import comparison_reader
from zenocap.services.camera.assigned import AssignedCamera
from zenocap.services.camera.saved import SavedAssignment, saved_rig, write_saved
from zenocap.services.recognizer.model_file import read_model, write_model
from zenocap.services.recognizer.training.example_files import read_features
from zenocap.services.recognizer.training.example_store import read_stored, store_path, write_examples
from zenocap.services.recognizer.training.examples import TrainingSettings
from zenocap.services.recognizer.training.label_table import read_spans
from zenocap.services.recognizer.training.manifest import read_manifest
from zenocap.services.tracker.prior.file import read_prior, write_prior
from zenocap.services.tracker.prior.motions import read_motion
from zenocap.services.viewer.shell import plate_of
from zenocap.services.viewer.sources import rendered
from zenocap.services.viewer.sources.images import image_frames
from zenocap.services.viewer.sources.playback import Playback
from zenocap.services.viewer.sources.resize import Fit
from zenocap.tools.cli.options import one_line_errors
from zenocap.tools.measure.unit_costs import COSTS, read_costs, write_costs
from zenocap.tools.record.launcher.statement import statement
from zenocap.tools.record.replay.timeline import Timeline
from zenocap.tools.setup.calibration.board import checked_board
from zenocap.tools.setup.calibration.corners_file import packed as packed_corners
from zenocap.tools.setup.calibration.corners_file import read_corners
from zenocap.tools.setup.calibration.detection import detected
from zenocap.tools.setup.calibration.film_search import probes
from zenocap.tools.setup.calibration.lines_file import read_measurements
from zenocap.tools.setup.calibration.scene_file import read_scene
from zenocap.tools.setup.cameras.away import AWAY, require_copied, write_away
from zenocap.tools.setup.certificates.authority import read_certificate, read_key
from zenocap.tools.setup.certificates.folder import certify, revoke
from zenocap.tools.setup.models.wheel import INSIDE, from_file
from zenocap.tools.setup.state import CAMERAS, read_cameras
from zenocap.tools.setup.sync.sound import read_sound
from zenocap.tools.takes.recover import recover
from zenocap.tools.takes.render.caption import read_labels
from zenocap.tools.takes.take_videos import SeekableVideo
from zenocap.tools.takes.verify.recompute import verify

NOW = datetime(2026, 1, 2, tzinfo=UTC)
SEEDS, FEW = 200, 2  # mutations of a file in the tiers nightly and slow
OWNER, SIZE = Owner("studio", "1", "0" * 64), (64, 48)
TOKENS = (
    *(b"\xff", b"\0", b"\xed\xa0\x80", b"-1", b"1e999", b"nan", b"99999999999999999999", b"true", b"A" * 300, b"/" * 40),
    *(b"[", b"]", b"{", b'"', b"\n", b",", b"=", b"<", b"&#0;"),
)


@dataclass(frozen=True)
class Kind:
    """A kind of file.  write: writes a valid one, with what it needs beside it, into a folder.  read: gives all of it."""

    name: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]


TEXTS: Mapping[str, str] = {
    "joints.toml": 'up = "y"\n[joints]\nRHip = "hip.R"\nLHip = ["a", "b"]\n',
    "labels.csv": "time,label\n0.0,stand\n1.5,sit\n4.0,\n",
    "examples.csv": "source,start,end,posture,person,repetition\na.bvh,0.5,2,sit,ann,1\nb.trc,,,sit,bob,2\n",
    "scene.toml": ("size = [640, 480]\n[points]\na = [0, 0, 0]\nb = [1, 0, 0.5]\n[cam01]\na = [1.5, 2]\nb = [30, 40]\n"),
    "lines.toml": "size = [640, 480]\nd_x = 1\nd_z = 2\nt = 1.5\n"
    + "".join(f"[camera{k}]\na = [1, 2]\nb = [3, 4]\nc = [5, 6.5]\ndistance = 5\n" for k in (1, 2)),
    CAMERAS: 'size = [640, 480]\nfps = 30.0\n[sources]\none = "rtsp://a/b"\ntwo = "rtsp://a/c"\n',
}


def text(path: Path, content: str) -> None:
    path.write_text(content, encoding="utf-8")


def of_text(path: Path) -> None:
    """Writes the file of TEXTS that has this name."""
    text(path, TEXTS[path.name])


def shipped_rig(path: Path) -> None:
    for name in ("demo.toml", "demo-calibration.toml"):
        (path.parent / name).write_bytes((ROOT / "zenocap" / "data" / "rigs" / name).read_bytes())


def cameras(layout: str, place: str = "") -> Callable[[Path], object]:
    """place: of the file to write the layout at, beside the one that is damaged."""
    named = dict(zip(("cam01", "cam02"), paper_cameras(), strict=True))
    return lambda path: write_layout(path.parent if place == "." else path, named, layout)


def manifest(path: Path) -> None:
    of_text(path)
    for name in ("a.bvh", "b.trc"):
        path.with_name(name).touch()


def easymocap(path: Path) -> None:
    """Writes both files; one of another name is that of the lenses."""
    cameras("easymocap")(path.with_name("extri.yml"))
    if path.name == "lens.yml":
        path.write_bytes(path.with_name("intri.yml").read_bytes())


def motion_trc(path: Path) -> None:
    write_trc(path, moving(6).trajectories())


def angles(path: Path) -> object:
    return angle_series(read_source(path), path, rigid_trunk=True)


def film_folder(path: Path) -> None:
    folder = path.parent
    cameras("anipose")(folder / "calibration.toml")
    for name in ("cam01", "cam02"):
        write_video(folder / "videos" / f"{name}.mp4", grey_frames(4))
    text(folder / "sync.toml", "[offset_s]\ncam01 = 0.0\ncam02 = 0.25\n")
    text(folder / "clip.toml", 'empty_frames = 3\nup_axis = "y"\nfps = 25.0\n')


def studio(path: Path) -> None:
    film_folder(path)
    viewers = "".join(
        f'[[viewer]]\nid = "{k}"\ncamera = "cam0{k}"\nsource = "videos/cam0{k}.mp4"\nbackground = "{background}"\n'
        for k, background in ((1, "first:3"), (2, "image:empty.png"))
    )
    path.with_name("empty.png").touch()
    text(path, f'name = "studio"\nmethod = "hybrid"\ncalibration = "calibration.toml"\n{viewers}')


def film_of(path: Path) -> object:
    return load_rig(path.parent)


def video(path: Path) -> None:
    samples = np.sin(np.arange(16_000) / 5.0)
    write_video(path, grey_frames(20), sound=Sound(samples))


def played(path: Path) -> None:
    with VideoReader(path) as reader:
        for frame in until_cut(iter(reader.next, None)):
            frame.image()


def sought(path: Path) -> None:
    one = SeekableVideo(path)
    for time_s in (0.3, 0.0, 9.0):
        one.at(time_s)
    one.close()


def posture_model(path: Path) -> None:
    write_model(path, quick_model())


def stored(path: Path) -> None:
    model = path.with_suffix(".postures")
    posture_model(model)
    write_examples(model, examples(), TrainingSettings())
    assert store_path(model) == path


def certificates(path: Path) -> None:
    certify(path.parent, "studio", {Member("viewer", "1"): ["h"]}, NOW, 30)
    revoke(path.parent, "studio", [Member("viewer", "1")], NOW)


def revocations(path: Path) -> object:
    return read_revocations(str(path), path.read_bytes(), path.with_name("authority.pem").read_bytes())


def away(path: Path) -> None:
    write_away(path.parent, {"cam01": ("lab", "/films/x")})


def assigned(path: Path) -> None:
    query = assignment(hosted_studio(path.parent, 'background = "first:45"\nexposure = 12'), "0", 5)
    write_saved(path, SavedAssignment(query=query, source=STREAM.text, previews=True))


def kept(path: Path) -> None:
    path.write_bytes(packed(start(grey_frames(5)), OWNER))


def take(path: Path) -> None:
    path.write_bytes((ROOT / "tests" / "golden" / "arms.mcap").read_bytes())


def logged(path: Path) -> None:
    """With an account of its log, in which messages are missing."""
    last = Report(10**18, 0, {"sighting": 9}, {"sighting": 7})
    sender = Sender({"sighting": 9}, {1: Life(Report(0, 0, {}, {}), last)})
    recording = record_take(path, 30)
    recording.closing = lambda: {METADATA: Account({("viewer", "1"): sender}, 2 * 10**18).metadata()}
    recording.close()


def part(path: Path, repeated: str = "2") -> None:
    """The first messages of a take, with the input traces of their services, as a later part of it."""
    take = TakeReader(ROOT / "tests" / "golden" / "arms.mcap")
    first = list(islice(take.envelopes(), 100))
    attachments = tuple(writer.Attachment(name, "", data) for name, data in take.attachments.items())
    metadata = {"part": {"number": "2", "repeated": repeated}}
    recording = writer.Recording(path, rig="demo", start_ns=0, metadata=metadata, attachments=attachments)
    for received in first:
        recording.record(received)
    assert recording.close().failure is None


def stated(path: Path) -> None:
    found = take_account(path)
    list(statement([found], Account(), [("viewer", "1")]).text())


def recovered(path: Path) -> None:
    path.with_name("whole.mcap").unlink(missing_ok=True)
    recover(path, path.with_name("whole.mcap"))


def replayed(path: Path) -> None:
    timeline = Timeline([path])
    deque(timeline.read(timeline.duration_ns // 2), 0)


def attached(name: str) -> Callable[[Path], None]:
    """Writes an attachment of a take as a file."""

    def write(path: Path) -> None:
        items = items_of(ROOT / "tests" / "golden" / "arms.mcap")
        path.write_bytes(next(one.data for one in items if isinstance(one, Attachment) and one.name == name))

    return write


def still(path: Path) -> None:
    picture = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
    assert cv2.imwrite(str(path), picture)


def plate(path: Path) -> object:
    viewer = replace(demo_rig().viewers[0], background=BackgroundImage(path))
    return plate_of(viewer, viewer.background)


def folder_of_pictures(path: Path) -> object:
    source = Images(path.parent, f"*{path.suffix}")
    return list(image_frames(source, 10.0, Fit(SIZE, SIZE), Playback(0, ManualClock(), live=False)))


def probes_of_pictures(path: Path) -> object:
    return probes(path.parent)


def pictures(path: Path) -> None:
    np.save(path, np.stack(grey_frames(3)))


@cache
def corners() -> bytes:
    board, camera = checked_board("charuco", 5, 6, 35.0), plain_camera((320, 240), 300.0)
    views = [picture_of(board, camera, before(board, 0.5, (0.2, 0.1, 0.02 * k), (0.006 * k, 0.0))) for k in range(3)]
    with TemporaryDirectory() as folder:
        film = write_video(Path(folder) / "a.mp4", [np.stack([view] * 3, axis=-1) for view in views])
        return packed_corners(film, detected(board, film, "cam01"))


def wheel(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(INSIDE, bytes(5000))


KINDS: Mapping[str, Kind] = {
    one.name: one
    for one in (
        Kind("demo.toml", shipped_rig, lambda path: load_rig(path, files=False)),
        Kind("demo-calibration.toml", shipped_rig, lambda path: load_rig(path.with_name("demo.toml"), files=False)),
        Kind("studio.toml", studio, load_rig),
        Kind("extri.yml", easymocap, read_calibration),
        Kind("lens.yml", easymocap, read_lenses),
        Kind("intri.yml", easymocap, lambda path: read_calibration(path.with_name("extri.yml"))),
        Kind("qualisys.qca.txt", cameras("qualisys"), lambda path: read_calibration(path, "z")),
        Kind("cam01.yaml", cameras("ros", "."), read_lenses),
        Kind("motion.bvh", lambda path: write_bvh(path, moving(6)), lambda path: (read_centres(path), angles(path))),
        Kind("motion.trc", motion_trc, read_centres),
        Kind("motion.c3d", lambda path: write_points(path, acted_centres()), read_centres),
        Kind("motion.mot", lambda path: write_mot(path, *coordinates_of(moving(6))), angles),
        Kind("body.osim", write_osim, read_osim),
        Kind("joints.toml", of_text, read_joint_map),
        Kind("take.mcap", take, read_poses),
        Kind("beside.mcap", take, comparison_reader.read_track),
        Kind("labels.mcap", take, read_labels),
        Kind("summary.mcap", take, read_summary),
        Kind("account.mcap", logged, stated),
        Kind("cut.mcap", take, recovered),
        Kind("played.mcap", take, replayed),
        Kind("verified.mcap", part, lambda path: verify([path])),
        Kind("setup.json", attached("setup.json"), lambda path: read_setup(path, path.read_bytes())),
        Kind("parameters.json", attached("parameters.json"), lambda path: read_parameters(path, path.read_bytes())),
        Kind("sync.toml", film_folder, lambda path: (read_offsets(path, ["cam01", "cam02"]), film_of(path))),
        Kind("clip.toml", film_folder, film_of),
        Kind("calibration.toml", film_folder, film_of),
        Kind("posture.bvh", lambda path: write_bvh(path, moving(6)), lambda path: read_features(path, "directions")),
        Kind("prior.trc", motion_trc, lambda path: read_motion(path, TEN_PARTS)),
        Kind("labels.csv", of_text, read_spans),
        Kind("examples.csv", manifest, read_manifest),
        Kind("some.postures", posture_model, read_model),
        Kind("some.examples", stored, lambda path: read_stored(path.with_suffix(".postures"))),
        Kind("some.prior", lambda path: write_prior(path, known_prior()), read_prior),
        Kind("scene.toml", of_text, read_scene),
        Kind("lines.toml", of_text, read_measurements),
        Kind("cam01.corners", lambda path: path.write_bytes(corners()), read_corners),
        Kind("authority.pem", certificates, lambda path: read_certificate(str(path), path.read_bytes())),
        Kind("authority-key.pem", certificates, lambda path: read_key(str(path), path.read_bytes())),
        Kind(
            "revoked.json",
            certificates,
            lambda path: read_revocations(str(path), path.read_bytes(), path.with_name("authority.pem").read_bytes()),
        ),
        Kind("assigned.json", assigned, lambda path: saved_rig(path, path.parent)),
        Kind("kept.npz", kept, lambda path: read(path, SIZE, OWNER)),
        Kind("video.mp4", video, lambda path: (played(path), sought(path))),
        Kind("video.mkv", video, lambda path: (played(path), sought(path))),
        Kind("sound.mkv", video, lambda path: read_sound(path, 2.0)),
        Kind("empty.png", still, plate),
        Kind("1.jpg", still, folder_of_pictures),
        Kind("board.bmp", still, probes_of_pictures),
        Kind("pictures.npy", pictures, rendered.opened),
        Kind(
            AWAY,
            lambda path: write_away(path.parent, {"cam01": ("lab", "/films/x")}),
            lambda path: require_copied(path.parent),
        ),
        Kind(CAMERAS, of_text, lambda path: read_cameras(path.parent)),
        Kind("people.whl", wheel, from_file),
        Kind("costs.json", lambda path: write_costs(path, COSTS), read_costs),
    )
}


REACHED: Mapping[str, tuple[str, ...]] = {  # by kind: readers that are called for it
    "demo.toml": ("common.toml_file.read_toml",),
    "calibration.toml": ("common.camera.anipose.read_anipose",),
    "1.jpg": ("services.viewer.sources.images.read_picture",),
    "extri.yml": ("common.camera.opencv_storage.read_opencv",),
    "qualisys.qca.txt": ("common.camera.qualisys.read_qualisys",),
    "cam01.yaml": ("common.camera.ros_camera_info.read_ros_info",),
    "motion.bvh": ("common.formats.bvh_reader.read_bvh", "common.formats.bvh_joint_names.read_bvh_centres"),
    "motion.trc": ("common.formats.trc.read_trc", "common.formats.text_file.read_text"),
    "motion.c3d": ("common.formats.c3d_reader.read_c3d", "common.formats.text_file.read_apart"),
    "motion.mot": ("common.formats.mot.read_mot",),
    "posture.bvh": (
        "common.formats.motion_files.read_poses_for",
        "services.recognizer.training.example_files.read_track",
    ),
    "labels.csv": ("services.recognizer.training.label_table.read_table",),
    "assigned.json": ("services.camera.saved.read_saved",),
}
WITHOUT: Mapping[str, str] = {  # readers without a kind: why
    "common.cache.read_entry": "zenocap's own files with a digest, and a damaged one is none",
    "tools.measure.recorded_messages.read_messages": "made by the load test that reads it",
    "tools.cli.posture.tracked_sources.read_examples": "read_manifest, and read_features of each row",
    "tools.cli.posture.stream_report.read_streams": "read_manifest, and read_features of each row",
}


def readers_of_the_package() -> Iterator[str]:
    """Public functions `read`, `load`, `read_...` and `load_...` of modules that take a path."""
    for path in sources(ROOT, *PACKAGE):
        content = path.read_text(encoding="utf-8")
        if not re.search(r"^def (read|load)(_\w+)?\(", content, re.MULTILINE):
            continue
        for node in ast.parse(content).body:
            if isinstance(node, ast.FunctionDef) and re.fullmatch(r"(read|load)(_\w+)?", node.name):
                types = [each.annotation for each in (*node.args.posonlyargs, *node.args.args) if each.annotation]
                if any(isinstance(one, ast.Name) and one.id == "Path" for each in types for one in ast.walk(each)):
                    yield ".".join((*path.relative_to(ROOT).with_suffix("").parts, node.name))


def named_in(read: Callable[[Path], object]) -> Iterator[str]:
    """Functions of the package that the reader of a kind names."""
    if read.__module__ != __name__:
        yield f"{read.__module__}.{read.__name__}".removeprefix("zenocap.")
    elif isfunction(read):
        for name in read.__code__.co_names:
            if isfunction(one := globals().get(name)):
                yield from named_in(one)


def test_every_reader_of_the_package_has_a_kind_of_damaged_file() -> None:
    named = {name for kind in KINDS.values() for name in named_in(kind.read)}
    reached = {name for names in REACHED.values() for name in names}
    found = set(readers_of_the_package())
    assert found - named - reached == set(WITHOUT)
    assert len(found) > 35
    assert (reached - found, set(REACHED) - set(KINDS)) == (set(), set())


def test_the_page_states_how_many_files_are_damaged() -> None:
    page = (ROOT / "docs" / "machines.md").read_text(encoding="utf-8")
    assert f"{len(KINDS)} kinds of files, {SEEDS} mutations each" in page


@pytest.mark.slow
@pytest.mark.parametrize("name", REACHED)
def test_the_reader_of_a_kind_calls_the_readers_that_it_stands_for(tmp_path: Path, name: str) -> None:
    path, called = tmp_path / name, set[str]()
    KINDS[name].write(path)

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            called.add(f"{frame.f_globals.get('__name__', '')}.{frame.f_code.co_name}".removeprefix("zenocap."))

    before = sys.getprofile()
    sys.setprofile(note)
    try:
        KINDS[name].read(path)
    finally:
        sys.setprofile(before)
    assert set(REACHED[name]) <= called


def mutated(content: bytes, seed: int) -> bytes:
    """The content with a few bytes changed, cut, repeated, or replaced by what readers stumble over."""
    chance, data = random.Random(seed), bytearray(content)
    for _ in range(chance.choice((1, 1, 2, 4, 16))):
        at = chance.randrange(len(data) + 1)
        match chance.randrange(6):
            case 0 | 1 if at < len(data):
                data[at] = chance.randrange(256)
            case 2:
                data[at : at + chance.randrange(40)] = b""
            case 3:
                data[at:at] = data[at : at + chance.randrange(200)]
            case 4 if chance.random() < 0.2:
                del data[at:]
            case _:
                data[at : at + chance.randrange(4)] = chance.choice(TOKENS)
    return bytes(data)


def astray(kind: Kind, folder: Path, seeds: range) -> Iterator[str]:
    """Seeds whose content raised another exception than UserError, with that."""
    path = folder / kind.name
    kind.write(path)
    content = path.read_bytes()
    try:
        kind.read(path)  # the valid one
    except UserError as error:
        if kind.name not in ("people.whl", "lens.yml", AWAY):  # which are refused for what they are
            yield f"valid: {error}"
    for seed in seeds:
        path.write_bytes(mutated(content, seed))
        try:
            kind.read(path)
        except UserError as error:
            if not str(error).strip():
                yield f"{seed}: no text"
        except Exception as error:
            yield f"{seed}: {type(error).__name__}: {error}"[:300]


def changed(name: str, folder: Path, old: bytes, new: bytes) -> Path:
    """A valid file in which some bytes are others."""
    path = folder / name
    KINDS[name].write(path)
    content = path.read_bytes()
    assert content.count(old)
    path.write_bytes(content.replace(old, new))
    return path


def test_a_key_of_opencvs_files_that_is_no_text_is_refused(tmp_path: Path) -> None:
    path = changed("intri.yml", tmp_path, b"K_cam01", b"K_c\xffm01")
    with pytest.raises(UserError, match=rf"{path}: not OpenCV FileStorage \(%YAML:1.0\): 'utf-8' codec"):
        read_calibration(path.with_name("extri.yml"))


@pytest.mark.parametrize(("old", "new"), [(b'"studio"', b'"\xff"'), (b"{", b"[" * 100_000)])
def test_a_damaged_assignment_leaves_the_camera_free(tmp_path: Path, old: bytes, new: bytes) -> None:
    """It ended `viewer --discover` at every start."""
    path = changed("assigned.json", tmp_path, old, new)
    with pytest.raises(UserError, match=rf"{path}: no assignment of this version of zenocap: .*: remove it"):
        saved_rig(path, tmp_path)
    host = AssignedCamera(STREAM, path, lambda file: ["false"], ManualClock(), previews=False)
    assert host.used_by == ""


@pytest.mark.parametrize("repeated", ["x", "-1", "9" * 5000])
def test_a_part_with_a_damaged_number_of_repeated_messages_is_verified(tmp_path: Path, repeated: str) -> None:
    """A traceback ended `verify`: only the end of the file has a checksum of it."""
    part(tmp_path / "a.mcap", repeated)
    assert verify([tmp_path / "a.mcap"]).checked


@pytest.mark.parametrize("name", ["utf-9", "utf-7", "shift_jis"])
def test_an_encoding_that_the_parser_does_not_know_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.qca.txt"
    text(path, f'<?xml version="1.0" encoding="{name}"?>\n<calibration/>\n')
    with pytest.raises(UserError, match=rf"{path}: (not XML|no camera)"):
        read_calibration(path)


@pytest.mark.parametrize("name", ["a" * 300, "a\0b"])
def test_a_name_that_no_file_can_have_is_refused_in_a_manifest(tmp_path: Path, name: str) -> None:
    text(tmp_path / "examples.csv", f"source,posture\n{name}.bvh,sit\n")
    with pytest.raises(UserError, match=r"examples\.csv: line 2: source = .*: allowed: a file or folder that exists"):
        read_manifest(tmp_path / "examples.csv")


def test_a_damaged_compressed_background_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "kept.npz"
    kept(path)
    with np.load(path) as arrays:
        np.savez_compressed(path, **arrays)
    assert read(path, SIZE, OWNER).background.size == SIZE
    content = bytearray(path.read_bytes())
    for k in range(40, 300, 4):
        content[content.index(b"mean.npy") + k] ^= 255
    path.write_bytes(content)
    with pytest.raises(UserError, match=rf"{path}: no background model: "):
        read(path, SIZE, OWNER)


@pytest.mark.parametrize("opened", [VideoReader, lambda path: VideoReader(path, hardware=True), SeekableVideo])
def test_a_video_of_an_unknown_codec_is_refused(tmp_path: Path, opened: Callable[[Path], object]) -> None:
    path = changed("video.mkv", tmp_path, b"V_MPEG4/ISO/AVC", b"V_XPEG4/ISO/AVC")
    with pytest.raises(
        UserError, match=rf"{path}: a codec that this FFmpeg does not know: allowed: a video in another codec"
    ):
        opened(path)


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (PermissionError(13, "Permission denied", "/a\nb/take.mcap"), "error: /a\\nb/take.mcap: Permission denied\n"),
        (OSError(28, "No space left on device"), "error: No space left on device\n"),
        (MemoryError(), "error: out of memory: no more is allowed\n"),
        (MemoryError("Unable to allocate 2 GiB"), "error: out of memory: Unable to allocate 2 GiB\n"),
    ],
)
def test_errors_of_the_system_are_one_line_of_a_command(
    capsys: pytest.CaptureFixture[str], error: OSError | MemoryError, line: str
) -> None:
    with pytest.raises(typer.Exit) as ended, one_line_errors():
        raise error
    assert (ended.value.exit_code, capsys.readouterr().err) == (1, line)


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_a_damaged_file_is_refused_in_words(tmp_path: Path, name: str) -> None:
    assert list(astray(KINDS[name], tmp_path, range(FEW))) == []


@pytest.mark.nightly
@pytest.mark.parametrize("name", KINDS)
def test_a_file_damaged_in_many_ways_is_refused_in_words(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is read in a process of its own is read in a forked one: a start takes longer than all the rest."""
    monkeypatch.setattr(text_file, "subprocess", forked_readers.SUBPROCESS)
    assert list(astray(KINDS[name], tmp_path, range(FEW, SEEDS))) == []
