"""Opening the take of a rig: what every file of it carries."""

from collections.abc import Mapping
from pathlib import Path

from common.body.anatomy import TEN_PARTS
from common.formats.foxglove.converter import Foxglove
from common.runtime.rig import Rig
from common.runtime.versions import versions
from common.take.naming import take_path
from common.take.parts import PartLimits, Parts
from common.take.recording import Attachment, Recording, nothing_beside
from common.take.setup import POSTURES_FILE, PRIOR_FILE, SETUP_FILE, postures_of, prior_of, recorded_rig, write_setup


def new_parts(rig: Rig, path: Path, start_ns: int, *, must_open: bool = True, limits: PartLimits | None = None) -> Parts:
    """The take of a rig, in parts when the rig or `limits` asks for them.  Raises RecordingError as `Parts` does."""
    files = attachments(rig)

    def open_part(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
        return new_recording(rig, path, start_ns, part=part, files=files)

    named_by_time = path.name.startswith(f"{rig.name}-")
    return Parts(
        open_part,
        path,
        start_ns,
        PartLimits.of(rig.log.part_mb, rig.log.part_minutes) if limits is None else limits,
        (lambda now_ns: take_path(rig.name, path.parent, now_ns)) if named_by_time else None,
        must_open=must_open,
    )


def new_recording(
    rig: Rig,
    path: Path,
    start_ns: int,
    *,
    overwrite: bool = False,
    part: Mapping[str, str] | None = None,
    files: tuple[Attachment, ...] | None = None,
) -> Recording:
    """A take that carries its rig, its calibration and the versions it was made with.  Raises RecordingError.

    part: metadata of a part of a take.  files: the rig's `attachments`, where they have been read before.
    """
    metadata = {"versions": versions(), "rig": {"name": rig.name, "method": rig.method, "digest": rig.digest}}
    return Recording(
        path,
        rig=rig.name,
        start_ns=start_ns,
        metadata=metadata | ({"part": part} if part else {}),
        attachments=attachments(rig) if files is None else files,
        overwrite=overwrite,
        beside=Foxglove(TEN_PARTS, rig.name).beside if rig.log.foxglove else nothing_beside,
    )


def attachments(rig: Rig) -> tuple[Attachment, ...]:
    """The files of a rig, and what its steps are set up with."""
    setup = Attachment(SETUP_FILE, "application/json", write_setup(recorded_rig(rig)))
    learnt = ((PRIOR_FILE, prior_of(rig)), (POSTURES_FILE, postures_of(rig)))
    models = (Attachment(name, "application/octet-stream", content) for name, content in learnt if content is not None)
    return (*(Attachment(file.name, "text/plain", file.read_bytes()) for file in rig.files), setup, *models)
