"""Foxglove output: a WebSocket server for Foxglove and Lichtblick.

Its channels are those that a take has (`common.formats.foxglove`), so a layout fits both a live rig and its take.  Every
client has its own queue, which drops its oldest message when that client does not read.  Connections come through a `Gate`.
"""

import logging
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress

import foxglove
from foxglove.websocket import ChannelView, Client, ServerListener

from zenocap.common import messages as m
from zenocap.common.body.anatomy import TEN_PARTS
from zenocap.common.bus.protocol import Envelope
from zenocap.common.formats.foxglove.channels import FoxgloveMessage
from zenocap.common.formats.foxglove.converter import FoxgloveConverter
from zenocap.common.observe.bodies import source_of
from zenocap.common.recording.writer import Channel
from zenocap.common.rig.animator import FoxgloveTable
from zenocap.common.runtime.clock import Clock
from zenocap.common.runtime.logs import OncePerSource
from zenocap.common.web.server import listening_problem
from zenocap.services.animator.outputs.gate import Gate, hidden_host
from zenocap.services.animator.outputs.output import OutputError
from zenocap.services.animator.parameters import MAX_FOXGLOVE_CLIENTS
from zenocap.services.animator.states import ActorPose, Source

logger = logging.getLogger(__name__)

# Converted also without subscribers: they are published once.
CONVERTED_ALWAYS = (m.UniversalBdp, m.TrackerBdp, m.CameraInfo)

REPEATED = ("/fixed", "/calibration")  # channels whose last message is sent again to every new subscriber


class _Subscriptions(ServerListener):
    """Open subscriptions, and whether there are new ones.  Called by the server's own threads."""

    def __init__(self) -> None:
        self.open: set[tuple[int, int]] = set()
        self.added = False

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        self.open.add((client.id, channel.id))
        self.added = True

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        self.open.discard((client.id, channel.id))


class FoxgloveOutput:
    """Server of the rig's messages.  With two sources of poses, the source of the last pose sent is used.

    counts: messages `sent`; `failed`: not converted, for example a damaged silhouette; `subscriptions`: now open; those of
    the gate.
    """

    def __init__(self, table: FoxgloveTable, rig: str) -> None:
        """Start the server.  Raises OutputError, for example for a port in use."""
        self.title = f"animator.foxglove ws://{table.host}:{table.port}"
        self._converter = FoxgloveConverter(TEN_PARTS, rig)
        self._context = foxglove.Context()
        self._channels: dict[Channel, foxglove.Channel] = {}
        self._repeated: dict[Channel, bytes] = {}
        self._subscriptions = _Subscriptions()
        self._seen_keys: set[str] = set()
        self._source: Source | None = None
        self._counts = Counter[str]()
        self._log_once = OncePerSource(logger)
        behind = hidden_host()
        try:
            self._server = foxglove.start_server(
                name=f"zenocap {rig}", host=behind, port=0, context=self._context, server_listener=self._subscriptions
            )
        except RuntimeError as error:
            raise OutputError(f"animator.foxglove: its server does not start: {error}") from error
        place = (behind, self._server.port)
        try:
            self._gate = Gate("animator.foxglove", table.host, table.port, place, table.origins, MAX_FOXGLOVE_CLIENTS)
        except OSError as error:
            self._server.stop()
            reason = listening_problem(error)
            raise OutputError(f"animator.foxglove: {table.host}:{table.port} cannot be listened on: {reason}") from error

    def receive(self, envelope: Envelope) -> None:
        message = envelope.message
        if self._source is not None and (source_of(message) or self._source) != self._source:
            return
        if self._subscriptions.added:
            self._subscriptions.added = False
            for channel, data in self._repeated.items():
                self._channels[channel].log(data, log_time=envelope.received_ns)
        if isinstance(message, CONVERTED_ALWAYS):
            self._seen_keys.clear()  # a body or camera makes more channels possible
        elif envelope.key in self._seen_keys and not self._subscriptions.open:
            return  # no subscribers, and the key's channels are advertised already
        else:
            self._seen_keys.add(envelope.key)
        try:
            found = self._converter.convert(envelope)
        except (ValueError, OverflowError) as error:
            self._counts["failed"] += 1
            self._log_once.warn(envelope.key, "foxglove", f"{self.title}: {envelope.key}: not converted: {error}")
            return
        for converted in found:
            self._log(converted, envelope.received_ns)

    def send(self, actor: ActorPose, posture: str | None) -> None:
        """Select the source; its poses have been received as messages."""
        self._source = actor.source

    def counts(self) -> Mapping[str, int]:
        return {**self._counts, **self._gate.counts(), "subscriptions": len(self._subscriptions.open)}

    def close(self) -> None:
        self._gate.close()
        with suppress(RuntimeError):
            self._server.stop()

    def _log(self, message: FoxgloveMessage, now_ns: int) -> None:
        channel = message.channel
        out = self._channels.get(channel)
        if out is None:
            schema = foxglove.Schema(name=channel.schema_name, encoding=channel.schema_encoding, data=channel.schema)
            out = foxglove.Channel(channel.topic, schema=schema, message_encoding=channel.encoding, context=self._context)
            self._channels[channel] = out
        if channel.topic.endswith(REPEATED):
            self._repeated[channel] = message.data
        out.log(message.data, log_time=now_ns)
        self._counts["sent"] += 1


def opened(table: FoxgloveTable, rig: str, clock: Clock) -> FoxgloveOutput:
    """The output of a rig.  Raises OutputError."""
    return FoxgloveOutput(table, rig)
