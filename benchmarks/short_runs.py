"""Run every evaluation in its shortest form, to check that it runs; its figures have no meaning.

    python -m benchmarks.short_runs [NAME ...]

Results of the last run are in build/short-runs.
"""

import argparse
import subprocess
import sys
import time
from pathlib import Path

OUT = Path("build") / "short-runs"
ARGUMENTS: dict[str, tuple[str, ...]] = {
    "animator": ("--seconds", "2", "--pages", "1"),
    "budgets": (
        "--views",
        "2",
        "--jobs",
        "1",
        "--busy",
        "0",
        "--rounds",
        "1",
        "--frames",
        "130",
        "--out",
        str(OUT / "hybrid" / "silhouettes"),
    ),
    "board_calibration": ("--seeds", "1", "--only", "noise"),
    "board_guide": ("--seeds", "1", "--cameras", "2"),
    "board_kinds": ("--seeds", "1", "--pictures", "15"),
    "bodies": ("--people", "1", "--jobs", "1"),
    "chaos": ("--seconds", "10"),
    "clips": ("walk2", "--jobs", "1"),
    "confidence": ("--fit", "1", "--check", "1", "--headings", "0", "--postures", "2", "--jobs", "1"),
    "contended": ("--seconds", "3", "--size", "160x120"),
    "damage": ("--count", "6", "--seeds", "0", "--commands", "1"),
    "decoding": ("--sizes", "64x48", "--frames", "10", "--minutes", "0.5"),
    "drift": ("--views", "3", "--seeds", "1"),
    "faults": ("--short",),
    "film": ("--films", "1", "--seconds", "1", "--size", "320x240"),
    "flashes": ("--quick",),
    "headings": ("--people", "1", "--every", "180", "--jobs", "1"),
    "motion_capture": ("--views", "2", "--people", "1", "--motions", "07_01", "--jobs", "1"),
    "hull": ("--people", "1", "--points", "50"),
    "hybrid": (
        "--only",
        "accuracy,angles,beam",
        "--clip",
        "jump2",
        "--both-ways",
        "--seeds",
        "1",
        "--out",
        str(OUT / "hybrid"),
    ),
    "jitter": ("--views", "2", "--people", "1", "--motions", "07_01", "--jobs", "1"),
    "joint_pictures": ("--output", str(OUT / "joints.png")),
    "kills": ("--count", "2", "--within", "2"),
    "latency": ("--seconds", "12", "--rates", "15"),
    "live_delays": ("--frames", "1", "--seeds", "1", "--fps", "15"),
    "load": ("--only", "network", "--seconds", "2", "--out", str(OUT / "load")),
    "limits": ("--people", "1", "--size", "160x120", "--scenario", "jump", "--jobs", "1"),
    "logging": ("--seconds", "2", "--viewers", "2", "--messages", "500"),
    "look": ("0", "squat", "0", str(OUT / "look")),
    "long_takes": ("--minutes", "0.5"),
    "matchings": ("--people", "1", "--every", "100"),
    "page_speed": ("--seconds", "1", "--loads", "1", "--no-demo"),
    "postures": ("--quick", "--posture", "squat"),
    "recognition": (
        "--only",
        "truth,ablation",
        "--poses",
        "truth",
        "--seeds",
        "1",
        "--people",
        "3",
        "--motions",
        str(OUT / "no motions"),
        "--out",
        str(OUT / "recognition"),
    ),
    "render": ("--rounds", "1", "--seconds", "1", "--size", "160x96"),
    "replay_timing": ("--seconds", "12", "--rates", "1", "--runs", "1"),
    "scorer": ("--searches", "20"),
    "starts": ("--people", "1", "--posture", "squat", "--jobs", "1"),
    "streams": ("--seconds", "2", "--cut", "1", "--size", "160x112"),
    "variants": ("--only", "paper", "improved", "--seeds", "1", "--people", "1", "--posture", "squat"),
    "sync": ("--quick",),
    "router_link": ("--rigs", "1", "--seconds", "1", "--ready", "10"),
    "stages": ("--takes", "1"),
    "verdict": ("--shots", "1"),
    "video_trials": ("--trial", "a third shorter", "--jobs", "1"),
    "rolling_shutter": ("--seeds", "1", "--seconds", "12"),
    "rooms": ("--seeds", "1", "--methods", "adaptive", "--only", "empty room", "--jobs", "1"),
    "walk_calibration": ("--seeds", "1", "--views", "2"),
}


def run(name: str, seconds: float | None = None) -> subprocess.CompletedProcess[str]:
    """Run one evaluation with its short arguments.  seconds: time limit."""
    command = [sys.executable, "-m", f"benchmarks.{name}", *ARGUMENTS[name]]
    return subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="*", default=list(ARGUMENTS), help=f"of {', '.join(ARGUMENTS)}")
    names = parser.parse_args().name
    if unknown := sorted(set(names) - set(ARGUMENTS)):
        parser.error(f"{', '.join(unknown)}: allowed: {', '.join(ARGUMENTS)}")
    failed = []
    for name in names:
        started_s = time.monotonic()
        done = run(name)
        print(f"{name}: status {done.returncode}, {time.monotonic() - started_s:.0f} s", flush=True)
        if done.returncode != 0:
            failed.append(name)
            print(done.stdout + done.stderr, flush=True)
    print(f"failed: {', '.join(failed)}" if failed else f"all {len(names)} run")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
