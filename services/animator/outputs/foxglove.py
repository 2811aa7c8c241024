"""A WebSocket for Foxglove and Lichtblick: what a take has beside our own messages, live.

The channels are those of `common.formats.foxglove`, so a layout fits a live rig and its take alike.  Every client has a
queue of its own, which loses its oldest when that client does not read; nobody else notices.
"""

import logging
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress

import foxglove
from foxglove.websocket import ChannelView, Client, ServerListener

from common import messages as m
from common.body.anatomy import TEN_PARTS
from common.bus.protocol import Envelope
from common.formats.foxglove.channels import Beside
from common.formats.foxglove.converter import Foxglove
from common.runtime.animator_table import FoxgloveTable
from common.runtime.logs import OncePerSource
from common.take.recording import Channel
from services.animator.outputs.output import OutputError
from services.animator.snapshot import Actor, Source

logger = logging.getLogger(__name__)

STATES = (m.UniversalBdp, m.TrackerBdp, m.CameraInfo)  # heard also while nobody looks, because they are said once
OF_SOURCE: Mapping[type[m.Message], Source] = {
    m.UniversalBdp: "two-view", m.UniversalBap: "two-view", m.TrackerBdp: "tracker", m.TrackerPose: "tracker",
}  # fmt: skip
KEPT = ("/fixed", "/calibration")  # channels that speak on change, and again for everybody who comes later


class _Audience(ServerListener):
    """Called by the server's own threads: how many subscriptions there are, and whether one has come."""

    def __init__(self) -> None:
        self.present: set[tuple[int, int]] = set()
        self.came = False

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        self.present.add((client.id, channel.id))
        self.came = True

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        self.present.discard((client.id, channel.id))


class FoxgloveOutput:
    """A server on the rig's messages.  Of two sources of poses, the one that is shown is sent.

    counts: messages `sent` to whoever listens; `failed` to be made, as of a damaged silhouette; `subscriptions` now.
    """

    def __init__(self, table: FoxgloveTable, rig: str) -> None:
        """Raises OutputError, as for a port that is in use."""
        self.title = f"animator.foxglove ws://{table.host}:{table.port}"
        self._convert = Foxglove(TEN_PARTS, rig)
        self._context = foxglove.Context()
        self._channels: dict[Channel, foxglove.Channel] = {}
        self._kept: dict[Channel, bytes] = {}
        self._audience = _Audience()
        self._heard: set[str] = set()
        self._source: Source | None = None
        self._counts = Counter[str]()
        self._once = OncePerSource(logger)
        try:
            self._server = foxglove.start_server(
                name=f"zenocap {rig}",
                host=table.host,
                port=table.port,
                context=self._context,
                server_listener=self._audience,
            )
        except RuntimeError as error:
            why = str(error).removeprefix("FoxgloveError: Failed to bind port: ")
            raise OutputError(f"animator.foxglove: {table.host}:{table.port} cannot be listened on: {why}") from error

    def hear(self, envelope: Envelope) -> None:
        message = envelope.message
        if self._source is not None and OF_SOURCE.get(type(message), self._source) != self._source:
            return
        if self._audience.came:
            self._audience.came = False
            for channel, data in self._kept.items():
                self._channels[channel].log(data, log_time=envelope.received_ns)
        if isinstance(message, STATES):
            self._heard.clear()  # a body makes channels possible that were not
        elif envelope.key in self._heard and not self._audience.present:
            return  # nobody looks, and what there would be to look at is known
        else:
            self._heard.add(envelope.key)
        try:
            found = self._convert.beside(envelope)
        except (ValueError, OverflowError) as error:
            self._counts["failed"] += 1
            self._once.warn(envelope.key, "foxglove", f"{self.title}: {envelope.key}: not shown: {error}")
            return
        for beside in found:
            self._log(beside, envelope.received_ns)

    def send(self, actor: Actor, posture: str | None) -> None:
        """Which source is shown; what it finds has been heard as a message."""
        self._source = actor.source

    def counts(self) -> Mapping[str, int]:
        return {**self._counts, "subscriptions": len(self._audience.present)}

    def close(self) -> None:
        with suppress(RuntimeError):
            self._server.stop()

    def _log(self, beside: Beside, now_ns: int) -> None:
        channel = beside.channel
        out = self._channels.get(channel)
        if out is None:
            schema = foxglove.Schema(name=channel.schema_name, encoding=channel.schema_encoding, data=channel.schema)
            out = foxglove.Channel(channel.topic, schema=schema, message_encoding=channel.encoding, context=self._context)
            self._channels[channel] = out
        if channel.topic.endswith(KEPT):
            self._kept[channel] = beside.data
        out.log(beside.data, log_time=now_ns)
        self._counts["sent"] += 1
