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
from zenocap.tools.setup.doctor.finding import CheckResult
from zenocap.tools.setup.doctor.machine_checks import (
    Certificate,
    Disk,
    Endpoint,
    Port,
    SourceState,
    check_certificate,
    check_compiled,
    check_disk,
    check_endpoint,
    check_file,
    check_port,
    check_source,
)
from zenocap.tools.setup.doctor.network_checks import (
    NetworkState,
    check_clocks,
    check_delays,
    check_messages,
    check_open,
    check_pictures,
    check_presence,
    check_rigs,
    check_versions,
)

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


def verdicts(findings: list[CheckResult]) -> list[str]:
    return [finding.verdict for finding in findings]


def network(*infos: ServiceInfo, **changes: object) -> NetworkState:
    by_service = {(one.service, one.id): one for one in infos}
    return replace(NetworkState(None, frozenset(by_service), dict(by_service)), **changes)  # type: ignore[arg-type]


def test_differing_rig_file_is_reported_with_its_machine() -> None:
    (found,) = check_rigs("abc", network(service_info(ONE), service_info(TWO, digest="xyz")))
    assert found.verdict == "wrong"
    assert "viewer 2 on pc-2" in found.words
    assert "xyz" in found.words
    assert verdicts(check_rigs("abc", network(service_info(ONE), service_info(TWO)))) == ["ok"]


def test_service_without_readable_info_is_reported() -> None:
    unreadable = replace(
        network(service_info(ONE)), about={ONE: "ServiceInfo: Invalid enum value 2"}, alive=frozenset({ONE, TWO})
    )
    found = check_rigs("abc", unreadable)
    assert verdicts(found) == ["warning", "warning"]
    assert "viewer 1: its reply cannot be decoded" in found[0].words
    assert "viewer 2" in found[1].words


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
    assert verdicts(check_versions(HERE, network(service_info(ONE), service_info(TWO, **versions)))) == expected


@given(st.integers(min_value=-(10**12), max_value=10**12))
def test_clock_offset_above_a_quarter_frame_is_a_warning(offset_ns: int) -> None:
    found = check_clocks(network(health={ONE: health(ONE, offset_ns)}), FRAME_NS)
    assert verdicts(found) == (["warning"] if abs(offset_ns) > FRAME_NS / 4 else ["ok"])


def test_clock_of_this_machine_is_checked() -> None:
    (found,) = check_clocks(network(offset=Offset(500_000_000, 100_000)), FRAME_NS)
    assert found.verdict == "warning"
    assert found.words.startswith("this machine: its clock is 500.0 ms ahead")
    assert check_clocks(network(), FRAME_NS) == []


def test_rejected_messages_and_failing_steps_are_reported() -> None:
    faulty = network(health={ONE: health(ONE, rejected_invalid=3, rejected_names=4), TWO: health(TWO, step_errors=2)})
    found = check_messages(faulty)
    assert verdicts(found) == ["warning", "warning"]
    assert "viewer 1 has rejected 7" in found[0].words
    assert verdicts(check_messages(network(health={ONE: health(ONE)}))) == ["ok"]


def test_missing_service_is_reported_with_its_start_command() -> None:
    expected = [ONE, TWO, INTEGRATOR, ("recognizer", "main")]
    found = check_presence(expected, network(service_info(ONE), service_info(INTEGRATOR)), "studio.toml")
    assert verdicts(found) == ["ok", "ok", "warning", "warning"]
    assert found[2].remedy.endswith("zenocap viewer studio.toml --id 2")
    assert verdicts(check_presence(expected, network(), "studio.toml")) == ["ok"]


def test_network_that_cannot_be_opened_is_reported() -> None:
    found = check_open(NetworkState("stopped while waiting"), secured=True)
    assert found.verdict == "wrong"
    assert "certificate" in found.remedy
    assert check_open(network(), secured=True).verdict == "ok"


@pytest.mark.parametrize(
    ("finding", "verdict"),
    [
        (check_endpoint(Endpoint("tcp/a:1")), "ok"),
        (check_endpoint(Endpoint("tcp/a:1", "Connection refused")), "wrong"),
        (check_endpoint(Endpoint("tls/a:1", "its certificate is not accepted: self-signed", trusted=False)), "wrong"),
        (check_source(SourceState("1", "good", "", True)), "ok"),
        (check_source(SourceState("1", "used", "", False)), "ok"),
        (check_source(SourceState("1", "missing", "", True)), "wrong"),
        (check_source(SourceState("1", "missing", "", False)), "warning"),
        (check_source(SourceState("1", "size", "", False)), "wrong"),
        (check_disk(Disk(Path("x"), None, 10**12)), "ok"),
        (check_disk(Disk(Path("x"), None, None)), "ok"),
        (check_disk(Disk(Path("x"), None, 10**8)), "warning"),
        (check_disk(Disk(Path("x"), "cannot be written to", None)), "wrong"),
        (check_port(Port("page", "animator.page.port", "a:1")), "ok"),
        (check_port(Port("page", "animator.page.port", "a:1", "in use")), "wrong"),
        (check_port(Port("page", "animator.page.port", "a:1", "in use", ours=True)), "ok"),
        (check_certificate(Certificate("router", None, NOW + timedelta(days=100)), NOW), "ok"),
        (check_certificate(Certificate("router", None, NOW + timedelta(days=10)), NOW), "warning"),
        (check_certificate(Certificate("router", None, NOW), NOW), "wrong"),
        (check_certificate(Certificate("router", "no file", None), NOW), "wrong"),
        (check_certificate(Certificate("router", None, NOW + timedelta(days=100), True), NOW), "wrong"),
        (check_compiled([]), "ok"),
        (check_compiled(["tracking"]), "warning"),
        (check_file("postures", None), "ok"),
        (check_file("postures", "no such file"), "wrong"),
    ],
)
def test_only_faults_have_a_remedy(finding: CheckResult, verdict: str) -> None:
    assert finding.verdict == verdict
    assert bool(finding.remedy) is (verdict != "ok")


def test_remedy_for_an_untrusted_endpoint_is_new_certificates() -> None:
    assert "firewall" in check_endpoint(Endpoint("tcp/a:1", "Connection refused")).remedy
    assert "zenocap certs" in check_endpoint(Endpoint("tls/a:1", "TLS fails", trusted=False)).remedy


def test_faults_of_images_are_warnings_with_what_to_change() -> None:
    fault = CameraFault(code=AdviceCode.FOCUS, value=6.0, limit=3.5, unit="px")
    faults = {"1": [fault], "2": []}
    advice = {name: CameraAdvice(frame=0, captured_ns=0, viewer=name, faults=found) for name, found in faults.items()}
    soft, good = check_pictures(NetworkState(advice=advice))
    assert (soft.check, soft.verdict) == ("images of viewer 1", "warning")
    assert "6.0 px" in soft.words
    assert "focus" in soft.remedy
    assert (good.check, good.verdict) == ("images of viewer 2", "ok")
    assert check_pictures(NetworkState()) == []


def test_cameras_more_than_a_quarter_frame_apart_are_a_warning() -> None:
    key = ("integrator", "main")
    for skew_us, verdict in ((5_000, "ok"), (40_000, "warning")):
        report = built(
            Health, service="integrator", id="main", state="viewer 2 40 ms late", counts={"camera_skew_us": skew_us},
        )  # fmt: skip
        (found,) = check_delays(NetworkState(health={key: report}), 33_333_333)
        assert (found.verdict, f"{skew_us // 1000} ms apart" in found.words) == (verdict, True)
        assert ("viewer 2 40 ms late" in found.words, "delay_ms" in found.remedy) == ((verdict == "warning"),) * 2
    assert check_delays(NetworkState(), 33_333_333) == []
