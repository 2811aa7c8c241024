"""`zenocap export --to opensim`: a folder to scale a model and find its motion."""

import shutil
from collections.abc import Container
from pathlib import Path
from tempfile import mkdtemp

import numpy as np

from zenocap.common.arrays import Floats
from zenocap.common.body.anatomy import FOURTEEN_PARTS
from zenocap.common.body.clinical_angles import segment_axes
from zenocap.common.body.definition import neutral_pose
from zenocap.common.body.joint_conventions import limb_of
from zenocap.common.body.keypoints import keypoints
from zenocap.common.body.kinematics import part_frames
from zenocap.common.errors import UserError
from zenocap.common.formats.export_format import ExportRequest
from zenocap.common.formats.opensim_coordinates import coordinates_of, warn_of_ranges
from zenocap.common.formats.opensim_model import read_model
from zenocap.common.formats.opensim_setup import PELVIS_TOP, ik_setup, marker_set, markers_of, scale_setup
from zenocap.common.formats.pose_track import PoseTrack
from zenocap.common.formats.trajectories import Trajectories
from zenocap.common.formats.trc import write_trc

FILES = {
    "model": "generic.osim", "markers": "markers.xml", "body_trc": "body.trc", "motion_trc": "motion.trc",
    "scale": "scale.xml", "scaled": "scaled.osim", "inverse_kinematics": "ik.xml", "ik": "ik.mot",
}  # fmt: skip
README = "README.txt"
FEET = ("RHeel", "RBigToe", "RSmallToe", "LHeel", "LBigToe", "LSmallToe")
TEXT = """\
{take}: OpenSim set-up, written by zenocap

Model: {model}. Smoothing: {smoothing}. Body: {sizes}.

    opensim-cmd run-tool scale.xml      writes scaled.osim, of the size of the tracked body
    opensim-cmd run-tool ik.xml         writes ik.mot, the coordinates of the model

or in Python, in this folder (pip install opensim):

    import opensim
    opensim.ScaleTool("scale.xml").run()
    opensim.InverseKinematicsTool("ik.xml").run()

body.trc: the tracked body in its neutral pose; its distances scale the model. motion.trc: the motion. Both in metres, X to
the front, Y up, Z to the right. Markers are joint centres, not skin markers: HJC, KJC, AJC: hip, knee, ankle; GH, EJC, WJC:
shoulder, elbow, wrist; R and L: the person's sides. Heel, BigToe and SmallToe are derived from the foot by published
offsets; PelvisTop is above the middle of the hips by their distance, along the tracked pelvis.

Mass is not known and not scaled: set it in scale.xml before you compute forces.
"""


def export(folder: Path, request: ExportRequest) -> tuple[str, ...]:
    """Write the folder, completely or not at all; return the names of the points that the model has no body for.

    Rows without a pose are left out.  Raises UserError, also for a folder that is not empty, and OSError.
    """
    track, model = request.track, request.model
    assert model is not None, "checked before"
    if track.anatomy is not FOURTEEN_PARTS:
        allowed = f"takes with the body {FOURTEEN_PARTS.name}, of zenocap track"
        raise UserError(f"{folder}: the take's body {track.anatomy.name} has no pelvis and feet: allowed: {allowed}")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise UserError(f"{folder}: exists: allowed: a new folder, or an empty one")
    if not track.known.any():
        raise UserError(f"{folder}: the person is lost in every frame: no row to write")
    generic = read_model(model)
    markers = markers_of(generic, model)
    warn_of_ranges(request.take, coordinates_of(track)[1])
    motion = _of_markers(points(track, request.min_confidence), markers)
    whole = body_points(track)
    body = _of_markers(whole, markers)
    times_s = float(motion.times_s[0]), float(motion.times_s[-1])
    folder.parent.mkdir(parents=True, exist_ok=True)
    unfinished = Path(mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    try:
        unfinished.chmod(0o755)
        shutil.copyfile(model, unfinished / FILES["model"])
        write_trc(unfinished / FILES["motion_trc"], motion, axes="opensim")
        write_trc(unfinished / FILES["body_trc"], body, axes="opensim")
        texts = {
            FILES["markers"]: marker_set({name: markers[name] for name in motion.names}),
            FILES["scale"]: scale_setup(generic, markers, FILES["body_trc"], FILES),
            FILES["inverse_kinematics"]: ik_setup(motion.names, times_s, FILES),
            README: TEXT.format(
                take=request.take, model=f"{generic.name} ({model.name})", smoothing=request.smoothing, sizes=request.sizes
            ),
        }
        for name, text in texts.items():
            (unfinished / name).write_text(text, encoding="utf-8", newline="\n")
        unfinished.replace(folder)
    except BaseException:
        shutil.rmtree(unfinished, ignore_errors=True)
        raise
    return tuple(name for name in whole.names if name not in markers)


def points(track: PoseTrack, min_confidence: float = 0.0) -> Trajectories:
    """Points of the markers in the rows with a pose: ISB joint centres, feet of HALPE-26, and PelvisTop."""
    known = np.flatnonzero(track.known)
    anatomy, bdp = track.anatomy, track.bdp
    centres, feet = keypoints("isb", anatomy, bdp), keypoints("halpe", anatomy, bdp)
    columns = [feet.names.index(name) for name in FEET]
    names = (*centres.names, *FEET, PELVIS_TOP)
    found = np.empty((len(known), len(names), 3))
    for row, at in enumerate(known):
        pose = track.pose(int(at))
        joints = centres.at(pose)
        hips = joints[[names.index("RHJC"), names.index("LHJC")]]
        pelvis = part_frames(anatomy, bdp, pose)[anatomy.index["pelvis"], :, :3]
        up: Floats = pelvis @ segment_axes("pelvis")[:, 1]
        top = hips.mean(axis=0) + float(np.linalg.norm(hips[0] - hips[1])) * up
        found[row] = np.concatenate([joints, feet.at(pose)[columns], top[None]])
    for limb, confidence in track.limbs.items():
        of_limb = np.array([limb_of(name) == limb for name in names])
        found[(confidence[known] < min_confidence)[:, None] & of_limb] = np.nan
    return Trajectories(names, track.frames[known], track.times_s[known], found, round(track.rate, 3))


def body_points(track: PoseTrack) -> Trajectories:
    """Points of the tracked body in its neutral pose, for two instants, 0 and 1 s, as a static trial."""
    pose = neutral_pose(track.anatomy, np.array([0.0, 1.0, 0.0]))
    still = PoseTrack(
        track.anatomy, track.bdp, np.array([0, 1]), np.array([0.0, 1.0]), np.tile(pose.position, (2, 1)),
        np.tile(pose.angles, (2, 1)), {}, {}, ("", ""), 1.0,
    )  # fmt: skip
    return points(still)


def _of_markers(data: Trajectories, markers: Container[str]) -> Trajectories:
    """Trajectories of the points that the model has."""
    kept = [k for k, name in enumerate(data.names) if name in markers]
    names = tuple(data.names[k] for k in kept)
    return Trajectories(names, data.frames, data.times_s, data.points[:, kept], data.rate)
