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
from zenocap.common.formats.foxglove import plots, scene
from zenocap.common.formats.foxglove.cameras import bilevel_png, calibration
from zenocap.common.formats.foxglove.channels import FoxgloveMessage
from zenocap.common.formats.foxglove.scene import Figure, body_transforms, deletion, fixed_transforms, placed, timestamp

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
        self._placed: dict[str, scene.Placed] = {}  # computed once: any program may invent cameras
        self._fixed_published = False
        self._shown = self._tracked = False
        at_rest = Bdp(np.zeros((len(anatomy.parts), 3)), np.zeros((len(anatomy.joints), 3)))
        # Compiles, or loads the compiled code, before poses arrive.
        part_frames(anatomy, at_rest, Pose(np.zeros(3), anatomy.neutral))

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
        self._tracked = self._tracked or isinstance(message, m.TrackerBdp | m.TrackerPose)
        match message:
            case m.UniversalBdp() | m.UniversalBap() if self._tracked:
                pass  # of a rig with both methods: there is one figure, the tracker's
            case m.UniversalBap(lost=limbs):
                plot = self._message(self._pose_template, plots.pose_json(message))
                yield from self._pose(message, plot, "person" in limbs, limbs)
            case m.TrackerPose(lost=lost, lost_limbs=limbs):
                plot = self._message(self._pose_template, plots.tracker_json(message))
                yield from self._pose(message, plot, lost, limbs)
            case m.ScenePoints():
                yield self._message(to.POINTS, _cloud(message))
            case m.Posture():
                yield from self._posture(message)
            case m.Verdict():
                yield self._message(to.VERDICT, plots.verdict_json(message))
            case m.Silhouette() | m.Sighting() | m.CameraInfo() | m.Preview():
                yield from self._of_viewer(message)
            case m.UniversalBdp(body=body) | m.TrackerBdp(body=body):
                self._figure = None
                self._anatomy = anatomy_of(body)
                self._pose_template = to.pose_template(self._anatomy)
                self._figure = Figure(self._anatomy, bdp_of(self._anatomy, body))
            case m.Health(service=service, id=id):
                yield self._message(to.HEALTH, plots.health_json(message), service=service, id=id)
            case _:
                pass

    def _message(self, template: to.ChannelTemplate, data: bytes, **names: str) -> FoxgloveMessage:
        return FoxgloveMessage(template.channel(rig=self._rig, **names), data)

    def _of_viewer(self, message: m.Silhouette | m.Sighting | m.CameraInfo | m.Preview) -> Iterator[FoxgloveMessage]:
        match message:
            case m.Silhouette():
                yield self._silhouette(message)
            case m.Sighting(viewer=viewer):
                yield self._message(to.SIGHTING, plots.sighting_json(message), viewer=viewer)
            case m.CameraInfo():
                yield from self._camera(message)
            case m.Preview(viewer=viewer):
                yield self._message(to.PREVIEW, _image(message, message.jpeg, "jpeg"), viewer=viewer)

    def _pose(
        self, bap: m.UniversalBap | m.TrackerPose, plot: FoxgloveMessage, lost: bool, lost_limbs: list[str]
    ) -> Iterator[FoxgloveMessage]:
        stamp = timestamp(bap.captured_ns)
        yield plot
        if lost:
            if self._shown:
                self._shown = False
                yield self._message(to.SCENE, deletion(stamp).encode())
            return
        joints = [fox.JointState(name=name, position=angle) for name, angle in bap.angles.items()]
        yield self._message(to.JOINTS, fox.JointStates(timestamp=stamp, joints=joints).encode())
        figure, anatomy = self._figure, self._anatomy
        if figure is None:
            return
        part_to_world = part_frames(anatomy, figure.bdp, pose_of(anatomy, bap))
        transforms = body_transforms(anatomy, figure.bdp.offsets, part_to_world, stamp)
        yield self._message(to.BODY, fox.FrameTransforms(transforms=transforms).encode())
        yield self._message(to.SCENE, figure.shown(part_to_world, lost_limbs, stamp).encode())
        self._shown = True

    def _posture(self, posture: m.Posture) -> Iterator[FoxgloveMessage]:
        """A posture as numbers, and as a line of the log."""
        yield self._message(to.POSTURE, plots.posture_json(posture))
        lasted_s = (posture.end_ns - posture.start_ns) / 1e9
        line = fox.Log(
            timestamp=timestamp(posture.captured_ns),
            level=fox.LogLevel.Info,
            message=f"{plots.posture_label(posture)}, {lasted_s:.1f} s",
            name="recognizer",
        )
        yield self._message(to.EVENTS, line.encode())

    def _silhouette(self, silhouette: m.Silhouette) -> FoxgloveMessage:
        png = bilevel_png(silhouette.size, silhouette.region, silhouette.data)
        return self._message(to.SILHOUETTE, _image(silhouette, png, "png"), viewer=silhouette.viewer)

    def _camera(self, camera: m.CameraInfo) -> Iterator[FoxgloveMessage]:
        """Calibration and fixed frames of a camera, only when it has changed: viewers repeat it for late joiners."""
        if self._cameras.get(camera.viewer) == camera:
            return
        yield self._message(to.CALIBRATION, calibration(camera).encode(), viewer=camera.viewer)
        self._cameras[camera.viewer], self._placed[camera.viewer] = camera, placed(camera)
        yield self._fixed(camera.captured_ns)

    def _fixed(self, captured_ns: int) -> FoxgloveMessage:
        """All fixed frames in one message, for readers that start in the middle of a file."""
        transforms = fixed_transforms(self._placed.values(), timestamp(captured_ns))
        self._fixed_published = True
        return self._message(to.FIXED, fox.FrameTransforms(transforms=transforms).encode())


def _cloud(message: m.ScenePoints) -> bytes:
    kind = fox.PackedElementFieldNumericType.Float32
    fields = [fox.PackedElementField(name=axis, offset=4 * k, type=kind) for k, axis in enumerate("xyz")]
    return fox.PointCloud(
        timestamp=timestamp(message.captured_ns), frame_id=to.WORLD, pose=AT_ORIGIN, point_stride=12, fields=fields,
        data=points_of(message).astype("<f4").tobytes(),
    ).encode()  # fmt: skip


def _image(message: m.Silhouette | m.Preview, data: bytes, format: str) -> bytes:
    stamp, frame_id = timestamp(message.captured_ns), to.camera_frame(message.viewer)
    return fox.CompressedImage(timestamp=stamp, frame_id=frame_id, data=data, format=format).encode()
