"""Coverage of each tier of tests: python -m tests.measures.coverage [TIER ...]

Runs the tiers one after another, also in the processes that tests start, and prints the sum after each one, and what only
the last one reaches.  Kernels are compiled and not counted.  Takes about twice as long as the tests alone.
"""

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence

from coverage import Coverage

from tests.support.places import ROOT

FOLDER = ROOT / "build" / "coverage"
TIERS = {
    "unit": "not slow and not core and not nightly",
    "slow": "slow and not core and not nightly",
    "core": "core and not nightly",
    "nightly": "nightly",
}


def main(tiers: Sequence[str]) -> int:
    FOLDER.mkdir(parents=True, exist_ok=True)
    chosen = tiers or tuple(TIERS)
    status = max(measure(tier) for tier in chosen)
    reached: list[Mapping[str, object]] = []
    for count, tier in enumerate(chosen, start=1):
        reached.append(summed(chosen[:count]))
        totals = reached[-1]["totals"]
        print(f"{tier:8} lines {totals['covered_lines']:6} of {totals['num_statements']}  "
              f"branches {totals['covered_branches']:6} of {totals['num_branches']}")  # fmt: skip
    if len(chosen) > 1:
        print(f"\nReached only by {chosen[-1]}:")
        for name, lines in only_last(reached[-2]["files"], reached[-1]["files"]):
            print(f"  {name}: {', '.join(map(str, lines))}")
    return status


def measure(tier: str) -> int:
    """Run a tier; the exit status of pytest."""
    for old in FOLDER.glob(f".{tier}*"):
        old.unlink()
    environment = os.environ | {"COVERAGE_FILE": str(FOLDER / f".{tier}"), "ZENOCAP_CACHE": str(FOLDER / "cache")}
    pytest = ["-m", "pytest", "-m", TIERS[tier], "-n", str((os.cpu_count() or 1) + 1), "--dist", "loadfile"]
    limits = ["--hypothesis-profile", "nightly", "--unit-limit", "0", "-o", "timeout=1200"]
    return subprocess.run([sys.executable, "-m", "coverage", "run", *pytest, *limits], cwd=ROOT, env=environment).returncode


def summed(tiers: Sequence[str]) -> Mapping[str, dict[str, dict[str, object]]]:
    """coverage's report of several tiers together."""
    coverage = Coverage(data_file=FOLDER / "-".join(tiers), config_file=ROOT / "pyproject.toml")
    coverage.combine([str(path) for tier in tiers for path in FOLDER.glob(f".{tier}.*")], keep=True)
    report = FOLDER / "report.json"
    coverage.json_report(outfile=str(report))
    return json.loads(report.read_text())


def only_last(
    before: Mapping[str, dict[str, object]], after: Mapping[str, dict[str, object]]
) -> list[tuple[str, list[int]]]:
    """By file, the lines that are reached after and not before."""
    found = []
    for name, file in sorted(after.items()):
        path = ROOT / name
        lines = set(file["executed_lines"]) - set(before.get(name, {}).get("executed_lines", ()))
        if lines and path.is_relative_to(ROOT):  # others are of packages that tests write
            found.append((str(path.relative_to(ROOT)), sorted(lines)))
    return found


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
