"""Real hosts, real faults: a table of what each costs, as text, Markdown and JSON.

    python -m tests.evaluation.faults [--only NAME] [--short] [--json FILE] [--markdown FILE] [--keep DIR]

Every service runs on a host of its own (a network namespace) around a router; one more host listens.  Needs root, iproute2
and iptables.  The faults come one after another to rigs that go on running: some twelve minutes, the short form one.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from tests.evaluation.faults.network import problem
from tests.evaluation.faults.report import as_json, as_markdown, as_text
from tests.evaluation.faults.run import run
from tests.evaluation.faults.scenarios import FAULTS


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", metavar="NAME", help="faults whose name contains this")
    parser.add_argument("--short", action="store_true", help="the few that CI runs")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--markdown", type=Path, metavar="FILE")
    parser.add_argument("--keep", type=Path, metavar="DIR", help="where takes and logs of the services stay")
    arguments = parser.parse_args()
    why = problem()
    if why is not None:
        print(f"error: {why}", file=sys.stderr)
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
        place = arguments.keep or Path(folder)
        outcome = run(wanted, place, lambda line: print(line, file=sys.stderr, flush=True))
    print(as_text(outcome))
    if arguments.json:
        arguments.json.write_text(as_json(outcome), encoding="utf-8")
    if arguments.markdown:
        arguments.markdown.write_text(as_markdown(outcome), encoding="utf-8")
    return 0 if outcome.well else 1


if __name__ == "__main__":
    sys.exit(main())
