"""Opening the take of a rig, with its metadata and attachments."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.recording import setup_file
from zenocap.common.recording.parts import PartLimits, Parts, take_path
from zenocap.common.recording.setup_file import Parameters
from zenocap.common.recording.writer import LOG, OPENED, Attachment, Recording, no_conversion
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.services import services_of
from zenocap.common.runtime.service_info import versions


def new_parts(
    rig: Rig, path: Path, start_ns: int, parameters: Parameters, elapsed_ns: Callable[[], int], *, must_open: bool = True
) -> Parts:
    """Open the take of a rig, in parts if the rig sets them.  parameters: of the services of the rig.

    elapsed_ns: of the machine's monotonic clock, for the order of takes.  must_open, errors: see `Parts`.
    """
    files = attachments(rig, parameters)

    def open_part(path: Path, start_ns: int, part: Mapping[str, str] | None) -> Recording:
        of_log = {LOG: {OPENED: str(elapsed_ns())}} | ({"part": part} if part else {})
        return _recording(rig, path, start_ns, files, of_log=of_log)

    named_by_time = path.name.startswith(f"{rig.name}-")
    return Parts(
        open_part, path, start_ns, PartLimits.of(rig.log.part_mb, rig.log.part_minutes),
        (lambda now_ns: take_path(rig.name, path.parent, now_ns)) if named_by_time else None, must_open=must_open,
    )  # fmt: skip


def new_recording(rig: Rig, path: Path, start_ns: int, parameters: Parameters, *, overwrite: bool = False) -> Recording:
    """Open the take of a rig as one file.  parameters: of the services of the rig.  Raises RecordingError."""
    return _recording(rig, path, start_ns, attachments(rig, parameters), overwrite=overwrite)


def _recording(
    rig: Rig, path: Path, start_ns: int, files: tuple[Attachment, ...], *, overwrite: bool = False,
    of_log: Mapping[str, Mapping[str, str]] = MappingProxyType({}),
) -> Recording:  # fmt: skip
    """of_log: further metadata."""
    about = {"name": rig.name, "method": rig.method, "digest": rig.digest}
    if rig.height_estimated:
        about["person_height"] = f"{rig.person_height:.2f} m, estimated"
    metadata = {"versions": versions(), "rig": about}
    return Recording(
        path, rig=rig.name, start_ns=start_ns, metadata={**metadata, **of_log}, attachments=files, overwrite=overwrite,
        own=services_of(rig),
        convert=FoxgloveConverter(TEN_PARTS, rig.name).convert if rig.log.foxglove else no_conversion,
    )  # fmt: skip


def attachments(rig: Rig, parameters: Parameters) -> tuple[Attachment, ...]:
    """Files of a rig, the setup of its steps, the parameters of its services (none if empty), and its models."""
    setup = Attachment(setup_file.SETUP_FILE, "application/json", setup_file.write_setup(setup_file.recorded_rig(rig)))
    contents = ((setup_file.PRIOR_FILE, setup_file.prior_of(rig)), (setup_file.POSTURES_FILE, setup_file.postures_of(rig)))
    models = (Attachment(name, "application/octet-stream", content) for name, content in contents if content is not None)
    written = setup_file.write_parameters(parameters)
    values = [Attachment(setup_file.PARAMETERS_FILE, "application/json", written)] if parameters else []
    return (*(Attachment(file.name, "text/plain", file.read_bytes()) for file in rig.files), setup, *values, *models)
