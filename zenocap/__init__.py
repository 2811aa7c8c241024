"""Real-time, markerless human motion capture from ordinary fixed cameras.

The public interface is what this module lists in `__all__`:

- `track(videos, ...)` tracks a folder or a list of videos offline and writes a take;
- `open_take(path)` reads poses, joint centres and angles of a take as numpy arrays;
- `subscribe(rig)` receives the poses of a running rig, as an iterator and as an asynchronous iterator;
- `Rig.load(path)` reads a rig file or a folder of videos; `demo_rig()` returns a rig of two simulated cameras.

A package that extends zenocap (docs/extend.md) also uses the row types of its tables, and the types that their fields name:

- `zenocap.common.rig.source_kinds.SourceKind`, `zenocap.common.rig.outputs.OutputKind`;
- `zenocap.common.rig.detectors.Detector`, `zenocap.common.rig.methods.Method`;
- `zenocap.common.formats.export_format.ExportFormat`, `zenocap.common.formats.import_format.ImportFormat`;
- `zenocap.common.camera.calibration_layouts.CalibrationLayout`.

Errors that a user can put right are `UserError`s, whose text names file, key, value and what is allowed.  Everything else
in the package may change without notice.
"""

import os
from importlib import import_module
from typing import TYPE_CHECKING

from zenocap.common.processor import instructions

instructions()  # before numpy is first imported: the same bytes on every x86-64 processor
# Matrices here are small; several BLAS threads per matrix would only wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is first imported
# A picture above LARGEST_PX of `common.arrays` is refused by its header, before memory is taken.
os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(1 << 26))  # read when OpenCV is first imported

if TYPE_CHECKING:
    from zenocap.common.errors import UserError
    from zenocap.common.rig.rig import Rig, demo_rig
    from zenocap.live import LivePose, Subscription, subscribe
    from zenocap.offline import track
    from zenocap.take import Poses, Take, open_take

__all__ = [
    "LivePose", "Poses", "Rig", "Subscription", "Take", "UserError", "demo_rig", "open_take", "subscribe", "track",
]  # fmt: skip

# Loaded on first use: `zenocap --help` and a viewer's process need none of them.
_HOMES = {
    "LivePose": "zenocap.live", "Poses": "zenocap.take", "Rig": "zenocap.common.rig.rig", "Subscription": "zenocap.live",
    "Take": "zenocap.take", "UserError": "zenocap.common.errors", "demo_rig": "zenocap.common.rig.rig",
    "open_take": "zenocap.take", "subscribe": "zenocap.live", "track": "zenocap.offline",
}  # fmt: skip


def __getattr__(name: str) -> object:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module 'zenocap' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
