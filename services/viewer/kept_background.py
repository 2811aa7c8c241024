"""Kept background of a viewer: its file, taken up again after a restart.

A two-view viewer cannot: its takes are recomputed from the number of frames in which the background was learnt.
"""

import hashlib
import logging
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlsplit

from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Rig
from zenocap.common.rig.viewers import Viewer
from zenocap.common.vision.adaptive.model import Adaptive
from zenocap.common.vision.adaptive.saved import Owner, packed, read, write
from zenocap.services.viewer.parameters import BACKGROUNDS, KEEP_S
from zenocap.services.viewer.step import Segmenting, SilhouetteState

logger = logging.getLogger(__name__)


def kept_path(rig: Rig, viewer: Viewer) -> Path:
    """File of a viewer's background.  No name of a rig or viewer has a +, so that no two viewers have the same file."""
    return rig.base / BACKGROUNDS / f"{rig.name}+{viewer.id}.npz"


def owner_of(rig: Rig, viewer: Viewer) -> Owner:
    """What the file of a viewer's background belongs to.  User and password of an address have no influence."""
    parts = urlsplit(viewer.source.text)
    text = parts._replace(netloc=parts.netloc.rpartition("@")[2]).geturl()
    return Owner(rig.name, viewer.id, hashlib.sha256(text.encode()).hexdigest())


def read_kept(rig: Rig, viewer: Viewer) -> Adaptive | None:
    """The kept model; None where there is none, or, with a warning, where it is of no use."""
    path = kept_path(rig, viewer)
    if not path.exists():
        ambiguous = path.with_name(f"{rig.name}-{viewer.id}.npz")
        if ambiguous.exists():
            logger.warning(
                "%s: of an earlier version, in which two viewers could have the same file: not used, and may be deleted; "
                "the background is learnt again and kept in %s", ambiguous, path.name,
            )  # fmt: skip
        return None
    try:
        return read(path, viewer.camera.size, owner_of(rig, viewer))
    except UserError as error:
        logger.warning("%s; the background is learnt again", error)
        return None


class BackgroundKeeper:
    """Writes the model of a viewer every KEEP_S and at the end.  Passed to `run` as `on_state`.

    kept: whether there was a model to be taken up.  clock: monotonic, seconds.
    """

    def __init__(self, path: Path, owner: Owner, kept: bool, clock: Callable[[], float]) -> None:
        self._path, self._owner, self._kept, self._clock = path, owner, kept, clock
        self._model: Adaptive | None = None
        self._due_s: float | None = None
        self._writing: threading.Thread | None = None
        self._failure = ""

    def __call__(self, state: SilhouetteState) -> None:
        if not isinstance(state, Segmenting) or not isinstance(state.scene.background, Adaptive):
            return
        self._model, now_s = state.scene.background, self._clock()
        if self._due_s is None:
            self._report(state.scene.restored)
            self._due_s = now_s + KEEP_S
        elif now_s >= self._due_s and (self._writing is None or not self._writing.is_alive()):
            self._due_s = now_s + KEEP_S
            background = self._model.background  # its mean is changed in place
            model = replace(self._model, background=replace(background, mean=background.mean.copy()))
            self._writing = threading.Thread(target=self._write, args=(model,), name="background", daemon=True)
            self._writing.start()

    def close(self) -> None:
        """Write the last model."""
        if self._writing is not None:
            self._writing.join()
        if self._model is not None:
            self._write(self._model)

    def _report(self, restored: bool) -> None:
        if restored:
            logger.info("background of %s taken up again", self._path)
        elif self._kept:
            logger.warning(
                "the background of %s does not fit: the camera was moved, or more than a quarter of its image differs; "
                "it is learnt again", self._path,
            )  # fmt: skip

    def _write(self, model: Adaptive) -> None:
        """Write a model; a failure is logged once for each kind."""
        try:
            write(self._path, packed(model, self._owner))
            self._failure = ""
        except OSError as error:
            if str(error) != self._failure:
                self._failure = str(error)
                logger.warning("%s: %s: the background is not kept", self._path, error.strerror or error)
