"""Effect of network and process faults on a running rig, as a table in text, Markdown and JSON.

    python -m benchmarks.faults [--only NAME] [--short] [--json FILE] [--markdown FILE] [--keep DIR]

Each service runs on a separate host (a network namespace) around a router; one more host observes.  Needs root, iproute2
and iptables.  The faults are applied one after another to running rigs: about twelve minutes, the short form one.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from benchmarks.faults.network import problem
from benchmarks.faults.report import as_json, as_markdown, as_text
from benchmarks.faults.run import run
from benchmarks.faults.scenarios import FAULTS


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="NAME", help="faults whose name contains this")
    parser.add_argument("--short", action="store_true", help="only the faults that the tests run")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--markdown", type=Path, metavar="FILE")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="folder that keeps the services' takes and logs")
    arguments = parser.parse_args()
    reason = problem()
    if reason is not None:
        print(f"error: {reason}", file=sys.stderr)
        return 1
    wanted = [
        fault
        for fault in FAULTS
        if not (arguments.short and fault.long) and (arguments.only is None or arguments.only in fault.name)
    ]
    if not wanted:
        print(f"error: --only {arguments.only}: none of: {'; '.join(fault.name for fault in FAULTS)}", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        output = arguments.keep or Path(folder)
        outcome = run(wanted, output, lambda line: print(line, file=sys.stderr, flush=True))
    print(as_text(outcome))
    if arguments.json:
        arguments.json.write_text(as_json(outcome), encoding="utf-8")
    if arguments.markdown:
        arguments.markdown.write_text(as_markdown(outcome), encoding="utf-8")
    return 0 if outcome.passed else 1


if __name__ == "__main__":
    sys.exit(main())
