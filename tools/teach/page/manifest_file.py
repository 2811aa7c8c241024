"""Manifest of a page: written after every change, never over what another program has written."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from zenocap.common.errors import UserError
from zenocap.services.recognizer.training.manifest import COLUMNS, ManifestRow, read_manifest, write_manifest

NAME, SUFFIX, MODEL_SUFFIX = "examples.csv", ".csv", ".postures"
FIRST_LINE = 2  # of the rows, after the names of the columns


class ChangedOnDiskError(UserError):
    """Another program has written the manifest."""


class ManifestFile:
    """The file at `path`, and its content as this page has read or written it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._content: bytes | None = None

    @property
    def model(self) -> Path:
        """Model that is trained from the manifest: beside it, of the same name."""
        return self.path.with_suffix(MODEL_SUFFIX)

    def read(self) -> list[ManifestRow]:
        """Rows of the file; none where it does not exist, or has no row.  Raises UserError."""
        content = self._on_disk()
        rows: list[ManifestRow] = []
        if content is not None and content.decode("utf-8-sig", "replace").strip() != ",".join(COLUMNS):
            rows = read_manifest(self.path)
        self._content = content
        return rows

    def write(self, rows: Sequence[ManifestRow]) -> list[ManifestRow]:
        """Write the rows, and return them with their lines in the file.

        Raises ChangedOnDiskError where the file differs from what was read or written last; UserError where it cannot be
        written.
        """
        if self._on_disk() != self._content:
            raise ChangedOnDiskError(
                f"{self.path.name}: another program has changed it; it was read again: repeat the last change"
            )
        try:
            write_manifest(self.path, rows)
            self._content = self.path.read_bytes()
        except OSError as error:
            raise UserError(f"{self.path}: cannot be written: {error.strerror or error}; nothing was changed") from None
        return [replace(row, line=FIRST_LINE + k) for k, row in enumerate(rows)]

    def check_writable(self) -> None:
        """Raise UserError where the folder cannot be written to."""
        probe = self.path.with_name(f".{self.path.name}.{os.getpid()}.probe")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            probe.touch()
            probe.unlink()
        except OSError as error:
            reason = error.strerror or error
            raise UserError(f"{self.path.parent}: cannot be written: {reason}: allowed: -o with another folder") from None

    def _on_disk(self) -> bytes | None:
        try:
            return self.path.read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise UserError(f"{self.path}: cannot be read: {error.strerror or error}") from None


def manifest_at(output: Path) -> Path:
    """The manifest of an `-o`: the file itself, or `examples.csv` in a folder.  Raises UserError."""
    if output.suffix.lower() == SUFFIX and not output.is_dir():
        return output
    if output.is_file():
        raise UserError(f"-o {output}: allowed: a folder, or a manifest ({SUFFIX})")
    return output / NAME
