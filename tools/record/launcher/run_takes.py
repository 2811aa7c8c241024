"""Takes of a run, and the integrators that were started again after them."""

from collections import Counter
from collections.abc import Callable, Collection
from copy import deepcopy
from pathlib import Path

from zenocap.common.bus.protocol import Alive, Envelope
from zenocap.common.messages import PROCESS, Health
from zenocap.common.observe.account import Account, Life, Sender
from zenocap.common.recording.take_account import TakeAccount, readable
from zenocap.common.rig.services import MAIN, TIMEKEEPER

MOST_RESTARTS = 64  # of the integrator, after which no further one is told apart; chosen by hand


class Unresumed:
    """Integrators that were started again and recorded nothing by themselves, as of a run without a log.

    accounts: by number of the process, account of the healths that were received until its second one: each service has
    sent one then since the start.
    """

    def __init__(self) -> None:
        self.accounts: dict[int, Account] = {}
        self._healths = Counter[int]()

    def note(self, event: Envelope | Alive, reports: Account) -> None:
        """Note an event that is in `reports` already."""
        match event:
            case Envelope(message=Health(service=name, id=id, counts=counts)) if (name, id) == (TIMEKEEPER, MAIN):
                process = counts.get(PROCESS, 0)
                if process in self._healths or len(self._healths) < MOST_RESTARTS:
                    self._healths[process] += 1
                if self._healths[process] == 2 and len(self._healths) > 1 and not counts.get("log_on"):
                    senders = deepcopy(reports.senders)
                    if (own := senders.get((name, id))) is not None:
                        own.lives.pop(process, None)  # it has sent nothing that was to be recorded
                    self.accounts[process] = Account(senders, reports.end_ns, reports.steps)


def new_takes(
    folder: Path, known: Collection[Path], rig: str, reports: Account, on_reading: Callable[[Path], None] = lambda _: None
) -> tuple[list[TakeAccount], list[str], list[TakeAccount]]:
    """Takes of a rig in `folder` besides the known ones, in order; why others cannot be read; and those of a command.

    A command such as `zenocap record` writes messages that the takes of the run have already.
    reports: see `statement`.  on_reading: see `take_account`.
    """

    def is_own(take: TakeAccount) -> bool:
        """Whether a take may be of this run: of a second rig of the same name another integrator has reported."""
        processes = take.account.senders.get((TIMEKEEPER, MAIN), Sender()).lives.keys()
        seen = reports.senders.get((TIMEKEEPER, MAIN), Sender()).lives.keys()
        if take.command:
            return False
        return (take.rig == rig and (not processes or not seen or bool(processes & seen))) or not (
            take.rig or take.complete
        )

    paths = sorted(set(folder.glob("*.mcap")) - set(known), key=lambda path: (len(path.name), path.name))
    found = [readable(path, on_reading) for path in paths]
    read = [one for one in found if isinstance(one, TakeAccount)]
    takes = [one for one in read if is_own(one)]
    ordered = sorted((take for take in takes if take.opened_ns), key=lambda take: take.opened_ns)
    for take in sorted((take for take in takes if not take.opened_ns), key=lambda take: take.start_ns):
        ordered.insert(sum(one.start_ns <= take.start_ns for one in ordered), take)
    of_commands = [one for one in read if one.command and one.rig == rig]
    return ordered, [one for one in found if isinstance(one, str)], of_commands


def ended_with_its_integrator(take: TakeAccount) -> bool:
    """Whether a take was written until its integrator ended, and not until its user ended the recording."""
    last = next(reversed(take.account.senders.get((TIMEKEEPER, MAIN), Sender()).lives.values()), None)
    return not take.complete or (last is not None and last.last.ended)


def next_process(take: TakeAccount, reports: Account) -> tuple[int, Life] | None:
    """The integrator that was started after the one of a take: its number, and what it reported."""
    own = next(reversed(take.account.senders.get((TIMEKEEPER, MAIN), Sender()).lives), None)
    known = iter(reports.senders.get((TIMEKEEPER, MAIN), Sender()).lives.items())
    return next(known, None) if any(process == own for process, _ in known) else None
