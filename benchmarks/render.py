"""Pictures per second of `zenocap render`, and against another checkout.

    python -m benchmarks.render [--take TAKE] [--size 1280x720] [--rounds 5] [--seconds 6] [--against CHECKOUT]

Films at 30 pictures/s of a fixed camera, and of one that follows the person with trails: reading the take, drawing,
encoding and writing, without the start of the program and compilation.  Each film is drawn by a process of its own.  With
--against, the two checkouts take turns; the ratio is the median over the rounds, each a pair of neighbours in time.
"""

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from zenocap.common.formats.pose_track import Bound
from zenocap.services.animator.render.camera_path import Shot
from zenocap.services.animator.render.film import RenderOptions, render

HERE = Path(__file__).resolve().parents[1]
GOLDEN = HERE / "tests" / "golden" / "arms.mcap"
SHOTS = {"fixed": (Shot(), 0.0), "follow, trails": (Shot(follows=True), 1.0)}
AIM = 30.0  # pictures per second at 1280x720, on two processors that are otherwise idle


def rate(take: Path, size: tuple[int, int], seconds: float, shot: str) -> float:
    """Pictures per second of one film."""
    viewpoint, trails_s = SHOTS[shot]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        render(
            take, path, RenderOptions(size=(64, 64), shot=viewpoint, trails_s=trails_s, last=Bound(3.6, True))
        )  # compiles
        options = RenderOptions(last=Bound(3.3 + seconds, True), fps=30.0, size=size, shot=viewpoint, trails_s=trails_s)
        began_s = time.perf_counter()
        drawn = render(take, path, options)
        return drawn.pictures / (time.perf_counter() - began_s)


def measured(checkout: Path, options: argparse.Namespace, shot: str) -> float:
    """Run this file in a process with the code of a checkout."""
    command = [sys.executable, "-P", str(HERE / "benchmarks" / "render.py"), "--once", shot, "--take", str(options.take)]
    command += ["--size", options.size, "--seconds", str(options.seconds)]
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    done = subprocess.run(command, cwd=checkout, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"{checkout}: {done.stderr.strip().splitlines()[-1]}")
    return float(done.stdout)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--take", type=Path, default=GOLDEN)
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--against", type=Path, help="another checkout")
    parser.add_argument("--once", choices=list(SHOTS), help=argparse.SUPPRESS)
    options = parser.parse_args()
    options.take = options.take.resolve()
    if options.once:
        width, height = (int(side) for side in options.size.split("x"))
        print(rate(options.take, (width, height), options.seconds, options.once))
        return
    for shot in SHOTS:
        rates: list[float] = []
        ratios: list[float] = []
        for _ in range(options.rounds):
            rates.append(measured(HERE, options, shot))
            if options.against:
                ratios.append(rates[-1] / measured(options.against.resolve(), options, shot))
        line = f"{shot}: {median(rates):.1f} pictures/s ({min(rates):.1f} to {max(rates):.1f}), wanted {AIM:g}"
        if ratios:
            line += f"; {median(ratios):.1f} times the rate of {options.against} ({min(ratios):.1f} to {max(ratios):.1f})"
        print(line, flush=True)


if __name__ == "__main__":
    main()
