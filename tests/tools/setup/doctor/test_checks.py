"""Checks of the doctor: each fault is found and named, with a remedy; the rest is reported as good."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.built_messages import built
from zenocap.common.messages import AdviceCode, CameraAdvice, CameraFault, Health, ServiceInfo
from zenocap.common.runtime.clock_offset import Offset
from zenocap.tools.setup.doctor import machine_checks as machine
from zenocap.tools.setup.doctor import network_checks as net
from zenocap.tools.setup.doctor.finding import CheckResult

NOW = datetime(2026, 1, 2, tzinfo=UTC)
FRAME_NS = 33_000_000
HERE = {"zenocap": "1.0", "python": "3.11.7", "eclipse-zenoh": "1.10.2", "msgspec": "0.20"}
ONE, TWO, INTEGRATOR = ("viewer", "1"), ("viewer", "2"), ("integrator", "main")


def service_info(name: tuple[str, str], digest: str = "abc", **versions: str) -> ServiceInfo:
    found = HERE | {key.replace("_", "-"): value for key, value in versions.items()}
    return ServiceInfo(
        frame=0, captured_ns=0, service=name[0], id=name[1], host=f"pc-{name[1]}", digest=digest, versions=found
    )


def health(name: tuple[str, str], offset_ns: int = 0, **counts: int) -> Health:
    return built(
        Health, service=name[0], id=name[1], rate=30.0, counts=counts, clock_offset_ns=offset_ns, clock_error_ns=100_000,
    )  # fmt: skip


def network(*infos: ServiceInfo, **changes: object) -> net.NetworkState:
    by_service = {(one.service, one.id): one for one in infos}
    return replace(net.NetworkState(None, frozenset(by_service), dict(by_service)), **changes)  # type: ignore[arg-type]


BOTH = network(service_info(ONE), service_info(TWO))
OTHER_RIG = network(service_info(ONE), service_info(TWO, digest="xyz"))
UNREADABLE = network(about={ONE: "ServiceInfo: Invalid enum value 2"}, alive=frozenset({ONE, TWO}))
FAULTY = network(health={ONE: health(ONE, rejected_invalid=3, rejected_names=4), TWO: health(TWO, step_errors=2)})
EXPECTED = [ONE, TWO, INTEGRATOR, ("recognizer", "main")]
STOPPED = net.NetworkState("stopped while waiting")
PART = network(service_info(ONE), service_info(INTEGRATOR))


FINDINGS = {  # of the network, and their expected verdicts and texts
    "same rig file": (net.check_rigs("abc", BOTH), [("ok", "the same for all 2 running services")]),
    "another rig file": (
        net.check_rigs("abc", OTHER_RIG),
        [("wrong", "viewer 2 on pc-2 runs with another rig file or calibration (xyz)")],
    ),
    "unreadable": (
        net.check_rigs("abc", UNREADABLE),
        [("warning", "viewer 1: its reply cannot be decoded"), ("warning", "viewer 2")],
    ),
    "no clocks": (net.check_clocks(network(), FRAME_NS), []),
    "own clock": (
        net.check_clocks(network(offset=Offset(500_000_000, 100_000)), FRAME_NS),
        [("warning", "this machine: its clock is 500.0 ms ahead")],
    ),
    "good messages": (net.check_messages(network(health={ONE: health(ONE)})), [("ok", "all valid")]),
    "bad messages": (
        net.check_messages(FAULTY),
        [("warning", "viewer 1 has rejected 7"), ("warning", "viewer 2: 2 steps failed")],
    ),
    "no service": (net.check_presence(EXPECTED, network(), "studio.toml"), [("ok", "no service is running")]),
    "some services": (
        net.check_presence(EXPECTED, PART, "studio.toml"),
        [("ok", "running"), ("ok", "running"), ("warning", "not on the network"), ("warning", "not on the network")],
    ),
    "closed": ([net.check_open(STOPPED, secured=True)], [("wrong", "stopped while waiting")]),
    "open": ([net.check_open(network(), secured=True)], [("ok", "open")]),
}


@pytest.mark.parametrize(("findings", "expected"), FINDINGS.values(), ids=FINDINGS)
def test_faults_of_the_network_are_reported(findings: list[CheckResult], expected: list[tuple[str, str]]) -> None:
    assert len(findings) == len(expected)
    for finding, (verdict, words) in zip(findings, expected, strict=True):
        assert finding.verdict == verdict
        assert words in finding.words


def test_the_remedy_is_the_command_that_starts_a_service_or_the_certificate() -> None:
    found = net.check_presence(EXPECTED, PART, "studio.toml")
    assert found[2].remedy.endswith("zenocap viewer studio.toml --id 2")
    assert "certificate" in net.check_open(STOPPED, secured=True).remedy


@pytest.mark.parametrize(
    ("versions", "expected"),
    [
        ({}, ["ok"]),
        ({"python": "3.11.9"}, ["ok"]),
        ({"python": "3.13.1"}, ["warning"]),
        ({"eclipse_zenoh": "1.9.0"}, ["warning"]),
        ({"zenocap": "2.0"}, ["wrong"]),
        ({"zenocap": "2.0", "python": "3.13.1"}, ["wrong", "warning"]),
    ],
)
def test_differing_versions_are_reported(versions: dict[str, str], expected: list[str]) -> None:
    found = net.check_versions(HERE, network(service_info(ONE), service_info(TWO, **versions)))
    assert [finding.verdict for finding in found] == expected


@given(st.integers(min_value=-(10**12), max_value=10**12))
def test_clock_offset_above_a_quarter_frame_is_a_warning(offset_ns: int) -> None:
    (found,) = net.check_clocks(network(health={ONE: health(ONE, offset_ns)}), FRAME_NS)
    assert found.verdict == ("warning" if abs(offset_ns) > FRAME_NS / 4 else "ok")


@pytest.mark.parametrize(
    ("finding", "verdict"),
    [
        (machine.check_endpoint(machine.Endpoint("tcp/a:1")), "ok"),
        (machine.check_endpoint(machine.Endpoint("tcp/a:1", "Connection refused")), "wrong"),
        (
            machine.check_endpoint(machine.Endpoint("tls/a:1", "TLS fails", trusted=False)),
            "wrong",
        ),
        (machine.check_source(machine.SourceState("1", "good", "", True)), "ok"),
        (machine.check_source(machine.SourceState("1", "used", "", False)), "ok"),
        (machine.check_source(machine.SourceState("1", "missing", "", True)), "wrong"),
        (machine.check_source(machine.SourceState("1", "missing", "", False)), "warning"),
        (machine.check_source(machine.SourceState("1", "size", "", False)), "wrong"),
        (machine.check_disk(machine.Disk(Path("x"), None, 10**12)), "ok"),
        (machine.check_disk(machine.Disk(Path("x"), None, None)), "ok"),
        (machine.check_disk(machine.Disk(Path("x"), None, 10**8)), "warning"),
        (machine.check_disk(machine.Disk(Path("x"), "cannot be written to", None)), "wrong"),
        (machine.check_port(machine.Port("page", "animator.page.port", "a:1")), "ok"),
        (machine.check_port(machine.Port("page", "animator.page.port", "a:1", "in use")), "wrong"),
        (machine.check_port(machine.Port("page", "animator.page.port", "a:1", "in use", ours=True)), "ok"),
        (machine.check_certificate(machine.Certificate("router", None, NOW + timedelta(days=100)), NOW), "ok"),
        (machine.check_certificate(machine.Certificate("router", None, NOW + timedelta(days=10)), NOW), "warning"),
        (machine.check_certificate(machine.Certificate("router", None, NOW), NOW), "wrong"),
        (machine.check_certificate(machine.Certificate("router", "no file", None), NOW), "wrong"),
        (machine.check_certificate(machine.Certificate("router", None, NOW + timedelta(days=100), True), NOW), "wrong"),
        (machine.check_compiled([]), "ok"),
        (machine.check_compiled(["tracking"]), "warning"),
        (machine.check_file("postures", None), "ok"),
        (machine.check_file("postures", "no such file"), "wrong"),
    ],
)
def test_only_faults_have_a_remedy(finding: CheckResult, verdict: str) -> None:
    assert finding.verdict == verdict
    assert bool(finding.remedy) is (verdict != "ok")


def test_remedy_for_an_untrusted_endpoint_is_new_certificates() -> None:
    assert "firewall" in machine.check_endpoint(machine.Endpoint("tcp/a:1", "Connection refused")).remedy
    assert "zenocap certs" in machine.check_endpoint(machine.Endpoint("tls/a:1", "TLS fails", trusted=False)).remedy


def test_faults_of_images_are_warnings_with_what_to_change() -> None:
    fault = CameraFault(code=AdviceCode.FOCUS, value=6.0, limit=3.5, unit="px")
    faults = {"1": [fault], "2": []}
    advice = {name: CameraAdvice(frame=0, captured_ns=0, viewer=name, faults=found) for name, found in faults.items()}
    soft, good = net.check_pictures(net.NetworkState(advice=advice))
    assert (soft.check, soft.verdict) == ("images of viewer 1", "warning")
    assert "6.0 px" in soft.words
    assert "focus" in soft.remedy
    assert (good.check, good.verdict) == ("images of viewer 2", "ok")
    assert net.check_pictures(net.NetworkState()) == []


def test_cameras_more_than_a_quarter_frame_apart_are_a_warning() -> None:
    key = ("integrator", "main")
    for skew_us, verdict in ((5_000, "ok"), (40_000, "warning")):
        report = built(
            Health, service="integrator", id="main", state="viewer 2 40 ms late", counts={"camera_skew_us": skew_us},
        )  # fmt: skip
        (found,) = net.check_delays(net.NetworkState(health={key: report}), 33_333_333)
        assert (found.verdict, f"{skew_us // 1000} ms apart" in found.words) == (verdict, True)
        assert ("viewer 2 40 ms late" in found.words, "delay_ms" in found.remedy) == ((verdict == "warning"),) * 2
    assert net.check_delays(net.NetworkState(), 33_333_333) == []
