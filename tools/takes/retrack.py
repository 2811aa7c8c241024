"""Tracking of a take's silhouettes again, with another set-up.

Everything that the viewers published is copied byte for byte, at its own time, and the tracker and the recognizer run on it
again.  With the set-up of the take itself, a take of `zenocap track` becomes itself again.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import cast

from zenocap.common import messages as m
from zenocap.common import topics
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Envelope
from zenocap.common.errors import UserError
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.observe.account import METADATA
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import (
    PARAMETERS_FILE,
    POSTURES_FILE,
    PRIOR_FILE,
    SETUP_FILE,
    RecordedRig,
    write_parameters,
    write_setup,
)
from zenocap.common.recording.writer import Attachment, Recording, RecordingError, no_conversion
from zenocap.common.runtime.clock import ManualClock
from zenocap.common.runtime.service import Service
from zenocap.common.runtime.service_info import versions
from zenocap.common.session.session import Session
from zenocap.common.topics import service_at
from zenocap.services.tracker import shell as tracker_shell
from zenocap.services.viewer.frame import Frame
from zenocap.tools.parameters import service_parameters
from zenocap.tools.takes.members import recorded_recognizer, tracker_setup
from zenocap.tools.takes.take_writer import TakeWriter

# Not the detail of an overloaded tracker: now there is time for all points.
INPUTS = (topics.SILHOUETTE, topics.CAMERA, topics.HEALTH, topics.FRAME_RATE, topics.CAMERA_DELAYS, topics.REQUEST)
OUTPUTS = (topics.TRACKER_BDP, topics.TRACKER_POSE, topics.SCENE_POINTS, topics.POSTURE, topics.HANDLED)
MEDIA_TYPES = {PRIOR_FILE: "application/octet-stream", POSTURES_FILE: "application/octet-stream"}


def retrack(
    source: Path, rig: RecordedRig, open_take: Callable[[], Recording],
    on_message: Callable[[m.Message], None] = lambda _: None,
) -> Recording:  # fmt: skip
    """Write the take that the tracker and the recognizer of `rig` make of the silhouettes of the take `source`.

    on_message: gets every message of the tracker and the recognizer, in order.  Raises UserError, RecordingError, and
    ValueError for another prior or model than the recorded one.
    """
    take = TakeReader(source)
    received = take.envelopes(invalid="raise")
    first = next(received, None)
    if first is None:
        raise UserError(f"{source}: no message of zenocap in it")
    clock = ManualClock(first.received_ns)
    services = _services(source, rig, take.attachments)
    session = Session(rig.name, clock, services, OUTPUTS)
    again = {(one.name, one.id) for one in services}
    recording = open_take()
    with TakeWriter(recording, rig.name) as writer:

        def record(made: Sequence[Envelope]) -> None:
            for one in made:
                writer.record(one)
                on_message(one.message)

        for one in chain([first], received):
            clock.set(max(clock.now_ns(), one.received_ns))
            service = service_at(one.key)
            if one.topic in (topics.BOTH_WAYS_POSE, topics.VERDICT):
                continue
            if service in again:
                if one.topic is topics.HANDLED:
                    record(session.report(service))
                continue
            writer.record(one)
            if one.topic in INPUTS:
                record(session.replay(one))
        record(session.report())
        writer.judge(clock.now_ns())
    if recording.failure:
        raise RecordingError(recording.failure)
    return recording


def take_like(
    source: TakeReader, rig: RecordedRig, path: Path, start_ns: int, metadata: Mapping[str, Mapping[str, str]]
) -> Recording:
    """Open a take with the files of another one, with another set-up.  source: read to its end.  metadata: additional.

    start_ns: time of the attachments.  Raises RecordingError.
    """
    files = []
    for name, data in source.attachments.items():
        if name == SETUP_FILE:
            files.append(Attachment(name, "application/json", write_setup(rig)))
        elif name == PARAMETERS_FILE:
            files.append(Attachment(name, "application/json", write_parameters(service_parameters(rig))))
        else:
            files.append(Attachment(name, MEDIA_TYPES.get(name, "text/plain"), data))
    own = ("zenocap", "versions", METADATA)  # of the new file; it has no log, and so no account
    kept = {name: values for name, values in source.metadata.items() if name not in own}
    return Recording(
        path, rig=rig.name, start_ns=start_ns, metadata={"versions": versions()} | kept | dict(metadata),
        attachments=tuple(files), overwrite=True,
        convert=FoxgloveConverter(TEN_PARTS, rig.name).convert if has_foxglove(source.path) else no_conversion,
    )  # fmt: skip


def has_foxglove(path: Path) -> bool:
    """Whether a take has channels of Foxglove beside its own; those of the first camera come first."""
    keys = (recorded.topic for recorded in TakeReader(path).messages())
    first = next((key for key in keys if key.startswith("foxglove/") or key.endswith("/silhouette")), "")
    return first.startswith("foxglove/")


def _services(source: Path, rig: RecordedRig, attached: Mapping[str, bytes]) -> list[Service[object, object, Frame]]:
    """The services that run again; the recognizer only where its model is in the take."""
    services: list[object] = [tracker_shell.service_of(tracker_setup(rig, source, attached))]
    if rig.recognizer is not None and rig.recognizer.source == "tracker":
        recognizer = recorded_recognizer(rig, source, attached)
        services += [] if recognizer is None else [recognizer]
    return cast("list[Service[object, object, Frame]]", services)
