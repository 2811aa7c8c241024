"""Revoked, expired and renewed certificates on a real TLS network."""

import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Event, Thread

import pytest

from tests.support.networks import is_whole, wait_for
from tests.support.processes import PATIENCE_S, ended, output_of, poses_in, run, started, wait_until
from tests.support.session_rigs import HOSTS, secured_rig_file
from zenocap.common import messages as m
from zenocap.common.bus.access import ROUTER, Member
from zenocap.common.bus.certificate import valid_until
from zenocap.common.bus.protocol import BusError, Envelope
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.security import needed_members, security_in
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import HEALTH, SIGHTING, SILHOUETTE, UNIVERSAL_BAP
from zenocap.tools.setup.certificates.folder import certify

pytestmark = pytest.mark.nightly
SOON_S = 5.0  # within which a revoked certificate is to be excluded
LASTING_S = 10.0  # of a certificate that is to expire, in which its member joins
LOAD_BYTES = 100_000  # of one message of a load of 5 MB/s
DAY = timedelta(days=1)


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    """A secured rig with the authority in its folder, whose router is on a free port."""
    return secured_rig_file(tmp_path)


def copied(rig_file: Path, machine: str, *names: str) -> Path:
    """The folder of certificates of another machine."""
    folder = rig_file.parent / machine
    folder.mkdir()
    copy_to(rig_file, folder, "authority.pem", *(f"{name}{end}" for name in names for end in (".pem", "-key.pem")))
    return folder


def copy_to(rig_file: Path, folder: Path, *files: str) -> None:
    for file in files:
        shutil.copy(rig_file.parent / "certs" / file, folder / file)


def machine_of_a_router(rig_file: Path, folder: Path) -> Path:
    """Copy of the rig file in a folder, beside it the certificates of a router."""
    folder.mkdir()
    for file in (rig_file, rig_file.with_name("demo-calibration.toml")):
        shutil.copy(file, folder)
    copied(rig_file, f"certs-of-{folder.name}", "router").rename(folder / "certs")
    return folder / rig_file.name


def member(rig_file: Path, folder: Path, name: str) -> ZenohBus:
    options = ZenohOptions(
        "client", load_rig(rig_file).zenoh.connect, multicast_scouting=False, security=security_in(folder, name)
    )
    end_s = time.monotonic() + PATIENCE_S
    return ZenohBus.open(options, "demo", RealClock(), lambda: time.monotonic() > end_s)


def health(service: str, id: str, frame: int) -> m.Health:
    return m.Health(frame=frame, captured_ns=1, service=service, id=id, state="", rate=0.0, stages_ms={}, counts={})


class Sender:
    """Sends a health message after the other, whose `frame` counts on."""

    def __init__(self, bus: ZenohBus, id: str) -> None:
        self.bus, self.id, self.frame = bus, id, 0

    def send(self) -> None:
        self.frame += 1
        self.bus.publish(HEALTH, health("viewer", self.id, self.frame))


def arrivals(bus: ZenohBus, senders: list[Sender], seconds: float) -> dict[str, list[int]]:
    """Frames received by id, while the senders send for some time."""
    found: dict[str, list[int]] = {sender.id: [] for sender in senders}
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        for sender in senders:
            sender.send()
        while isinstance(event := bus.receive(0.02), Envelope):
            found.setdefault(event.message.id, []).append(event.message.frame)
    return found


def arrives(bus: ZenohBus, sender: Sender, within_s: float = PATIENCE_S) -> bool:
    """Whether a message that is sent from now on arrives within some time."""
    first, end_s = sender.frame + 1, time.monotonic() + within_s
    while time.monotonic() < end_s:
        if any(frame >= first for frame in arrivals(bus, [sender], 0.2)[sender.id]):
            return True
    return False


def let_expire(certs: Path) -> float:
    """Renew the pair of viewer 1 for a few seconds; return when they end, by the monotonic clock."""
    short, ends_s = datetime.now(UTC) - DAY + timedelta(seconds=LASTING_S), time.monotonic() + LASTING_S
    certify(certs, "demo", {Member("viewer", "1"): HOSTS}, short, 1, renew=True)
    return ends_s


@pytest.fixture
def joined(rig_file: Path, stack: ExitStack) -> Callable[[str, Path], ZenohBus]:
    return lambda name, folder: stack.enter_context(member(rig_file, folder, name))


def test_a_revoked_viewer_is_excluded_within_seconds_and_its_new_certificate_is_admitted(
    rig_file: Path, tmp_path: Path, joined: Callable[[str, Path], ZenohBus]
) -> None:
    stolen, others = copied(rig_file, "stolen", "viewer-1"), copied(rig_file, "others", "viewer-2", "integrator")
    router_rig = machine_of_a_router(rig_file, tmp_path / "router")
    place = load_rig(rig_file).zenoh.connect[0]
    with started(["router", router_rig, "-l", place, "--no-multicast-scouting"], tmp_path):
        integrator, thief, two = joined("integrator", others), joined("viewer-1", stolen), joined("viewer-2", others)
        integrator.subscribe(HEALTH, every=True)
        thief.subscribe(HEALTH, every=True)
        one, other = Sender(thief, "1"), Sender(two, "2")
        assert arrives(integrator, one)
        assert arrives(integrator, other)
        assert arrives(thief, other)

        with started(["certs", rig_file, "--revoke", "viewer-1"], tmp_path) as command:
            revoked_s = time.monotonic()
            wait_until(lambda: "list 1 received" in output_of(tmp_path), tmp_path)
            assert command.wait(PATIENCE_S) == 0, output_of(tmp_path)
        assert "revoked: viewer-1 (list 1)" in output_of(tmp_path)
        assert "excluded by 1 router of the rig" in output_of(tmp_path)
        while isinstance(integrator.receive(0.0), Envelope):
            pass
        assert arrivals(integrator, [one], 0.5)["1"] == []  # it is excluded when the command says so
        assert arrives(integrator, other)  # the others are back
        left_s = max(0.0, SOON_S - (time.monotonic() - revoked_s))
        arrivals(integrator, [one, other], left_s)
        found = arrivals(integrator, [one, other], 2.0)
        assert found["1"] == []
        assert found["2"]
        while thief.receive(0.0) is not None:
            pass
        assert arrivals(thief, [other], 1.0)["2"] == []  # nor does it receive anything

        thief.close()
        copy_to(rig_file, stolen, "viewer-1.pem", "viewer-1-key.pem")  # the machine that replaces it
        new = joined("viewer-1", stolen)
        assert arrives(integrator, Sender(new, "1"))

    # The router has stored the list: it holds after a restart.
    with started(["router", router_rig, "-l", place, "--no-multicast-scouting"], tmp_path):
        assert arrives(integrator, other)
    assert (router_rig.parent / "certs" / "revoked.json").read_bytes() == (
        rig_file.parent / "certs" / "revoked.json"
    ).read_bytes()


def test_without_a_router_the_command_says_which_file_to_copy(rig_file: Path, tmp_path: Path) -> None:
    status, text = run(tmp_path, "certs", rig_file, "--revoke", "viewer-1")
    assert status == 3
    assert "no router of the rig was reached: copy" in text
    assert "revoked.json beside the certificates of every router" in text


def test_a_forged_list_changes_nothing(rig_file: Path, tmp_path: Path, joined: Callable[[str, Path], ZenohBus]) -> None:
    certs, place = rig_file.parent / "certs", load_rig(rig_file).zenoh.connect[0]
    forged = b'{"number": 9, "generations": {"demo/viewer/1": 1}, "signature": "AAAA"}'
    with started(["router", rig_file, "-l", place, "--no-multicast-scouting"], tmp_path):
        integrator, one = joined("integrator", certs), Sender(joined("viewer-1", certs), "1")
        integrator.subscribe(HEALTH, every=True)
        assert arrives(integrator, one)
        for name in ("viewer-2", "reader"):  # the first may not even send it
            publisher = joined(name, certs)._session.declare_publisher("zenocap/demo/certificates/revoked")
            wait_until(lambda publisher=publisher: publisher.matching_status.matching, tmp_path)
            publisher.put(forged)
        wait_until(lambda: "ignored: zenocap/demo/certificates/revoked: not signed" in output_of(tmp_path), tmp_path)
        assert output_of(tmp_path).count("not signed by the authority") == 1
        assert arrives(integrator, one)


def test_a_renewed_pair_is_taken_up_when_the_old_one_expires(
    rig_file: Path, tmp_path: Path, joined: Callable[[str, Path], ZenohBus]
) -> None:
    """No restart: Zenoh reads the files again when its link ends with the old certificate."""
    certs, place = rig_file.parent / "certs", load_rig(rig_file).zenoh.connect[0]
    with started(["router", rig_file, "-l", place, "--no-multicast-scouting"], tmp_path):
        integrator = joined("integrator", certs)
        integrator.subscribe(HEALTH, every=True)
        ends_s = let_expire(certs)
        bus = joined("viewer-1", certs)
        one = Sender(bus, "1")
        assert arrives(integrator, one)
        assert bus.counters.certificate_days == 0
        certify(certs, "demo", {Member("viewer", "1"): HOSTS}, datetime.now(UTC), 60, renew=True)
        assert bus.counters.certificate_days == 59
        arrivals(integrator, [one], max(0.0, ends_s + 2.0 - time.monotonic()))
        assert arrives(integrator, one)


def test_a_certificate_that_has_expired_ends_the_link_and_is_a_clear_error(
    rig_file: Path, tmp_path: Path, joined: Callable[[str, Path], ZenohBus]
) -> None:
    certs, place = rig_file.parent / "certs", load_rig(rig_file).zenoh.connect[0]
    with started(["router", rig_file, "-l", place, "--no-multicast-scouting"], tmp_path):
        integrator = joined("integrator", certs)
        integrator.subscribe(HEALTH, every=True)
        ends_s = let_expire(certs)
        one = Sender(joined("viewer-1", certs), "1")
        assert arrives(integrator, one)
        arrivals(integrator, [one], max(0.0, ends_s - time.monotonic()))
        wait_until(lambda: arrivals(integrator, [one], 2.0)["1"] == [], tmp_path)
    with pytest.raises(BusError, match=r"viewer-1\.pem: expired on \d{4}-\d\d-\d\d: renew it with `zenocap certs RIG"):
        joined("viewer-1", certs)


def test_a_router_takes_up_its_own_renewed_certificate(
    rig_file: Path, tmp_path: Path, joined: Callable[[str, Path], ZenohBus]
) -> None:
    certs, place = rig_file.parent / "certs", load_rig(rig_file).zenoh.connect[0]
    with started(["router", rig_file, "-l", place, "--no-multicast-scouting"], tmp_path):
        integrator, one = joined("integrator", certs), Sender(joined("viewer-1", certs), "1")
        integrator.subscribe(SIGHTING)
        integrator.subscribe(HEALTH, every=True)
        assert arrives(integrator, one)
        wait_until(lambda: "listens on" in output_of(tmp_path), tmp_path)
        before = output_of(tmp_path).count("listens on")
        certify(certs, "demo", {Member(ROUTER): HOSTS}, datetime.now(UTC), 90, renew=True)
        wait_until(lambda: output_of(tmp_path).count("listens on") > before, tmp_path)
        assert "certificates or revocations have changed" in output_of(tmp_path)
        assert arrives(integrator, one)


def test_a_router_that_starts_later_learns_the_list_from_the_first(rig_file: Path, tmp_path: Path) -> None:
    place, other = load_rig(rig_file).zenoh.connect[0], f"tls/127.0.0.1:{free_ports(1)[0]}"
    first, second = (machine_of_a_router(rig_file, tmp_path / name) for name in ("first", "second"))
    lists = [rig.parent / "certs" / "revoked.json" for rig in (rig_file, first, second)]
    with started(["router", first, "-l", place, "--no-multicast-scouting"], tmp_path):
        status, text = run(tmp_path, "certs", rig_file, "--revoke", "viewer-2")
        assert status == 0, text
        with started(["router", second, "-l", other, "-e", place, "--no-multicast-scouting"], tmp_path):
            wait_until(lists[2].is_file, tmp_path)
    assert len({path.read_bytes() for path in lists}) == 1


def test_a_router_outlasts_a_certificate_that_is_copied_without_its_key(rig_file: Path, tmp_path: Path) -> None:
    certs, place = rig_file.parent / "certs", load_rig(rig_file).zenoh.connect[0]
    with started(["router", rig_file, "-l", place, "--no-multicast-scouting"], tmp_path) as router:
        wait_until(lambda: "listens on" in output_of(tmp_path), tmp_path)
        before = {name: (certs / name).read_bytes() for name in ("router.pem", "router-key.pem")}
        (certs / "router-key.pem").unlink()
        wait_until(lambda: "router-key.pem: No such file" in output_of(tmp_path), tmp_path)
        listening = output_of(tmp_path).count("listens on")
        (certs / "router-key.pem").write_bytes(before["router-key.pem"])
        wait_until(lambda: output_of(tmp_path).count("listens on") > listening, tmp_path)
        assert router.poll() is None


def test_up_renews_certificates_that_expire_soon_where_the_authority_is(rig_file: Path, tmp_path: Path) -> None:
    certs = rig_file.parent / "certs"
    certify(certs, "demo", dict.fromkeys(needed_members(load_rig(rig_file)), HOSTS), datetime.now(UTC) - DAY, 2, renew=True)
    with started(["up", rig_file, "--mode", "peer", "--no-page", "--no-log", "--seconds", "1"], tmp_path) as launcher:
        wait_until(lambda: "certificates renewed before they expire: viewer-1, viewer-2" in output_of(tmp_path), tmp_path)
        launcher.terminate()
        launcher.wait(PATIENCE_S)
    ends = valid_until(certs / "viewer-1.pem")
    assert ends is not None
    assert ends - datetime.now(UTC) > 700 * DAY


def test_a_running_rig_outlasts_a_revocation(rig_file: Path, tmp_path: Path) -> None:
    """Every link ends once; the viewer whose certificate was revoked continues with the new pair that is on its disk."""
    place, take = load_rig(rig_file).zenoh.connect[0], tmp_path / "take.mcap"
    lines: list[list[object]] = [
        ["router", rig_file, "-l", place, "--no-multicast-scouting"],
        ["integrator", rig_file, "-o", take],
        ["viewer", rig_file, "--id", "1"],
        ["viewer", rig_file, "--id", "2"],
    ]
    with ExitStack() as stack:
        processes = [stack.enter_context(started(line, tmp_path)) for line in lines]
        bus = stack.enter_context(member(rig_file, tmp_path / "certs", "recorder"))
        bus.subscribe(UNIVERSAL_BAP)
        wait_for(bus, is_whole, 20)
        status, text = run(tmp_path, "certs", rig_file, "--revoke", "viewer-1")
        assert status == 0, text
        while bus.receive(0.0) is not None:
            pass
        wait_for(bus, is_whole, 60)
        assert [process.poll() for process in processes] == [None] * len(processes), output_of(tmp_path)
        for process in reversed(processes):
            assert ended(process) in (0, 3), output_of(tmp_path)  # 3: what the router dropped is missing in the take
    assert "Traceback" not in output_of(tmp_path)
    assert len(poses_in(take)) >= 80


def test_revocations_and_renewals_under_load_exclude_the_holder_and_bring_the_others_back(
    rig_file: Path, tmp_path: Path, joined: Callable[[str, Path], ZenohBus]
) -> None:
    """Three rounds while another member sends megabytes a second; nothing is lost once the router is open again."""
    certs, place = rig_file.parent / "certs", load_rig(rig_file).zenoh.connect[0]
    with started(["router", rig_file, "-l", place, "--no-multicast-scouting"], tmp_path):
        integrator, two = joined("integrator", certs), Sender(joined("viewer-2", certs), "2")
        integrator.subscribe(HEALTH, every=True)
        integrator.subscribe(SILHOUETTE)
        with loaded(joined("replay", certs)):
            for number in range(3):
                stolen = joined("viewer-1", copied(rig_file, f"stolen-{number}", "viewer-1"))
                one = Sender(stolen, "1")
                assert arrives(integrator, one)
                with started(["certs", rig_file, "--revoke", "viewer-1"], tmp_path) as command:
                    while command.poll() is None:
                        arrivals(integrator, [one, two], 0.1)
                assert command.returncode == 0, output_of(tmp_path)
                arrivals(integrator, [two], 0.5)  # what had passed the router
                assert arrivals(integrator, [one, two], 1.0)["1"] == []
                assert arrives(integrator, two, SOON_S)
                listening = output_of(tmp_path).count("listens on")
                renewed = dict.fromkeys((Member(ROUTER), Member("viewer", "2")), HOSTS)
                certify(certs, "demo", renewed, datetime.now(UTC), 90, renew=True)
                wait_until(lambda count=listening: output_of(tmp_path).count("listens on") > count, tmp_path)
                assert arrives(integrator, two, SOON_S)
                stolen.close()
            frames = arrivals(integrator, [two], 2.0)["2"]
        assert frames == list(range(frames[0], frames[0] + len(frames)))
        assert arrives(integrator, Sender(joined("viewer-1", certs), "1"))  # with the last new pair
    assert "Traceback" not in output_of(tmp_path)


@contextmanager
def loaded(bus: ZenohBus) -> Iterator[None]:
    """Megabytes a second of another member through the router, on the key of a silhouette."""
    ended = Event()

    def send() -> None:
        while not ended.wait(0.02):
            bus._session.put("zenocap/demo/viewer/2/silhouette", bytes(LOAD_BYTES))

    thread = Thread(target=send, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join(PATIENCE_S)
