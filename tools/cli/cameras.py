"""The command that lists cameras and tries streams: cameras."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from zenocap.tools.cli.live_page import ImageArguments, PageArguments, run_page
from zenocap.tools.cli.options import DONE, FAILED, JsonOption, echo, one_line_errors, refuse
from zenocap.tools.cli.progress import progress
from zenocap.tools.option_groups import EXPERT, option
from zenocap.tools.service_arguments import ZenohArguments

if TYPE_CHECKING:  # imported where they are used: `zenocap --help` answers at once
    from zenocap.common.video.v4l2.listing import FoundCamera
    from zenocap.tools.setup.cameras.streams import TriedStream

Urls = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[URL... | RIG | NAME=SOURCE...]",
        help="Network streams to try (rtsp, rtsps, http, https); default: list the cameras of this machine. With "
        "--live: a rig file, or NAME=SOURCE as for `zenocap film`, SOURCE also a video file; default: all cameras. "
        "With --onvif: HOST of each camera; default: those that answer a probe.",
    ),
]


@dataclass(frozen=True)
class CamerasArguments:
    """What is listed, tried or shown."""

    pictures: Path | None = option(
        None, "Write a small picture of each camera to this folder.", "-o", "--pictures", metavar="FOLDER"
    )
    as_json: JsonOption = False
    discover: bool = option(False, "List the cameras of all machines on which `zenocap viewer --discover` runs.")
    onvif: bool = option(False, "List network cameras that have ONVIF, their streams, and try these.")
    user: str | None = option(None, "With --onvif: user of the cameras; the password is asked for.", metavar="NAME")
    live: bool = option(False, "Show the pictures and measures of the cameras on a page.")

    def check(self, urls: list[str] | None, expert: OnvifArguments) -> None:
        """Raises typer.BadParameter for options that exclude each other."""
        has_pictures, has_certificates = self.pictures is not None, expert.certificates is not None
        wrong = {
            "--discover: allowed without URL, --pictures and --live": self.discover and (urls or has_pictures or self.live),
            "--user, --interface: allowed with --onvif": not self.onvif
            and (self.user is not None or expert.interface is not None),
            "--certificates, --any-certificate: allowed with --onvif": (has_certificates or expert.any_certificate)
            and not self.onvif,
            "--any-certificate: allowed without --certificates": has_certificates and expert.any_certificate,
            "--interface: allowed without HOST, which need no probe": expert.interface is not None and urls,
            "--onvif: allowed without --discover and --live": self.onvif and (self.discover or self.live),
            "--live: allowed: without --pictures and --json": self.live and (has_pictures or self.as_json),
        }
        refuse(wrong)


@dataclass(frozen=True)
class OnvifArguments:
    """How network cameras with ONVIF are reached."""

    certificates: Path | None = option(
        None,
        "With --onvif: certificates of cameras or their authority that are trusted (PEM); default: the system's.",
        metavar="FILE",
    )
    any_certificate: bool = option(False, "With --onvif: do not check who answers at an https address.")
    interface: str | None = option(
        None,
        "With --onvif: own IPv4 address on the network of the cameras; default: that of the default route.",
        metavar="ADDRESS",
    )


def cameras(
    urls: Urls = None, *, given: CamerasArguments, images: ImageArguments, expert: Annotated[OnvifArguments, EXPERT],
    page: Annotated[PageArguments, EXPERT], zenoh: ZenohArguments,
) -> None:  # fmt: skip
    """List the cameras of this machine, or try network streams.

    Of a camera: what to write into a rig file, modes, controls. The name in `/dev/v4l/by-id` stays with the camera when
    it is plugged in again or the machine starts anew, `/dev/video0` need not. Of a stream: size, rate as measured over
    2 s, codec, time to the first image; or the reason why there is none. Nothing is changed in the cameras; --pictures
    fails for one that another program uses.

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
    given.check(urls, expert)
    with one_line_errors():
        if given.live:
            from zenocap.tools.setup.page.page import CamerasOnly

            run_page(urls or [], images, page.table(), "zenocap cameras --live", lambda *_: CamerasOnly())
            return
        raise typer.Exit(DONE if _listed(urls or [], given, expert, zenoh) else FAILED)


def _listed(urls: list[str], given: CamerasArguments, expert: OnvifArguments, zenoh: ZenohArguments) -> bool:
    """Print the cameras or streams that are asked for; whether there is one, and all give an answer and a picture."""
    if given.discover:
        return _discovered(zenoh, given.as_json)
    if given.onvif:
        return _onvif(urls, given, expert)
    if urls:
        return _streams(urls, given.pictures, given.as_json)
    return _devices(given.pictures, given.as_json)


def _devices(folder: Path | None, as_json: bool) -> bool:
    from zenocap.common.video.v4l2.listing import found_cameras
    from zenocap.tools.setup.cameras.pictures import camera_image, written_pictures
    from zenocap.tools.setup.cameras.text import camera_data, camera_lines

    found = found_cameras()
    paths: dict[str, str] = {}
    without: list[FoundCamera] = []
    if folder is not None:
        images = {str(one.path): camera_image(one) for one in found if not one.problem}
        paths = written_pictures(folder, {name: image for name, image in images.items() if image is not None})
        without = [one for one in found if not one.problem and str(one.path) not in paths]
    reason = "no image: another program uses the camera, or its USB port has no bandwidth left"
    rows = [camera_data(one, paths.get(str(one.path)), reason if one in without else "") for one in found]
    _print(rows, [*camera_lines(found), *_pictures(paths)], as_json)
    for one in () if as_json else without:
        echo(f"{one.path}: {reason}", err=True)
    return bool(found) and not without and not any(one.problem for one in found)


def _discovered(zenoh: ZenohArguments, as_json: bool) -> bool:
    import time

    from zenocap.common.bus.zenoh_film import FilmSession
    from zenocap.tools.setup.cameras.hosts import PATIENCE_S, announced, host_data, host_lines

    end_s = time.monotonic() + PATIENCE_S
    options = zenoh.options()
    with progress("listening for cameras"), FilmSession.open(options, lambda: time.monotonic() > end_s) as session:
        hosts = announced(session)
    _print(host_data(hosts), host_lines(hosts), as_json)
    if not any(host.cameras for host in hosts):
        advice = "run `zenocap viewer --discover` where the cameras are"
        echo(f"no machine of this network announces a camera: {advice}", err=True)
        return False
    return True


def _onvif(hosts: list[str], given: CamerasArguments, expert: OnvifArguments) -> bool:
    from zenocap.tools.setup.cameras.onvif_device import asked_devices, device_address, with_user
    from zenocap.tools.setup.cameras.onvif_discovery import OnvifDevice, found_devices
    from zenocap.tools.setup.cameras.onvif_http import User, trusted
    from zenocap.tools.setup.cameras.text import onvif_data, onvif_lines

    own = None
    if given.user is not None:
        own = User(given.user, typer.prompt(f"password of {given.user}", hide_input=True, err=True))
    tls = trusted(expert.certificates, any_certificate=expert.any_certificate)
    devices = [OnvifDevice(device_address(host)) for host in hosts]
    with progress("looking for ONVIF cameras"):
        asked = asked_devices(devices or found_devices(expert.interface), own, tls)
    _print(onvif_data(asked), onvif_lines(asked), given.as_json)
    if not asked:
        advice = "give their addresses, or --interface with your own address on their network"
        echo(f"no ONVIF camera answers here: {advice}; many have ONVIF switched off", err=True)
        return False
    urls = [with_user(one.device, stream, own) for one in asked for stream in one.streams]
    tried = given.as_json or not urls or _streams(urls, given.pictures, given.as_json)
    return tried and not any(one.problem for one in asked)


def _streams(urls: list[str], folder: Path | None, as_json: bool) -> bool:
    from zenocap.tools.setup.cameras.pictures import written_pictures
    from zenocap.tools.setup.cameras.streams import tried_streams
    from zenocap.tools.setup.cameras.text import stream_data, stream_lines

    with progress("trying the streams"):
        found: list[TriedStream] = tried_streams(urls)
    paths: dict[str, str] = {}
    if folder is not None:
        paths = written_pictures(folder, {one.address: one.image for one in found if one.image is not None})
    rows = [stream_data(one, paths.get(one.address)) for one in found]
    _print(rows, [*stream_lines(found), *_pictures(paths)], as_json)
    return all(one.size is not None for one in found)


def _pictures(paths: dict[str, str]) -> list[str]:
    return [f"picture of {name}: {path}" for name, path in paths.items()]


def _print(rows: list[dict[str, object]], lines: Iterable[str], as_json: bool) -> None:
    import json

    if as_json:
        typer.echo(json.dumps(rows, indent=2))
        return
    for line in lines:
        echo(line)
