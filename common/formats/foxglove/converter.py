"""Conversion of a rig's messages to Foxglove messages.

The world is Y up and 3-D panels are Z up: the frame `map`, which Lichtblick shows by default, is the world's parent,
rotated by a quarter turn.  Below `world` are the cameras (`viewer/1`) and the kinematic tree (`torso`, `head`,
`right_upper_arm` ...), each part in its parent.  All times are capture times.
"""

from collections.abc import Iterator

import foxglove.messages as fox
import numpy as np

from zenocap.common import messages as m
from zenocap.common.body.anatomy import Anatomy
from zenocap.common.body.definition import Bdp, Pose
from zenocap.common.body.kinematics import part_frames
from zenocap.common.bus.protocol import Envelope
from zenocap.common.conversion import anatomy_of, bdp_of, points_of, pose_of
from zenocap.common.formats.foxglove import channels as to
from zenocap.common.formats.foxglove.cameras import bilevel_png, calibration
from zenocap.common.formats.foxglove.channels import FoxgloveMessage
from zenocap.common.formats.foxglove.plots import (
    health_json,
    pose_json,
    posture_json,
    posture_label,
    sighting_json,
    tracker_json,
    verdict_json,
)
from zenocap.common.formats.foxglove.scene import Figure, body_transforms, deletion, fixed_transforms, timestamp

AT_ORIGIN = fox.Pose(position=fox.Vector3(x=0.0, y=0.0, z=0.0), orientation=fox.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0))


class FoxgloveConverter:
    """Converter for the Foxglove channels of one file.  Each file needs its own, so that it is self-contained.

    Deterministic: equal messages give equal bytes.
    """

    def __init__(self, anatomy: Anatomy, rig: str) -> None:
        self._anatomy = anatomy
        self._rig = rig
        self._pose_template = to.pose_template(anatomy)
        self._figure: Figure | None = None
        self._cameras: dict[str, m.CameraInfo] = {}
        self._fixed_published = False
        self._shown = False
        at_rest = Bdp(np.zeros((len(anatomy.parts), 3)), np.zeros((len(anatomy.joints), 3)))
        part_frames(
            anatomy, at_rest, Pose(np.zeros(3), anatomy.neutral)
        )  # compiles, or loads the compiled code, before poses arrive

    def convert(self, envelope: Envelope) -> list[FoxgloveMessage]:
        """Foxglove messages of a message, in order.

        Raises ValueError for a body of another anatomy or a damaged silhouette, and OverflowError for numbers beyond
        Foxglove's 32 bits, such as capture times after the year 2106.  Later messages are converted correctly.
        """
        try:
            return list(self._convert(envelope.message))
        except Exception:
            self._fixed_published = False  # it may be among the messages that are discarded
            raise

    def _convert(self, message: m.Message) -> Iterator[FoxgloveMessage]:
        if not self._fixed_published:
            yield self._fixed(message.captured_ns)
        match message:
            case m.UniversalBap(lost=limbs):
                plot = FoxgloveMessage(self._pose_template.channel(rig=self._rig), pose_json(message))
                yield from self._pose(message, plot, "person" in limbs, limbs)
            case m.TrackerPose(lost=lost):
                plot = FoxgloveMessage(self._pose_template.channel(rig=self._rig), tracker_json(message))
                yield from self._pose(message, plot, lost, [])
            case m.ScenePoints():
                yield FoxgloveMessage(to.POINTS.channel(rig=self._rig), _cloud(message))
            case m.Posture():
                yield from self._posture(message)
            case m.Verdict():
                yield FoxgloveMessage(to.VERDICT.channel(rig=self._rig), verdict_json(message))
            case m.Silhouette() | m.Sighting() | m.CameraInfo() | m.Preview():
                yield from self._of_viewer(message)
            case m.UniversalBdp(body=body) | m.TrackerBdp(body=body):
                self._figure = None
                self._anatomy = anatomy_of(body)
                self._pose_template = to.pose_template(self._anatomy)
                self._figure = Figure(self._anatomy, bdp_of(self._anatomy, body))
            case m.Health(service=service, id=id):
                yield FoxgloveMessage(to.HEALTH.channel(rig=self._rig, service=service, id=id), health_json(message))
            case _:
                pass

    def _of_viewer(self, message: m.Silhouette | m.Sighting | m.CameraInfo | m.Preview) -> Iterator[FoxgloveMessage]:
        match message:
            case m.Silhouette():
                yield self._silhouette(message)
            case m.Sighting(viewer=viewer):
                yield FoxgloveMessage(to.SIGHTING.channel(rig=self._rig, viewer=viewer), sighting_json(message))
            case m.CameraInfo():
                yield from self._camera(message)
            case m.Preview(viewer=viewer):
                yield FoxgloveMessage(
                    to.PREVIEW.channel(rig=self._rig, viewer=viewer),
                    _image(message.captured_ns, viewer, message.jpeg, "jpeg"),
                )

    def _pose(
        self, bap: m.UniversalBap | m.TrackerPose, plot: FoxgloveMessage, lost: bool, lost_limbs: list[str]
    ) -> Iterator[FoxgloveMessage]:
        stamp = timestamp(bap.captured_ns)
        yield plot
        if lost:
            if self._shown:
                self._shown = False
                yield FoxgloveMessage(to.SCENE.channel(rig=self._rig), deletion(stamp).encode())
            return
        joints = [fox.JointState(name=name, position=angle) for name, angle in bap.angles.items()]
        yield FoxgloveMessage(to.JOINTS.channel(rig=self._rig), fox.JointStates(timestamp=stamp, joints=joints).encode())
        figure, anatomy = self._figure, self._anatomy
        if figure is None:
            return
        part_to_world = part_frames(anatomy, figure.bdp, pose_of(anatomy, bap))
        transforms = body_transforms(anatomy, figure.bdp.offsets, part_to_world, stamp)
        yield FoxgloveMessage(to.BODY.channel(rig=self._rig), fox.FrameTransforms(transforms=transforms).encode())
        yield FoxgloveMessage(to.SCENE.channel(rig=self._rig), figure.shown(part_to_world, lost_limbs, stamp).encode())
        self._shown = True

    def _posture(self, posture: m.Posture) -> Iterator[FoxgloveMessage]:
        """A posture as numbers, and as a line of the log."""
        yield FoxgloveMessage(to.POSTURE.channel(rig=self._rig), posture_json(posture))
        lasted_s = (posture.end_ns - posture.start_ns) / 1e9
        line = fox.Log(
            timestamp=timestamp(posture.captured_ns),
            level=fox.LogLevel.Info,
            message=f"{posture_label(posture)}, {lasted_s:.1f} s",
            name="recognizer",
        )
        yield FoxgloveMessage(to.EVENTS.channel(rig=self._rig), line.encode())

    def _silhouette(self, silhouette: m.Silhouette) -> FoxgloveMessage:
        viewer = silhouette.viewer
        png = bilevel_png(silhouette.size, silhouette.region, silhouette.data)
        return FoxgloveMessage(
            to.SILHOUETTE.channel(rig=self._rig, viewer=viewer), _image(silhouette.captured_ns, viewer, png, "png")
        )

    def _camera(self, camera: m.CameraInfo) -> Iterator[FoxgloveMessage]:
        """Calibration and fixed frames of a camera, only when it has changed: viewers repeat it for late joiners."""
        if self._cameras.get(camera.viewer) == camera:
            return
        yield FoxgloveMessage(to.CALIBRATION.channel(rig=self._rig, viewer=camera.viewer), calibration(camera).encode())
        self._cameras[camera.viewer] = camera
        yield self._fixed(camera.captured_ns)

    def _fixed(self, captured_ns: int) -> FoxgloveMessage:
        """All fixed frames in one message, for readers that start in the middle of a file."""
        transforms = fixed_transforms(list(self._cameras.values()), timestamp(captured_ns))
        self._fixed_published = True
        return FoxgloveMessage(to.FIXED.channel(rig=self._rig), fox.FrameTransforms(transforms=transforms).encode())


def _cloud(message: m.ScenePoints) -> bytes:
    kind = fox.PackedElementFieldNumericType.Float32
    fields = [fox.PackedElementField(name=axis, offset=4 * k, type=kind) for k, axis in enumerate("xyz")]
    return fox.PointCloud(
        timestamp=timestamp(message.captured_ns), frame_id=to.WORLD, pose=AT_ORIGIN, point_stride=12, fields=fields,
        data=points_of(message).astype("<f4").tobytes(),
    ).encode()  # fmt: skip


def _image(captured_ns: int, viewer: str, data: bytes, format: str) -> bytes:
    stamp = timestamp(captured_ns)
    frame_id = to.camera_frame(viewer)
    return fox.CompressedImage(timestamp=stamp, frame_id=frame_id, data=data, format=format).encode()
