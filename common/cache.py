"""Files kept between runs, shared by all installations of a user.

Every entry is named after the content that it was made from, so nothing is ever out of date.  An entry that is damaged, or
written by another user, counts as missing.
"""

import hashlib
import os
import shutil
import tempfile
from pathlib import Path

VARIABLE = "ZENOCAP_CACHE"
KERNELS = "kernels"  # folder of the compiled functions
DIGEST_SIZE = 32  # bytes, SHA-256
UNUSED_DAYS = 30  # a folder of entries that nothing has used for so long is deleted
DAY_S = 86_400


def cache_folder() -> Path:
    """The folder of the environment variable ZENOCAP_CACHE, by default `zenocap` in the user's cache directory.

    A user without a home has one among the temporary files.
    """
    own = os.environ.get(VARIABLE)
    if own:
        return Path(own).expanduser().absolute()
    if user := os.environ.get("XDG_CACHE_HOME"):
        return Path(user) / "zenocap"
    home = os.path.expanduser("~")
    return Path(tempfile.gettempdir()) / f"zenocap-{os.geteuid()}" if home == "~" else Path(home) / ".cache" / "zenocap"


def read_entry(path: Path) -> bytes | None:
    """Content of an entry; None if it is missing, damaged, or not written by this user or root."""
    try:
        with path.open("rb") as file:
            if os.fstat(file.fileno()).st_uid not in (0, os.geteuid()):
                return None
            digest, content = file.read(DIGEST_SIZE), file.read()
    except OSError:
        return None
    return content if hashlib.sha256(content).digest() == digest else None


def write_entry(path: Path, content: bytes) -> bool:
    """Write an entry atomically; False where the folder cannot be written.  Safe with processes that write the same one."""
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".", dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(hashlib.sha256(content).digest() + content)
            os.replace(name, path)
        except BaseException:
            os.unlink(name)
            raise
    except OSError:
        return False
    return True


def mark_used(folder: Path) -> None:
    """Record that a folder of entries is in use and, at most once a day, delete its siblings that are not."""
    try:
        before_s = folder.stat().st_mtime
        os.utime(folder)
        now_s = folder.stat().st_mtime
        if now_s < before_s + DAY_S:
            return
        for other in folder.parent.iterdir():
            if other.is_dir() and other.stat().st_mtime < now_s - UNUSED_DAYS * DAY_S:
                shutil.rmtree(other, ignore_errors=True)
    except OSError:
        return
