"""Processes of `read_apart`, forked from one that has imported the readers: they start at once.

For thousands of damaged files.  Each is read in a process of its own all the same, which it may end by a signal.
"""

import os
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from multiprocessing import get_context
from tempfile import NamedTemporaryFile
from types import SimpleNamespace

FORKED = get_context("forkserver")  # a process without threads; it ends with this one
IMPORTED = ("zenocap.common.camera.opencv_storage", "zenocap.common.formats.c3d_reader", "ezc3d")


def run(command: Sequence[str], **_: object) -> subprocess.CompletedProcess[bytes]:
    """Result of `python -P -m MODULE PATH` with its output, by the `main` of the module."""
    module, path = command[-2:]
    FORKED.set_forkserver_preload([__name__, *IMPORTED])
    with NamedTemporaryFile() as out, NamedTemporaryFile() as err:
        process = FORKED.Process(target=_read, args=(module, path, out.name, err.name))
        process.start()
        process.join()
        status = process.exitcode
        process.close()
        assert status is not None
        return subprocess.CompletedProcess(command, status, out.read(), err.read())


def _read(module: str, path: str, *outputs: str) -> None:
    for number, name in enumerate(outputs, 1):
        os.dup2(os.open(name, os.O_WRONLY), number)
    sys.argv = [module, path]
    import_module(module).main()


SUBPROCESS = SimpleNamespace(run=run, DEVNULL=subprocess.DEVNULL)  # in the place of the module in `text_file`
