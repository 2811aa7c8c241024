"""Messages that viewers publish of a scene: cameras and silhouettes."""

from collections.abc import Iterator

from benchmarks.simulated_clip import SIZE
from benchmarks.verdict.faults import Scene
from zenocap.common import messages as m
from zenocap.common.arrays import Mask
from zenocap.common.bus.protocol import Envelope
from zenocap.common.topics import topic_of
from zenocap.common.vision.mask_codec import pack

RIG = "demo"
EPOCH_NS = 1_000_000_000_000_000_000


def camera_messages(scene: Scene) -> Iterator[m.Message]:
    for view, camera in scene.cameras.items():
        yield m.CameraInfo(
            frame=0, captured_ns=EPOCH_NS, viewer=view, name=camera.name, size=camera.size,
            matrix=camera.matrix.ravel().tolist(), distortions=camera.distortions.ravel().tolist(),
            rotation=camera.rotation.ravel().tolist(), translation=camera.translation.ravel().tolist(),
        )  # fmt: skip


def silhouette(view: str, frame: int, captured_ns: int, mask: Mask) -> m.Silhouette:
    """mask: (height, width), not 0 on the person."""
    region, data = pack(mask)
    return m.Silhouette(frame=frame, captured_ns=captured_ns, viewer=view, size=SIZE, region=region, data=data)


def envelope(message: m.Message) -> Envelope:
    """The message as it is received."""
    topic = topic_of(type(message))
    names = {name: getattr(message, name) for name in ("viewer", "service", "id") if hasattr(message, name)}
    return Envelope(topic.at(RIG, **names), topic, message, message.captured_ns)
