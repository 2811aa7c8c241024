"""Images of the simulated person, rendered once and kept on disk for later tests, workers and sessions."""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

import zenocap.simulation
from zenocap.common.arrays import Bytes
from zenocap.common.camera import pinhole

FOLDER = Path(tempfile.gettempdir()) / f"zenocap-films-{os.getuid()}"


def stored(render: Callable[[], Bytes], *key: object) -> Bytes:
    """Return render()'s array, from disk if an earlier call with equal key and equal sources of the simulation wrote it.

    key: everything that `render` depends on, with a stable `repr`.  Safe with parallel workers: files appear atomically.
    """
    path = FOLDER / f"{hashlib.sha256(f'{_sources()} {key!r}'.encode()).hexdigest()}.npy"
    if path.is_file():
        return np.asarray(np.load(path), dtype=np.uint8)
    images = render()
    FOLDER.mkdir(mode=0o700, parents=True, exist_ok=True)
    unfinished = path.with_suffix(f".{os.getpid()}.npy")
    np.save(unfinished, images)
    unfinished.replace(path)
    return images


@cache
def _sources() -> str:
    """Digest of the sources that the images depend on."""
    (folder,) = zenocap.simulation.__path__
    files = [*sorted(Path(folder).rglob("*.py")), Path(pinhole.__file__)]
    return hashlib.sha256(b"".join([*(file.read_bytes() for file in files), np.__version__.encode()])).hexdigest()
