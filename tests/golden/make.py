"""Write the golden takes again after an intended change of results: python -m tests.golden.make

Each NAME.mcap has a NAME.txt beside it with its content as text: read the difference of the text before committing.

arms: the simulated person raises both arms, tracked offline.  live: 20 s of the demo, three processes, with the actual
order and gaps of their messages.
"""

import subprocess
import sys
import tempfile
from dataclasses import replace
from math import degrees
from pathlib import Path

from zenocap.common.messages import UniversalBap, UniversalBdp
from zenocap.common.recording.reader import Take, envelope
from zenocap.common.rig.file import LogTable
from zenocap.common.rig.rig import demo_rig, demo_rig_file
from zenocap.common.rig.sources import Actor
from zenocap.tools.recordings.track import track

HERE = Path(__file__).parent
NAMES = ("arms", "live")
SHOWN = (
    "navel.y", "left_shoulder.z", "left_shoulder.x", "left_elbow.x", "right_shoulder.z", "right_shoulder.x",
    "right_elbow.x", "left_hip.x", "left_knee.x", "right_hip.x", "right_knee.x",
)  # fmt: skip


def readable(path: Path) -> str:
    """The content of a take as text: number of messages of each kind, the body, and every pose."""
    counts: dict[str, int] = {}
    lines: list[str] = []
    for recorded in Take(path).messages():
        received = envelope(recorded)
        if received is None:
            continue
        kind = type(received.message).__name__
        counts[kind] = counts.get(kind, 0) + 1
        match received.message:
            case UniversalBdp(body=body):
                sizes = ", ".join(f"{part} {size[0] * 1000:.0f}" for part, size in body.sizes.items())
                lines.append(f"body, heights in mm: {sizes}")
            case UniversalBap() as bap:
                place = " ".join(f"{value:6.3f}" for value in bap.position)
                angles = " ".join(f"{degrees(bap.angles[name]):6.1f}" for name in SHOWN)
                views = " ".join(f"{viewer}:{view}" for viewer, view in sorted(bap.views.items()))
                lines.append(
                    f"{bap.frame:4d}  {place}  {angles}  {views}{' stale ' + ' '.join(bap.stale) if bap.stale else ''}"
                )
    head = [f"{count:5d} {kind}" for kind, count in sorted(counts.items())]
    columns = "frame, navel (x y z, m), degrees of " + ", ".join(SHOWN) + ", views"
    return "\n".join([*head, "", columns, *lines, ""])


def make_arms(path: Path) -> None:
    rig = demo_rig("two-view")
    source = Actor("raise-both-arms", 3)
    viewers = tuple(replace(viewer, source=source, preview=False) for viewer in rig.viewers)
    track(replace(rig, viewers=viewers, log=LogTable(foxglove=False)), path)


def make_live(path: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file in demo_rig("two-view").files:
            text = file.read_text().replace("preview = true", "preview = false")
            (folder / file.name).write_text(text)
        rig = folder / demo_rig_file("two-view").name
        rig.write_text(rig.read_text() + "\n[log]\nfoxglove = false\n")
        command = [sys.executable, "-m", "zenocap", "up", str(rig), "--seconds", "20", "--recordings", name]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        (take,) = folder.glob("*.mcap")
        path.write_bytes(take.read_bytes())


if __name__ == "__main__":
    make_arms(HERE / "arms.mcap")
    make_live(HERE / "live.mcap")
    for name in NAMES:
        (HERE / f"{name}.txt").write_text(readable(HERE / f"{name}.mcap"))
