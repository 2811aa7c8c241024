"""The doctor's judgement: each fault is found, named and given a remedy; what is well is said to be."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.about import About
from common.messages import Health
from common.runtime.clock import Offset
from services.doctor.finding import Finding
from services.doctor.machine_checks import (
    Certificate,
    Disk,
    Endpoint,
    File,
    Port,
    SourceLook,
    check_certificate,
    check_compiled,
    check_disk,
    check_endpoint,
    check_file,
    check_port,
    check_source,
)
from services.doctor.network_checks import (
    Network,
    check_clocks,
    check_messages,
    check_open,
    check_presence,
    check_rigs,
    check_versions,
    expected_services,
)

NOW = datetime(2026, 1, 2, tzinfo=UTC)
FRAME_NS = 33_000_000
HERE = {"zenocap": "1.0", "python": "3.11.7", "eclipse-zenoh": "1.10.2", "msgspec": "0.20"}
ONE, TWO, INTEGRATOR = ("viewer", "1"), ("viewer", "2"), ("integrator", "main")


def about(name: tuple[str, str], digest: str = "abc", **versions: str) -> About:
    found = HERE | {key.replace("_", "-"): value for key, value in versions.items()}
    return About(frame=0, captured_ns=0, service=name[0], id=name[1], host=f"pc-{name[1]}", digest=digest, versions=found)


def health(name: tuple[str, str], offset_ns: int = 0, **counts: int) -> Health:
    return Health(
        frame=0, captured_ns=0, service=name[0], id=name[1], state="", rate=30.0, stages_ms={}, counts=counts,
        clock_offset_ns=offset_ns, clock_error_ns=100_000,
    )  # fmt: skip


def verdicts(findings: list[Finding]) -> list[str]:
    return [finding.verdict for finding in findings]


def network(*abouts: About, **changes: object) -> Network:
    told = {(one.service, one.id): one for one in abouts}
    return replace(Network(None, frozenset(told), dict(told)), **changes)  # type: ignore[arg-type]


def test_rig_files_that_differ_are_named_with_their_machine() -> None:
    (found,) = check_rigs("abc", network(about(ONE), about(TWO, digest="xyz")))
    assert found.verdict == "wrong"
    assert "viewer 2 on pc-2" in found.words
    assert "xyz" in found.words
    assert verdicts(check_rigs("abc", network(about(ONE), about(TWO)))) == ["ok"]


def test_services_that_cannot_say_what_they_are_are_named() -> None:
    unreadable = replace(network(about(ONE)), about={ONE: "About: Invalid enum value 2"}, alive=frozenset({ONE, TWO}))
    found = check_rigs("abc", unreadable)
    assert verdicts(found) == ["warning", "warning"]
    assert "viewer 1: its answer cannot be read" in found[0].words
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
def test_versions_that_differ(versions: dict[str, str], expected: list[str]) -> None:
    assert verdicts(check_versions(HERE, network(about(ONE), about(TWO, **versions)))) == expected


@given(st.integers(min_value=-(10**12), max_value=10**12))
def test_a_clock_more_than_a_quarter_frame_off_is_a_warning_and_no_other(offset_ns: int) -> None:
    found = check_clocks(network(health={ONE: health(ONE, offset_ns)}), FRAME_NS)
    assert verdicts(found) == (["warning"] if abs(offset_ns) > FRAME_NS / 4 else ["ok"])


def test_this_machines_clock_counts_too() -> None:
    (found,) = check_clocks(network(offset=Offset(500_000_000, 100_000)), FRAME_NS)
    assert found.verdict == "warning"
    assert found.words.startswith("this machine: its clock is 500.0 ms ahead")
    assert check_clocks(network(), FRAME_NS) == []


def test_refused_messages_and_failing_steps_are_told() -> None:
    ill = network(health={ONE: health(ONE, rejected_invalid=3, rejected_names=4), TWO: health(TWO, step_errors=2)})
    found = check_messages(ill)
    assert verdicts(found) == ["warning", "warning"]
    assert "viewer 1 has refused 7" in found[0].words
    assert verdicts(check_messages(network(health={ONE: health(ONE)}))) == ["ok"]


def test_who_is_missing_is_told_with_its_command() -> None:
    expected = expected_services(("1", "2"), tracker=False, recognizer=True)
    assert expected == [ONE, TWO, INTEGRATOR, ("recognizer", "main")]
    found = check_presence(expected, network(about(ONE), about(INTEGRATOR)), "studio.toml")
    assert verdicts(found) == ["ok", "ok", "warning", "warning"]
    assert found[2].remedy.endswith("zenocap viewer studio.toml --id 2")
    assert verdicts(check_presence(expected, network(), "studio.toml")) == ["ok"]


def test_a_network_that_does_not_open() -> None:
    found = check_open(Network("stopped while waiting"), secured=True)
    assert found.verdict == "wrong"
    assert "certificate" in found.remedy
    assert check_open(network(), secured=True).verdict == "ok"


@pytest.mark.parametrize(
    ("finding", "verdict"),
    [
        (check_endpoint(Endpoint("tcp/a:1")), "ok"),
        (check_endpoint(Endpoint("tcp/a:1", "Connection refused")), "wrong"),
        (check_endpoint(Endpoint("tls/a:1", "its certificate is not accepted: self-signed", trusted=False)), "wrong"),
        (check_source(SourceLook("1", "good", "", True)), "ok"),
        (check_source(SourceLook("1", "used", "", False)), "ok"),
        (check_source(SourceLook("1", "missing", "", True)), "wrong"),
        (check_source(SourceLook("1", "missing", "", False)), "warning"),
        (check_source(SourceLook("1", "size", "", False)), "wrong"),
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
        (check_compiled([], 30), "ok"),
        (check_compiled(["common/a.py"], 30), "warning"),
        (check_file(File("postures", None)), "ok"),
        (check_file(File("postures", "no such file")), "wrong"),
    ],
)
def test_each_fault_has_a_remedy_and_what_is_well_has_none(finding: Finding, verdict: str) -> None:
    assert finding.verdict == verdict
    assert bool(finding.remedy) is (verdict != "ok")


def test_what_is_not_trusted_needs_other_certificates_and_no_firewall() -> None:
    assert "firewall" in check_endpoint(Endpoint("tcp/a:1", "Connection refused")).remedy
    assert "zenocap certs" in check_endpoint(Endpoint("tls/a:1", "TLS fails", trusted=False)).remedy
