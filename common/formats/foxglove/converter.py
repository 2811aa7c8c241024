"""From messages of a rig to what Foxglove and Lichtblick can show, one after the other.

The world is Y up, and 3-D panels are Z up: the frame `map` is the world's parent, turned by a quarter, and the one that
Lichtblick shows unasked, so that the person stands.  Below `world` are the cameras (`viewer/1`) and the kinematic tree
(`torso`, `head`, `right_upper_arm` ...), each part in its parent.  All times are capture times.
"""

from collections.abc import Iterator

import foxglove.messages as fox
import numpy as np

from common import messages as m
from common.body.anatomy import Anatomy
from common.body.definition import Bdp, Pose
from common.body.kinematics import part_frames
from common.bus.protocol import Envelope
from common.conversion import anatomy_of, angles_of, bdp_of, points_of
from common.formats.foxglove import channels as to
from common.formats.foxglove.bilevel import bilevel_png
from common.formats.foxglove.body import Figure, gone
from common.formats.foxglove.calibration import calibration
from common.formats.foxglove.channels import Beside
from common.formats.foxglove.frames import body_transforms, fixed_transforms, timestamp
from common.formats.foxglove.plots import health_json, pose_json, posture_json, posture_words, sighting_json, tracker_json

AT_ORIGIN = fox.Pose(position=fox.Vector3(x=0.0, y=0.0, z=0.0), orientation=fox.Quaternion(x=0.0, y=0.0, z=0.0, w=1.0))


class Foxglove:
    """The channels beside a rig's own, of one file: a second file needs a second object, so that it stands alone.

    It is deterministic: equal messages in give equal bytes out.
    """

    def __init__(self, anatomy: Anatomy, rig: str) -> None:
        self._anatomy = anatomy
        self._rig = rig
        self._pose_row = to.pose_row(anatomy)
        self._figure: Figure | None = None
        self._cameras: dict[str, m.CameraInfo] = {}
        self._fixed_known = False
        self._shown = False
        at_rest = Bdp(np.zeros((len(anatomy.parts), 3)), np.zeros((len(anatomy.joints), 3)))
        part_frames(anatomy, at_rest, Pose(np.zeros(3), anatomy.neutral))  # loads what is compiled, before poses come

    def beside(self, envelope: Envelope) -> list[Beside]:
        """What belongs beside this message, in order.

        Raises ValueError for a body of another anatomy or a damaged silhouette, and OverflowError for numbers beyond
        Foxglove's 32 bits, as of a capture time past the year 2106; what was said before stays valid.
        """
        try:
            return list(self._beside(envelope.message))
        except Exception:
            self._fixed_known = False  # it may be among what is not said now
            raise

    def _beside(self, message: m.Message) -> Iterator[Beside]:
        if not self._fixed_known:
            yield self._fixed(message.captured_ns)
        match message:
            case m.UniversalBap(lost=lost):
                plot = Beside(self._pose_row.channel(rig=self._rig), pose_json(message))
                yield from self._pose(message, plot, "person" in lost, lost)
            case m.TrackerPose(lost=gone):
                plot = Beside(self._pose_row.channel(rig=self._rig), tracker_json(message))
                yield from self._pose(message, plot, gone, [])
            case m.ScenePoints():
                yield Beside(to.POINTS.channel(rig=self._rig), _cloud(message))
            case m.Posture():
                yield from self._posture(message)
            case m.Silhouette():
                yield self._silhouette(message)
            case m.Sighting(viewer=viewer):
                yield Beside(to.SIGHTING.channel(rig=self._rig, viewer=viewer), sighting_json(message))
            case m.UniversalBdp(body=body) | m.TrackerBdp(body=body):
                self._figure = None
                self._anatomy = anatomy_of(body)
                self._pose_row = to.pose_row(self._anatomy)
                self._figure = Figure(self._anatomy, bdp_of(self._anatomy, body))
            case m.CameraInfo():
                yield from self._camera(message)
            case m.Preview(viewer=viewer):
                yield Beside(
                    to.PREVIEW.channel(rig=self._rig, viewer=viewer),
                    _image(message.captured_ns, viewer, message.jpeg, "jpeg"),
                )
            case m.Health(service=service, id=id):
                yield Beside(to.HEALTH.channel(rig=self._rig, service=service, id=id), health_json(message))
            case _:
                pass

    def _pose(self, bap: m.UniversalBap | m.TrackerPose, plot: Beside, lost: bool, searched: list[str]) -> Iterator[Beside]:
        stamp = timestamp(bap.captured_ns)
        yield plot
        if lost:
            if self._shown:
                self._shown = False
                yield Beside(to.SCENE.channel(rig=self._rig), gone(stamp).encode())
            return
        joints = [fox.JointState(name=name, position=angle) for name, angle in bap.angles.items()]
        yield Beside(to.JOINTS.channel(rig=self._rig), fox.JointStates(timestamp=stamp, joints=joints).encode())
        figure, anatomy = self._figure, self._anatomy
        if figure is None:
            return
        pose = Pose(np.array(bap.position), angles_of(anatomy, bap.angles, anatomy.neutral))
        part_to_world = part_frames(anatomy, figure.bdp, pose)
        transforms = body_transforms(anatomy, figure.bdp.offsets, part_to_world, stamp)
        yield Beside(to.BODY.channel(rig=self._rig), fox.FrameTransforms(transforms=transforms).encode())
        yield Beside(to.SCENE.channel(rig=self._rig), figure.shown(part_to_world, searched, stamp).encode())
        self._shown = True

    def _posture(self, posture: m.Posture) -> Iterator[Beside]:
        """As numbers, and as a line of the log."""
        yield Beside(to.POSTURE.channel(rig=self._rig), posture_json(posture))
        lasted_s = (posture.end_ns - posture.start_ns) / 1e9
        line = fox.Log(
            timestamp=timestamp(posture.captured_ns),
            level=fox.LogLevel.Info,
            message=f"{posture_words(posture)}, {lasted_s:.1f} s",
            name="recognizer",
        )
        yield Beside(to.EVENTS.channel(rig=self._rig), line.encode())

    def _silhouette(self, silhouette: m.Silhouette) -> Beside:
        viewer = silhouette.viewer
        png = bilevel_png(silhouette.size, silhouette.region, silhouette.data)
        return Beside(
            to.SILHOUETTE.channel(rig=self._rig, viewer=viewer), _image(silhouette.captured_ns, viewer, png, "png")
        )

    def _camera(self, camera: m.CameraInfo) -> Iterator[Beside]:
        """Said again only when it has changed: a camera keeps telling newcomers who it is."""
        if self._cameras.get(camera.viewer) == camera:
            return
        yield Beside(to.CALIBRATION.channel(rig=self._rig, viewer=camera.viewer), calibration(camera).encode())
        self._cameras[camera.viewer] = camera
        yield self._fixed(camera.captured_ns)

    def _fixed(self, captured_ns: int) -> Beside:
        """All that stands still, each time: a reader that starts in the middle looks for one message of a channel."""
        transforms = fixed_transforms(list(self._cameras.values()), timestamp(captured_ns))
        self._fixed_known = True
        return Beside(to.FIXED.channel(rig=self._rig), fox.FrameTransforms(transforms=transforms).encode())


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
