"""The command that lists cameras and tries streams: cameras."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.live_page import FpsOption, HostOption, PortOption, SizeOption, TokenOption, page_table, run_page
from zenocap.tools.cli.options import DONE, FAILED, JsonOption, one_line_errors
from zenocap.tools.cli.progress import progress
from zenocap.tools.service_arguments import ZenohArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from ssl import SSLContext

    from zenocap.common.video.v4l2.listing import FoundCamera
    from zenocap.tools.cameras.onvif_http import User
    from zenocap.tools.cameras.streams import TriedStream


def cameras(
    urls: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[URL... | RIG | NAME=SOURCE...]",
            help="Network streams to try (rtsp, rtsps, http, https); default: list the cameras of this machine. With "
            "--live: a rig file, or NAME=SOURCE as for `zenocap film`, SOURCE also a video file; default: all cameras. "
            "With --onvif: HOST of each camera; default: those that answer a probe.",
            show_default=False,
        ),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--pictures",
            metavar="FOLDER",
            help="Write a small picture of each camera to this folder.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
    discover: Annotated[
        bool,
        typer.Option("--discover", help="List the cameras of all machines on which `zenocap viewer --discover` runs."),
    ] = False,
    onvif: Annotated[
        bool, typer.Option("--onvif", help="List network cameras that have ONVIF, their streams, and try these.")
    ] = False,
    user: Annotated[
        str | None,
        typer.Option(
            "--user",
            metavar="NAME",
            help="With --onvif: user of the cameras; the password is asked for.",
            show_default=False,
        ),
    ] = None,
    certificates: Annotated[
        Path | None,
        typer.Option(
            "--certificates",
            metavar="FILE",
            help="With --onvif: certificates of cameras or their authority that are trusted (PEM); default: the system's.",
            show_default=False,
        ),
    ] = None,
    any_certificate: Annotated[
        bool,
        typer.Option("--any-certificate", help="With --onvif: do not check who answers at an https address."),
    ] = False,
    interface: Annotated[
        str | None,
        typer.Option(
            "--interface",
            metavar="ADDRESS",
            help="With --onvif: own IPv4 address on the network of the cameras; default: that of the default route.",
            show_default=False,
        ),
    ] = None,
    live: Annotated[bool, typer.Option("--live", help="Show the pictures and measures of the cameras on a page.")] = False,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
    token: TokenOption = None,
    size: SizeOption = "1280x720",
    fps: FpsOption = 30.0,
    *,
    zenoh: ZenohArguments,
) -> None:
    """List the cameras of this machine: what to write into a rig file, modes, controls. Or try network streams.

    The name in `/dev/v4l/by-id` stays with the camera when it is plugged in again or the machine starts anew, `/dev/video0`
    need not. Of a stream: size, rate as measured over 2 s, codec, time to the first image; or the reason why there is none.
    Nothing is changed in the cameras; --pictures fails for one that another program uses.

    With --discover: the cameras of all machines of the network that announce them, none of this one unless it does.

    With --onvif: a multicast probe finds the cameras of the local network that have ONVIF; each is asked for its streams,
    and without --json these are tried. Most want a user. The password goes to the cameras that answered, as a digest where
    ONVIF is asked, and is not printed: put it into the source in the rig file, `rtsp://NAME:PASSWORD@HOST/...`. The
    certificate of an https address is checked; --certificates names those that are trusted.

    Exit status 1: there is no camera, or a camera or stream gave no answer or picture.

    With --live, a page at http://127.0.0.1:8090 shows all cameras side by side, with rate, focus, exposure, noise and
    flicker of each, and what to do where one is bad. Cameras are opened as `zenocap film` opens them. Pictures stay on
    this machine unless --host is given.

    Examples: `zenocap cameras --pictures seen`, `zenocap cameras rtsp://192.168.1.20/stream`, `zenocap cameras --live`
    """
    if discover and (urls or pictures is not None or live):
        raise typer.BadParameter("--discover: allowed without URL, --pictures and --live")
    if (user is not None or interface is not None) and not onvif:
        raise typer.BadParameter("--user, --interface: allowed with --onvif")
    if (certificates is not None or any_certificate) and not onvif:
        raise typer.BadParameter("--certificates, --any-certificate: allowed with --onvif")
    if certificates is not None and any_certificate:
        raise typer.BadParameter("--any-certificate: allowed without --certificates")
    if interface is not None and urls:
        raise typer.BadParameter("--interface: allowed without HOST, which need no probe")
    if onvif and (discover or live):
        raise typer.BadParameter("--onvif: allowed without --discover and --live")
    if live:
        if pictures is not None or as_json:
            raise typer.BadParameter("--live: allowed: without --pictures and --json")
        with one_line_errors():
            from zenocap.tools.live.page import CamerasOnly

            table = page_table(host, port, token)
            run_page(urls or [], size, fps, table, "zenocap cameras --live", lambda *_: CamerasOnly())
        return
    with one_line_errors():
        if discover:
            raise typer.Exit(DONE if _discovered(zenoh, as_json) else FAILED)
        if onvif:
            password = None if user is None else typer.prompt(f"password of {user}", hide_input=True, err=True)
            from zenocap.tools.cameras.onvif_http import User, trusted

            own = None if user is None or password is None else User(user, password)
            tls = trusted(certificates, any_certificate=any_certificate)
            raise typer.Exit(DONE if _onvif(urls or [], interface, own, tls, pictures, as_json) else FAILED)
        good = _streams(urls, pictures, as_json) if urls else _devices(pictures, as_json)
    raise typer.Exit(DONE if good else FAILED)


def _devices(folder: Path | None, as_json: bool) -> bool:
    from zenocap.common.video.v4l2.listing import found_cameras
    from zenocap.tools.cameras.pictures import camera_image, written_pictures
    from zenocap.tools.cameras.text import camera_data, camera_lines

    found = found_cameras()
    paths: dict[str, str] = {}
    without: list[FoundCamera] = []
    if folder is not None:
        images = {str(one.path): camera_image(one) for one in found if not one.problem}
        paths = written_pictures(folder, {name: image for name, image in images.items() if image is not None})
        without = [one for one in found if not one.problem and str(one.path) not in paths]
    if as_json:
        reason = "no image: another program uses the camera, or its USB port has no bandwidth left"
        _print_json([camera_data(one, paths.get(str(one.path)), reason if one in without else "") for one in found])
    else:
        for line in camera_lines(found):
            _print(line)
        _print_pictures(paths)
        for one in without:
            _print(
                f"{one.path}: no image: another program uses the camera, or its USB port has no bandwidth left", err=True
            )
    return bool(found) and not without and not any(one.problem for one in found)


def _discovered(zenoh: ZenohArguments, as_json: bool) -> bool:
    import time

    from zenocap.common.bus.zenoh_film import FilmSession
    from zenocap.tools.cameras.hosts import PATIENCE_S, announced, host_data, host_lines

    end_s = time.monotonic() + PATIENCE_S
    options = zenoh.options()
    with progress("listening for cameras"), FilmSession.open(options, lambda: time.monotonic() > end_s) as session:
        hosts = announced(session)
    if as_json:
        _print_json(host_data(hosts))
    else:
        for line in host_lines(hosts):
            _print(line)
    if not any(host.cameras for host in hosts):
        advice = "run `zenocap viewer --discover` where the cameras are"
        _print(f"no machine of this network announces a camera: {advice}", err=True)
        return False
    return True


def _onvif(
    hosts: list[str], interface: str | None, own: User | None, tls: SSLContext, folder: Path | None, as_json: bool
) -> bool:
    from zenocap.tools.cameras.onvif_device import asked_devices, device_address, with_user
    from zenocap.tools.cameras.onvif_discovery import OnvifDevice, found_devices
    from zenocap.tools.cameras.text import onvif_data, onvif_lines

    devices = [OnvifDevice(device_address(host)) for host in hosts]
    with progress("looking for ONVIF cameras"):
        asked = asked_devices(devices or found_devices(interface), own, tls)
    if as_json:
        _print_json(onvif_data(asked))
    else:
        for line in onvif_lines(asked):
            _print(line)
    if not asked:
        advice = "give their addresses, or --interface with your own address on their network"
        _print(f"no ONVIF camera answers here: {advice}; many have ONVIF switched off", err=True)
        return False
    urls = [with_user(one.device, stream, own) for one in asked for stream in one.streams]
    tried = as_json or not urls or _streams(urls, folder, as_json)
    return tried and not any(one.problem for one in asked)


def _streams(urls: list[str], folder: Path | None, as_json: bool) -> bool:
    from zenocap.tools.cameras.pictures import written_pictures
    from zenocap.tools.cameras.streams import tried_streams
    from zenocap.tools.cameras.text import stream_data, stream_lines

    with progress("trying the streams"):
        found: list[TriedStream] = tried_streams(urls)
    paths: dict[str, str] = {}
    if folder is not None:
        paths = written_pictures(folder, {one.address: one.image for one in found if one.image is not None})
    if as_json:
        _print_json([stream_data(one, paths.get(one.address)) for one in found])
    else:
        for line in stream_lines(found):
            _print(line)
        _print_pictures(paths)
    return all(one.size is not None for one in found)


def _print_pictures(paths: dict[str, str]) -> None:
    for name, path in paths.items():
        _print(f"picture of {name}: {path}")


def _print(line: str, err: bool = False) -> None:
    """Names come from cameras and servers."""
    from zenocap.common.runtime.foreign_text import MAX_LINE, printable

    typer.echo(printable(line, MAX_LINE), err=err)


def _print_json(rows: list[dict[str, object]]) -> None:
    import json

    typer.echo(json.dumps(rows, indent=2))
