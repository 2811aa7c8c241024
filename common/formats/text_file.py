"""Text files of other programs."""

from pathlib import Path

from zenocap.common.errors import UserError

MAX_BYTES = 1 << 30  # of a file that is read, which is held in memory; chosen by hand


def read_text(path: Path, kind: str, most: int = MAX_BYTES) -> str:
    """Content of a file.  kind: in errors, such as "a BVH file".  most: bytes.  Raises UserError."""
    try:
        if path.stat().st_size > most:
            raise UserError(f"{path}: larger than {most >> 20} MiB: allowed: {kind} below that")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise UserError(f"{path}: cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise UserError(f"{path}: not {kind}: {error}") from error
