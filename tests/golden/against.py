"""Compare this checkout with another one on this machine: python -m tests.golden.against CHECKOUT

Both track the films of the offline golden takes, and read the golden takes of this checkout; then all takes and texts are
compared byte for byte.  On another processor than that of the recorded takes, this is the only exact comparison.  Excepted
is the attachment parameters.json, which has every name in the services' `parameters.py`.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.golden.make import HERE, OFFLINE, TAKES, readable
from tests.golden.texts import TEXTS, library_exports_text
from zenocap.common.recording.reader import TakeReader
from zenocap.common.recording.setup_file import PARAMETERS_FILE

ROOT = HERE.parents[1]


def write(folder: Path, golden: Path) -> None:
    """Takes of the offline films, and the texts of them and of the takes in `golden`."""
    for name, make in OFFLINE.items():
        print(f"  {name}", flush=True)
        make(folder / f"{name}.mcap")
    for place, names in ((folder, OFFLINE), (golden, TAKES)):
        for name in names:
            for reader, text in {"take": readable, "libraries": library_exports_text, **TEXTS}.items():
                (folder / f"{place.name}-{name}-{reader}.txt").write_text(text(place / f"{name}.mcap"))


def differences(here: Path, other: Path) -> list[str]:
    """Files of two folders that differ, in words."""
    names = sorted({path.name for folder in (here, other) for path in folder.iterdir()})
    found = []
    for name in names:
        one, two = here / name, other / name
        if not (one.exists() and two.exists()):
            found.append(f"{name}: only in {here if one.exists() else other}")
        elif name.endswith(".mcap"):
            found += [f"{name}: {what}" for what in _take_differences(one, two)]
        elif one.read_bytes() != two.read_bytes():
            found.append(name)
    return found


def _take_differences(one: Path, two: Path) -> list[str]:
    takes = TakeReader(one), TakeReader(two)
    messages = [[(each.topic, each.log_ns, each.data) for each in take.messages()] for take in takes]
    found = []
    if messages[0] != messages[1]:
        pairs = zip(*messages, strict=False)
        first = next((k for k, (a, b) in enumerate(pairs) if a != b), min(map(len, messages)))
        found.append(f"{len(messages[0])} and {len(messages[1])} messages, the first that differs is number {first}")
    files, others = (take.attachments for take in takes)
    changed = sorted(name for name in {*files, *others} - {PARAMETERS_FILE} if files.get(name) != others.get(name))
    found += [f"attachment {name}" for name in changed]
    if takes[0].metadata != takes[1].metadata:
        found.append(f"metadata {takes[0].metadata} and {takes[1].metadata}")
    return found


def main(checkout: Path) -> int:
    with tempfile.TemporaryDirectory() as name:
        folders = []
        for tree in (ROOT, checkout.resolve()):
            folders.append(Path(name) / str(len(folders)) / "made")
            folders[-1].mkdir(parents=True)
            print(tree, flush=True)
            command = [sys.executable, "-m", "tests.golden.against", "--write", str(folders[-1]), str(HERE)]
            subprocess.run(command, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)}, check=True)
        found = differences(*folders)
        count = len(list(folders[0].iterdir()))
    print("\n".join([*found, f"{count} files, {len(found)} differences"]))
    return 1 if found else 0


if __name__ == "__main__":
    if sys.argv[1] == "--write":
        write(Path(sys.argv[2]), Path(sys.argv[3]))
    else:
        sys.exit(main(Path(sys.argv[1])))
