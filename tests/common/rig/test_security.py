"""A secured rig: its certificates, and the Zenoh configuration from them."""

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from zenocap.common.bus.access import Member
from zenocap.common.bus.protocol import BusError
from zenocap.common.bus.security import Security, secured
from zenocap.common.bus.zenoh_session import ZenohOptions, configuration
from zenocap.common.errors import UserError
from zenocap.common.rig.rig import Rig, demo_rig, demo_rig_file, load_rig
from zenocap.common.rig.security import allowed_members, host_of, needed_members, security_in, security_of
from zenocap.tools.setup.certificates.folder import certify, revoke


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    return replace(demo_rig("two-view"), security=tmp_path)


@pytest.fixture
def files(tmp_path: Path) -> Security:
    for name in ("authority.pem", "viewer-1.pem", "viewer-1-key.pem"):
        (tmp_path / name).write_text("content is Zenoh's business")
    return security_in(tmp_path, "viewer-1")


def demo_with(folder: Path, text: str) -> Path:
    for name in ("demo-two-view.toml", "demo-calibration.toml"):
        (folder / name).write_text(demo_rig_file("two-view").with_name(name).read_text())
    path = folder / "demo-two-view.toml"
    path.write_text(path.read_text() + text)
    return path


def test_a_rig_file_sets_the_folder_of_certificates_and_an_unknown_key_is_an_error(tmp_path: Path) -> None:
    assert demo_rig("two-view").security is None
    assert load_rig(demo_with(tmp_path, "\n[security]\n")).security == tmp_path / "certs"
    assert load_rig(demo_with(tmp_path, '\n[security]\ncertificates = "/etc/zenocap"\n')).security == Path("/etc/zenocap")
    with pytest.raises(UserError, match=r"security\.certificate = 'x': no such key; .* did you mean 'certificates'"):
        load_rig(demo_with(tmp_path, '\n[security]\ncertificate = "x"\n'))


def test_members_that_need_a_certificate(rig: Rig) -> None:
    needed = [member.name for member in needed_members(rig)]
    assert needed == ["viewer-1", "viewer-2", "integrator", "recognizer", "animator", "reader", "recorder", "router"]
    assert {member.name for member in allowed_members(rig)} == {*needed, "tracker", "replay", "operator"} - {"router"}


def test_rigs_of_one_router_must_share_one_folder_of_certificates(rig: Rig, tmp_path: Path) -> None:
    lab = replace(rig, name="lab")
    both = security_of([rig, lab], "router")
    assert {"demo/viewer/1", "lab/viewer/1"} <= {subject["id"] for subject in json.loads(both.access)["subjects"]}
    with pytest.raises(ValueError, match=r"security\.certificates differ"):
        security_of([rig, replace(lab, security=tmp_path / "other")], "router")
    with pytest.raises(ValueError, match=r"security\.certificates differ .*lab: none"):
        security_of([rig, replace(lab, security=None)], "router")
    assert security_of([replace(rig, security=None)], "router") is None
    assert security_of([], "router") is None


@pytest.mark.parametrize("where", ["connect", "listen"])
def test_endpoints_without_tls_are_refused(files: Security, where: str) -> None:
    endpoints = {"connect": (), "listen": ()} | {where: ("tcp/10.0.0.1:7447",)}
    with pytest.raises(BusError, match=rf"{where} = 'tcp/10\.0\.0\.1:7447': allowed .* tls/HOST:PORT"):
        secured(files, "client", endpoints["connect"], endpoints["listen"])


def test_error_names_the_missing_file(files: Security) -> None:
    files.key.unlink()
    with pytest.raises(BusError, match=r"viewer-1-key\.pem: .*zenocap certs"):
        secured(files, "client", (), ())


def test_peers_and_routers_listen_with_tls_and_enforce_the_access_rules(files: Security) -> None:
    with_rules = replace(files, access='{"enabled": true}')
    assert secured(with_rules, "peer", (), ())["listen/endpoints"] == '["tls/[::]:0"]'
    assert secured(with_rules, "router", (), ())["listen/endpoints"] == '["tls/[::]:7447"]'
    assert "listen/endpoints" not in secured(with_rules, "router", (), ("tls/0.0.0.0:1",))
    assert secured(with_rules, "peer", (), ())["access_control"] == '{"enabled": true}'
    assert "access_control" not in secured(with_rules, "client", (), ())
    with pytest.raises(BusError, match="allowed with certificates only, without a rig: 'client'"):
        secured(files, "peer", (), ())


def test_a_configuration_file_cannot_disable_tls_or_access_control(files: Security, tmp_path: Path) -> None:
    insecure_file = tmp_path / "open.json5"
    insecure_file.write_text('{ access_control: { enabled: false }, transport: { link: { protocols: ["tcp", "tls"] } } }')
    security = replace(files, access='{"enabled": true, "default_permission": "deny"}')
    config = configuration(ZenohOptions("peer", config_file=insecure_file, security=security))
    assert json.loads(config.get_json("transport/link/protocols")) == ["tls"]
    assert json.loads(config.get_json("access_control"))["enabled"] is True
    assert json.loads(config.get_json("transport/link/tls"))["enable_mtls"] is True


@pytest.mark.parametrize(
    ("endpoint", "host"), [("tls/192.168.1.10:7447", "192.168.1.10"), ("tls/[::1]:7447", "::1"), ("tls/router:1", "router")]
)
def test_the_host_of_an_endpoint(endpoint: str, host: str) -> None:
    assert host_of(endpoint) == host


def test_a_list_in_the_folder_applies_to_every_member_that_enforces_rules(rig: Rig, tmp_path: Path) -> None:
    now = datetime(2026, 1, 2, tzinfo=UTC)
    certify(tmp_path, rig.name, {Member("viewer", "1"): ["localhost"]}, now, 30)
    revoke(tmp_path, rig.name, [Member("viewer", "1")], now)
    for name in ("integrator", "router"):  # a peer, or a router
        security = security_of([rig], name)
        names = [one["cert_common_names"] for one in json.loads(security.access)["subjects"]]
        assert ["demo/viewer/1@1"] in names
        assert ["demo/viewer/1"] not in names
    (tmp_path / "revoked.json").write_text('{"number": 2, "generations": {}, "signature": ""}')
    with pytest.raises(UserError, match=r"revoked\.json: not signed by the authority"):
        security_of([rig], "integrator")
