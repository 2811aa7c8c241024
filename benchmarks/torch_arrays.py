"""Arrays of files in PyTorch's zip format, read without PyTorch and without running any code of the file."""

import pickle
import zipfile
from collections import OrderedDict
from io import BytesIO
from typing import Any

import numpy as np

from zenocap.common.arrays import Floats

_STORAGES = {"DoubleStorage": "<f8", "FloatStorage": "<f4", "LongStorage": "<i8", "IntStorage": "<i4"}


def read_arrays(content: bytes) -> Any:
    """Arrays of a file, alone or in plain containers; sparse ones are None.

    Raises an error of zipfile or pickle, OSError, ValueError, TypeError, LookupError, AttributeError or EOFError.
    """
    with zipfile.ZipFile(BytesIO(content)) as archive:
        folder = archive.namelist()[0].split("/")[0]
        return _ArrayUnpickler(archive, folder).load()


class _ArrayUnpickler(pickle.Unpickler):
    """Builds dense arrays and plain containers; any other type in the file is an error, so that no code is run."""

    def __init__(self, archive: zipfile.ZipFile, folder: str) -> None:
        super().__init__(BytesIO(archive.read(f"{folder}/data.pkl")))
        self._archive, self._folder = archive, folder

    def find_class(self, module: str, name: str) -> Any:
        match module, name:
            case "torch", storage if storage in _STORAGES:
                return _STORAGES[storage]
            case "torch._utils", "_rebuild_tensor_v2":
                return _dense
            case ("torch._utils", "_rebuild_sparse_tensor") | ("torch.serialization", "_get_layout") | ("torch", "Size"):
                return _left_out
            case "collections", "OrderedDict":
                return OrderedDict
        raise pickle.UnpicklingError(f"{module}.{name}: not an array")

    def persistent_load(self, pid: Any) -> Floats:
        _, dtype, key, *_ = pid
        if dtype not in _STORAGES.values():
            raise pickle.UnpicklingError(f"{dtype}: not a type of numbers")
        return np.frombuffer(self._archive.read(f"{self._folder}/data/{int(key)}"), dtype)


def _dense(storage: Floats, offset: int, size: tuple[int, ...], stride: tuple[int, ...], *_: object) -> Floats:
    """Array of a shape and strides, in elements.  Raises ValueError outside of the storage."""
    last = offset + sum((count - 1) * step for count, step in zip(size, stride, strict=True))
    if min(offset, *size, *stride) < 0 or last >= len(storage):
        raise ValueError(f"array of shape {size} in {len(storage)} elements")
    steps = [step * storage.itemsize for step in stride]
    return np.lib.stride_tricks.as_strided(storage[offset:], size, steps).copy()


def _left_out(*_: object) -> None:
    return None
