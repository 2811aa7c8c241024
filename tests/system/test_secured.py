"""Secured rig on a real network: unknown members rejected, own keys only."""

import json
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
import zenoh

from tests.common.bus.test_access import KEYS
from tests.common.bus.test_zenoh_state_recovery import recovered
from tests.support.processes import PATIENCE_S, ended, output_of, poses_in, recomputed_poses, started, wait_until
from tests.support.session_rigs import HOSTS, SessionRig, certificates, member, secured_rig_file
from zenocap.common import messages as m
from zenocap.common import topics
from zenocap.common.bus.access import OPERATOR, REPLAY, ROUTER, Member, keys_of
from zenocap.common.bus.protocol import Alive, BusError, DuplicateService, Envelope, RoundTrip
from zenocap.common.bus.zenoh_bus import ZenohBus
from zenocap.common.bus.zenoh_film import FilmSession
from zenocap.common.bus.zenoh_query_server import QueryServer
from zenocap.common.bus.zenoh_session import ZenohOptions, free_ports, open_session
from zenocap.common.codec import encode
from zenocap.common.rig.rig import load_rig
from zenocap.common.rig.security import needed_members, security_of
from zenocap.common.runtime.clock import RealClock
from zenocap.common.topics import (
    CAMERA,
    EVERYTHING,
    FILM,
    HEALTH,
    POSTURE,
    PREVIEW,
    SILHOUETTE,
    STATE_RECOVERY,
    TOPICS,
    UNIVERSAL_BAP,
    UNIVERSAL_BDP,
)  # fmt: skip
from zenocap.services.camera.endpoint import FilmEndpoint, Permission
from zenocap.services.viewer.sources.tap import Tap
from zenocap.tools.setup.certificates.folder import certify

pytestmark = pytest.mark.core
SHORT_S = 2.0
MATRIX_S = 50.0  # for what each certificate may put to arrive


@pytest.fixture(scope="module")
def rig_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A rig file with certificates beside it, and those of another authority."""
    path = secured_rig_file(tmp_path_factory.mktemp("secured"))
    certificates(path.parent / "other-authority", load_rig(path))
    return path


@pytest.fixture(scope="module")
def endpoint(rig_file: Path) -> Iterator[str]:
    rig = load_rig(rig_file)
    security = security_of([rig], ROUTER)
    with open_session(ZenohOptions("router", listen=rig.zenoh.connect, multicast_scouting=False, security=security)):
        yield rig.zenoh.connect[0]


def camera(viewer: str) -> m.CameraInfo:
    return m.CameraInfo(
        frame=0, captured_ns=1, viewer=viewer, name="cam", size=(16, 16),
        matrix=[1.0] * 9, distortions=[], rotation=[1.0] * 9, translation=[0.0] * 3,
    )  # fmt: skip


def silhouette(viewer: str) -> m.Silhouette:
    return m.Silhouette(frame=0, captured_ns=1, viewer=viewer, size=(16, 16), region=(0, 0, 0, 0), data=b"")


def received_keys(bus: ZenohBus, wait_s: float = 0.0) -> set[str]:
    """Keys of the received messages, and members that joined, until nothing is received for a time."""
    found: set[str] = set()
    while (event := bus.receive(wait_s)) is not None:
        match event:
            case Envelope(key=key):
                found.add(key.removeprefix("zenocap/demo/"))
            case Alive(service=service, id=id, alive=True):
                found.add(f"alive/{service}/{id}")
            case RoundTrip():
                found.add("clock")
    return found


@pytest.fixture
def joined(rig_file: Path, endpoint: str, stack: ExitStack) -> Callable[[str], ZenohBus]:
    """Open the bus of a member."""
    return lambda name: stack.enter_context(ZenohBus.open(member(rig_file, endpoint, name), "demo", RealClock()))


@pytest.fixture
def session(rig_file: Path, endpoint: str, stack: ExitStack) -> Callable[[str], zenoh.Session]:
    """Open the session of a member."""
    return lambda name: stack.enter_context(open_session(member(rig_file, endpoint, name)))


def received_by(
    buses: Mapping[str, ZenohBus], awaited: Mapping[str, set[str]], publish: Callable[[], None]
) -> dict[str, set[str]]:
    """Keys received by each bus, by its name, while `publish` is repeated: until all awaited ones, and for SHORT_S more."""
    found: dict[str, set[str]] = {name: set() for name in buses}
    end_s, more_s = time.monotonic() + PATIENCE_S, 0.0
    while not more_s or time.monotonic() < more_s:
        assert time.monotonic() < end_s, found
        publish()
        for name, bus in buses.items():
            found[name] |= received_keys(bus, 0.02)
        if not more_s and all(keys <= found[name] for name, keys in awaited.items()):
            more_s = time.monotonic() + SHORT_S
    return found


def test_members_publish_only_on_their_own_keys(joined: Callable[[str], ZenohBus]) -> None:
    integrator, one, two, reader = map(joined, ("integrator", "viewer-1", "viewer-2", "reader"))
    integrator.serve_clock()
    for bus in (integrator, reader, two):
        for topic in (CAMERA, SILHOUETTE, PREVIEW, HEALTH):
            bus.subscribe(topic)
        bus.watch_alive()
    integrator.declare_alive("integrator", "main")
    one.declare_alive("viewer", "1")
    with pytest.raises(DuplicateService, match="viewer 1 of rig demo is already running"):
        joined("viewer-1").declare_alive("viewer", "1")
    # Forbidden keys: of another viewer and of the integrator for a viewer; all for a reader.
    reader.publish(CAMERA, camera("2"))
    one.publish(CAMERA, camera("2"))
    one.declare_alive("viewer", "2")
    reader.declare_alive("tracker", "main")
    one.publish(CAMERA, camera("1"))
    late = joined("recorder")  # receives latched messages
    late.subscribe(CAMERA)
    late.watch_alive()
    false_health = m.Health(frame=0, captured_ns=1, service="integrator", id="main", state="", rate=0.0,
                            stages_ms={}, counts={})  # fmt: skip

    def publish() -> None:
        for bus in (one, reader):  # forbidden
            bus.publish(SILHOUETTE, silhouette("2"))
            bus.publish(HEALTH, false_health)
        one.publish(SILHOUETTE, silhouette("1"))
        one.query_clock()
        reader.query_clock()

    own_keys = {"viewer/2/camera", "viewer/2/silhouette", "integrator/main/health", "alive/tracker/main"}
    alive_keys = {"alive/integrator/main", "alive/viewer/1"}
    seen = {"viewer/1/camera", "viewer/1/silhouette"}
    awaited = {
        "integrator": seen, "reader": {*seen, "clock"}, "two": {*alive_keys, "viewer/1/camera"},
        "late": {*alive_keys, "viewer/1/camera"}, "one": {"clock"},
    }  # fmt: skip
    buses = {"integrator": integrator, "reader": reader, "two": two, "late": late, "one": one}
    found = received_by(buses, awaited, publish)
    found["integrator"] -= alive_keys
    found["reader"] -= own_keys | alive_keys
    assert found == awaited  # no previews of other viewers for `two`


def matrix(received: Iterable[tuple[str, str, str]], keys: Iterable[str]) -> Iterator[str]:
    """Table of what certificates may do, by group of keys.  received: by whom, key, from whom, where each put on each key.

    Columns: keys; then of each certificate those on which what it put arrived, and those of which it received others' puts.
    """

    def group(key: str) -> str:
        parts = key.split("/")[2:]
        return "/".join(parts[:2]) if len(parts) == 3 else parts[0]

    arrived = Counter((group(key), name) for key, name in {(key, sender) for _, key, sender in received})
    seen = Counter((group(key), name) for key, name in {(key, receiver) for receiver, key, _ in received})
    names = sorted({name for _, name in (*arrived, *seen)})
    yield "| group | keys |" + "".join(f" {name} put | {name} received |" for name in names)
    yield "|---|" + "--:|" * (1 + 2 * len(names))
    for one, count in Counter(map(group, keys)).items():
        yield f"| {one} | {count} |" + "".join(f" {arrived[one, name]} | {seen[one, name]} |" for name in names)


def test_the_matrix_of_certificates_counts_keys() -> None:
    a, b, clock = "zenocap/demo/viewer/1/bap", "zenocap/demo/viewer/1/bdp", "zenocap/demo/clock"
    assert list(matrix({("x", a, "y"), ("z", a, "y"), ("x", b, "y"), ("y", clock, "x")}, [a, b, clock])) == [
        "| group | keys | x put | x received | y put | y received | z put | z received |",
        "|---|--:|--:|--:|--:|--:|--:|--:|",
        "| viewer/1 | 2 | 0 | 2 | 2 | 0 | 0 | 1 |",
        "| clock | 1 | 1 | 0 | 0 | 1 | 0 | 0 |",
    ]


@pytest.mark.nightly
def test_every_certificate_puts_and_receives_on_every_key_what_the_rules_allow_and_no_more(
    rig_file: Path, session: Callable[[str], zenoh.Session]
) -> None:
    """`pytest -m "" -s tests/system/test_secured.py -k every_certificate` prints the matrix."""
    rig = load_rig(rig_file)
    members = {member.name: member for member in (*needed_members(rig), Member(REPLAY), Member(OPERATOR))}
    places = [(service, id) for service in ("viewer", "integrator") for id in ("1", "2", "main")]
    keys = {topic.at(rig.name, viewer=id, service=service, id=id): topic for topic in TOPICS for service, id in places}
    names = {"rig": rig.name, "service": "viewer", "id": "1", "viewer": "1", "claim": "5", "topic": "universal_bap"}
    others = {
        getattr(topics, name).format(**names): may.get("put", set()) for name, may in KEYS.items() if "HOST" not in name
    }

    def may_put(member: Member, key: str) -> bool:
        if key in others:
            return member.service in others[key]
        return any(zenoh.KeyExpr(one).includes(zenoh.KeyExpr(key)) for one in keys_of(rig.name, member).values())

    def may_receive(member: Member, key: str) -> bool:
        return not (member.service == "viewer" and keys.get(key) in (SILHOUETTE, PREVIEW))

    received: set[tuple[str, str, str]] = set()  # by whom, key, from whom
    sessions = {name: session(name) for name in members if name != ROUTER}
    for name, one in sessions.items():

        def take(sample: zenoh.Sample, receiver: str = name) -> None:
            if (sender := sample.payload.to_string()) != receiver:  # its own come without the router
                received.add((receiver, str(sample.key_expr), sender))

        for expression in (EVERYTHING.format(rig=rig.name), *(topic.on(rig.name) for topic in TOPICS)):
            one.declare_subscriber(expression, take)
    expected = {
        (receiver, key, sender)
        for sender in sessions
        for key in (*keys, *others)
        if may_put(members[sender], key)
        for receiver in sessions
        if receiver != sender and may_receive(members[receiver], key)
    }
    begin_s, end_s = time.monotonic(), 0.0
    while not end_s or time.monotonic() < end_s:
        assert time.monotonic() < begin_s + MATRIX_S, sorted(expected - received)
        for name, one in sessions.items():
            for key in (*keys, *others):
                one.put(key, name)
        time.sleep(0.1)
        if not end_s and received >= expected:
            end_s = time.monotonic() + SHORT_S
    print("", *matrix(received, (*keys, *others)), sep="\n")
    assert received == expected


def test_only_trusted_members_return_the_body_of_a_restarted_integrator(
    joined: Callable[[str], ZenohBus], session: Callable[[str], zenoh.Session]
) -> None:
    """With the certificate of a viewer, neither a false body is returned nor the true one outvoted."""

    def body(frame: int) -> m.UniversalBdp:
        body = m.Body(anatomy="ten-parts", sizes={"torso": (0.5, 0.2, 0.1)}, offsets={})
        return m.UniversalBdp(frame=frame, captured_ns=time.time_ns(), body=body, ratio=1.0)

    key = STATE_RECOVERY.format(rig="demo", topic=UNIVERSAL_BDP.name)
    queries: list[str] = []
    for name in ("viewer-1", "viewer-2", "viewer-1"):
        viewer = session(name)

        def reply(query: zenoh.Query) -> None:
            with query:
                queries.append(str(query.key_expr))
                query.reply(key, encode(body(9)))

        for expression in (key, STATE_RECOVERY.format(rig="demo", topic="*"), EVERYTHING.format(rig="demo")):
            viewer.declare_queryable(expression, reply)
    restarted = joined("integrator")
    for _ in range(5):
        restarted.request_recovery(UNIVERSAL_BDP)
        assert restarted.receive(0.3) is None
    true = body(1)
    animator = joined("animator")
    animator.subscribe(UNIVERSAL_BDP)
    with joined("integrator") as before:
        before.publish(UNIVERSAL_BDP, true)
        assert isinstance(animator.receive(PATIENCE_S), Envelope)
    assert recovered(restarted, UNIVERSAL_BDP).message == true
    assert not queries


def test_only_the_operator_films_and_copies_pictures(
    joined: Callable[[str], ZenohBus], session: Callable[[str], zenoh.Session], stack: ExitStack, tmp_path: Path
) -> None:
    """Of all certificates; nor does a viewer answer in place of another one."""
    clock, tap = RealClock(), Tap((64, 48), 10.0)
    film = FilmEndpoint(tap, "cam", tmp_path, Permission(film=True, read=True), clock, "lab")
    key = FILM.format(rig="demo", viewer="1")

    def asked(of: zenoh.Session, what: str, wait_s: float = PATIENCE_S, **fields: int) -> m.FilmReply | None:
        query = m.FilmQuery(frame=1, captured_ns=1, what=what, sender="me", film="walk", camera="cam", **fields)
        reply = FilmSession(of).ask(key, query, wait_s).get(key)
        assert not isinstance(reply, str)
        return reply

    joined("viewer-1").serve_films("1", film.answer, film.check, film.sender)
    answered: list[str] = []

    def answer(query: m.FilmQuery) -> m.FilmReply:
        answered.append(query.what)
        return film.answer(query)

    stack.callback(QueryServer(session("viewer-2"), key, m.FilmQuery, answer).undeclare)
    operator = session(OPERATOR)
    wait_until(lambda: asked(operator, "open", SHORT_S) is not None, tmp_path)
    tap.offer(np.zeros((48, 64, 3), np.uint8), clock.now_ns())
    assert asked(operator, "state").state == "ready"
    for name in ("reader", "viewer-1", "viewer-2", "integrator", "animator", "recorder", "replay"):
        other = session(name)
        for what in ("state", "start", "stop", "files", "read", "detect"):
            assert asked(other, what, SHORT_S) is None, (name, what)
    assert asked(operator, "start", begin_ns=clock.now_ns()).refused == ""
    for _ in range(3):
        tap.offer(np.zeros((48, 64, 3), np.uint8), clock.now_ns())
    asked(operator, "stop")
    assert len(asked(operator, "read").data) > 500
    assert not answered


def test_replay_may_publish_in_place_of_any_service(joined: Callable[[str], ZenohBus]) -> None:
    reader, replay = joined("reader"), joined(REPLAY)
    reader.subscribe(SILHOUETTE)
    reader.subscribe(CAMERA)
    reader.watch_alive()
    replay.declare_alive("viewer", "2")
    replay.publish(CAMERA, camera("2"))
    awaited = {"reader": {"viewer/2/camera", "viewer/2/silhouette", "alive/viewer/2"}}
    assert received_by({"reader": reader}, awaited, lambda: replay.publish(SILHOUETTE, silhouette("2"))) == awaited


def open_within(zenoh_options: ZenohOptions, seconds: float) -> None:
    end_s = time.monotonic() + seconds
    with open_session(zenoh_options, lambda: time.monotonic() > end_s):
        pass


def test_certificate_of_another_authority_is_rejected(rig_file: Path, endpoint: str) -> None:
    open_within(member(rig_file, endpoint, "viewer-1"), PATIENCE_S)
    with pytest.raises(BusError, match="stopped while waiting for a Zenoh router"):
        open_within(member(rig_file, endpoint, "viewer-1", "other-authority"), SHORT_S)


def test_connection_without_a_certificate_is_rejected(rig_file: Path, endpoint: str) -> None:
    plain = zenoh.Config()
    authority = str(rig_file.parent / "certs" / "authority.pem")
    for key, value in (
        ("mode", "client"), ("scouting/multicast/enabled", False), ("transport/link/tls/root_ca_certificate", authority),
    ):  # fmt: skip
        plain.insert_json5(key, json.dumps(value))
    for address in (endpoint, endpoint.replace("tls/", "tcp/")):
        plain.insert_json5("connect/endpoints", json.dumps([address]))
        with pytest.raises(zenoh.ZError, match="Unable to connect"):
            zenoh.open(plain)


def test_router_with_the_certificate_of_another_host_is_rejected(rig_file: Path, endpoint: str, tmp_path: Path) -> None:
    """A member with a valid certificate cannot act as the router: its certificate is for another host."""
    rig = load_rig(rig_file)
    certify(
        rig_file.parent / "certs", rig.name, {Member("viewer", "1"): ("elsewhere.lab",)}, datetime.now(UTC), 1, renew=True
    )
    place = f"tls/127.0.0.1:{free_ports(1)[0]}"
    fake = ZenohOptions("router", listen=(place,), multicast_scouting=False, security=security_of([rig], "viewer-1"))
    try:
        with open_session(fake), pytest.raises(BusError, match="stopped while waiting"):
            open_within(replace(member(rig_file, endpoint, "viewer-2"), connect=(place,)), SHORT_S)
    finally:
        certify(rig_file.parent / "certs", rig.name, {Member("viewer", "1"): HOSTS}, datetime.now(UTC), 1, renew=True)


def test_only_the_recognizer_puts_the_keys_of_commands(
    joined: Callable[[str], ZenohBus], session: Callable[[str], zenoh.Session]
) -> None:
    received: list[tuple[str, bytes]] = []
    reader = session("reader")
    for key in ("demo/slides/next", "demo/slides/previous"):
        reader.declare_subscriber(key, lambda sample: received.append((str(sample.key_expr), sample.payload.to_bytes())))
    viewer, recognizer = joined("viewer-1"), joined("recognizer")
    end_s = time.monotonic() + PATIENCE_S
    while not received:  # until the subscription has reached the router
        assert time.monotonic() < end_s
        viewer.put("demo/slides/next", b"forged")
        viewer.put("demo/slides/previous", b"forged")
        recognizer.put("demo/other", b"not of a command")
        recognizer.put("demo/slides/next", b"1")
        time.sleep(0.05)
    assert set(received) == {("demo/slides/next", b"1")}


def test_the_whole_pipeline_through_a_secured_router(secured_rig: SessionRig) -> None:
    with ZenohBus.open(member(secured_rig.file, secured_rig.endpoint, "reader"), "demo", RealClock()) as bus:
        for topic in (UNIVERSAL_BAP, HEALTH, POSTURE):
            bus.subscribe(topic)
        poses, offsets = 0, set()

        def whole() -> bool:
            nonlocal poses
            match bus.receive(0.2):
                case Envelope(message=m.UniversalBap(stale=[])):
                    poses += 1
                case Envelope(message=m.Health(clock_error_ns=error_ns) as health) if error_ns:
                    offsets.add((health.service, health.id))
            return poses >= 30 and len(offsets) == 4

        wait_until(whole, secured_rig.folder)


def test_the_take_of_a_secured_rig_verifies(secured_rig: SessionRig, secured_take: Path) -> None:
    assert len(poses_in(secured_take)) >= 30
    assert recomputed_poses(secured_take) >= 30
    assert "Traceback" not in output_of(secured_rig.folder)


@pytest.mark.nightly
def test_a_secured_mesh_of_peers_on_one_machine(rig_file: Path, tmp_path: Path) -> None:
    with started(["up", rig_file, "--mode", "peer", "--no-page", "--recordings", tmp_path], tmp_path) as launcher:
        # 20 lines with a pose
        wait_until(lambda: output_of(tmp_path).count("°") > 100 or launcher.poll() is not None, tmp_path)
        assert ended(launcher, signal.SIGINT) == 0, output_of(tmp_path)
    (take,) = tmp_path.glob("demo-*.mcap")
    assert len([pose for pose in poses_in(take) if not pose.stale]) > 20
