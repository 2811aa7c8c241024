"""Table of detectors of people in images, and their model files, which are not shipped."""

import hashlib
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, cast

from zenocap.common.errors import UserError
from zenocap.common.table import Table, attribute

NOTE = "LICENCE.txt"  # beside the files


class ModelError(UserError):
    """A model file is missing, or is another one."""


@dataclass(frozen=True)
class ModelFile:
    """sha256: of its content."""

    name: str
    sha256: str

    def is_content(self, content: bytes) -> bool:
        return hashlib.sha256(content).hexdigest() == self.sha256


@dataclass(frozen=True)
class Detector:
    """What finds people in an image.

    load: "module:function", called with the contents of the files, in their order; returns what finds, for one thread at a
    time.  finds "mask": a function of a picture (side, side, 3) uint8 BGR that gives the probabilities of a person, (side,
    side) float32 in [0, 1].  finds "points": one of an image (height, width, 3) uint8 BGR and a box (left, top, right,
    bottom) around a person, px, that gives the points (n, 2), px, and how visible each is, (n,) in [0, 1].
    points: names of these points, in their order.  option: key and value in the rig file with which a viewer uses it.
    files: model files that are not shipped; without any, what follows has no meaning.
    get: "module:function", called with a file of the user, or None to fetch it; returns the contents.  Raises UserError.
    licence: note that is kept beside the files.  costs: of getting them, in words.
    """

    name: str
    finds: Literal["mask", "points"]
    load: str
    points: tuple[str, ...] = ()
    option: str = ""
    files: tuple[ModelFile, ...] = ()
    get: str = ""
    licence: str = ""
    costs: str = ""

    @property
    def folder(self) -> Path:
        """Of its files, in the data folder of the user who runs this (`zenocap/models`, XDG rules); it may not exist."""
        home = os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share"
        return Path(home) / "zenocap" / "models" / self.name

    @property
    def digest(self) -> str:
        """Of all its files; names the detector in what it has found."""
        return hashlib.sha256("".join(file.sha256 for file in self.files).encode()).hexdigest()

    def loaded(self) -> object:
        """What finds people, see `load`.  Raises ModelError."""
        return cast("Callable[..., object]", attribute(self.load))(*map(self._content, self.files))

    def contents(self, file: Path | None) -> Sequence[bytes]:
        """The contents of the files, from a file of the user, or fetched.  Raises UserError."""
        return cast("Callable[[Path | None], Sequence[bytes]]", attribute(self.get))(file)

    def _content(self, file: ModelFile) -> bytes:
        path, command = self.folder / file.name, f"`zenocap models add {self.name}`"
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            raise ModelError(f"{self.option}: no model file {path}: {command} gets it ({self.costs})") from None
        except OSError as error:
            raise ModelError(f"{self.option}: {path}: {error.strerror or error}") from error
        if not file.is_content(content):
            wrong = f"damaged, or another file: allowed: SHA-256 {file.sha256}; {command} replaces it"
            raise ModelError(f"{self.option}: {path}: {wrong}")
        return content


SELFIE = ModelFile("selfie_segmentation.tflite", "9ee168ec7c8f2a16c56fe8e1cfbc514974cbbb7e434051b455635f1bd1462f5c")
PEOPLE = Detector(
    "people",
    "mask",
    "zenocap.services.viewer.people.network:loaded",
    option="people = true",
    files=(SELFIE,),
    get="zenocap.tools.setup.models.wheel:contents",
    licence=f"""{SELFIE.name}: the general model of MediaPipe Selfie Segmentation.
Copyright The MediaPipe Authors.  Licensed under the Apache License, Version 2.0; text: the file LICENSE of zenocap, or
https://www.apache.org/licenses/LICENSE-2.0
Taken unchanged from a wheel of the package mediapipe.  SHA-256 {SELFIE.sha256}
""",
    costs="0.25 MB kept, 36 MB fetched",
)

DETECTORS = Table(Detector, "zenocap.detectors", {"people": f"{__name__}:PEOPLE"})
