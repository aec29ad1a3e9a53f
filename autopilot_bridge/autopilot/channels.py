"""The channels of an autopilot: the streams of each channel, reduced to fit a slow line."""

from collections.abc import Sequence
from typing import Protocol

from autopilot_bridge.commander.events import Armed, Event, HomeSet, ModeChanged
from autopilot_bridge.dispatch import receives
from autopilot_bridge.firmware.flavour import Flavour
from autopilot_bridge.firmware.services import PAYLOAD_ROLE
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Channel, Source
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.vehicle_memory import LOG_ROLE
from autopilot_bridge.telemetry.line import MICROSECONDS, LineBudget
from autopilot_bridge.telemetry.motion import MotionMessages
from autopilot_bridge.telemetry.streams import PayloadCache, StreamTable
from autopilot_bridge.telemetry.throttle import StreamThrottle


class AutopilotChannel(Channel, Protocol):
    """A channel that also sends packed payloads.

    Attributes:
        motion: makes the frames of the fastest messages; set when the channel is added.
    """

    motion: MotionMessages | None

    @property
    def line(self) -> LineBudget | None:
        """The capacity of the channel's line; None: unlimited."""

    def send_payload(self, message_id: int, payload: bytes) -> None:
        """Frame the payload and send it."""

    def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
        """Send the due motion messages and frames of the payloads (message id, bytes) together."""


class ChannelStreams(Microservice):
    """The streams of all channels, slowed down while the transmit buffer of a channel's radio fills up.

    Args:
        channels: the open channels; updated.
        flavour: default rates by role, and how streams follow a radio's buffer.
        parameters: ArduPilot's SRn_*, if there are any.
        cache: makes and packs messages.
        motion: makes the fastest messages.
        physics_step_us: the shortest interval of a stream.

    Attributes:
        tables: streams by the channel's name.
        running: the same tables, as a sequence to iterate over.
    """

    def __init__(
        self,
        channels: list[AutopilotChannel],
        *,
        flavour: Flavour,
        parameters: ParameterStore,
        cache: PayloadCache,
        motion: MotionMessages,
        physics_step_us: int,
    ) -> None:
        self._channels = channels
        self._flavour = flavour
        self._parameters = parameters
        self._cache = cache
        self._motion = motion
        self._step_us = physics_step_us
        self._time_us = 0
        self.tables: dict[str, StreamTable] = {}
        self.running: tuple[StreamTable, ...] = ()
        self._ports: list[StreamTable] = []  # the tables of client channels: SR0_* is the first
        self._throttles: dict[str, StreamThrottle] = {}  # the throttles of channels on slow lines

    def add(self, channel: AutopilotChannel, *, role: str, time_us: int, heartbeat_us: int) -> None:
        """Start the default streams of a role on one more channel.

        Args:
            heartbeat_us: time of the first heartbeat.

        Raises:
            ValueError: unknown role, or a channel of that name is there already.
        """
        rates_hz = self._flavour.services.rates_hz.get(role)
        if rates_hz is None:
            accepted = ", ".join(self._flavour.services.rates_hz)
            raise ValueError(f"channel role {role!r} is unknown; accepted: {accepted}")
        if channel.name in self.tables:
            raise ValueError(f"a channel named {channel.name!r} is open already")
        table = StreamTable(
            self._cache,
            channel,
            rates_hz,
            physics_step_us=self._step_us,
            motion_bits=self._motion.bits,
            line=channel.line,
        )
        channel.motion = self._motion
        table.delay(dialect.MAVLINK_MSG_ID_HEARTBEAT, max(time_us, heartbeat_us))
        self._channels.append(channel)
        self.tables[channel.name] = table
        self.running = tuple(self.tables.values())
        if role not in (LOG_ROLE, PAYLOAD_ROLE):
            self._ports.append(table)
            self._apply_rates(len(self._ports) - 1, time_us)
        if channel.line is not None:
            self.throttle(channel, time_us)

    def remove(self, channel: AutopilotChannel) -> None:
        """Stop all streams on a channel."""
        self._channels.remove(channel)
        table = self.tables.pop(channel.name)
        self._throttles.pop(channel.name, None)
        self.running = tuple(self.tables.values())
        self._ports = [port for port in self._ports if port is not table]

    def throttle(self, channel: Channel, time_us: int) -> StreamThrottle | None:
        """The throttle of a channel's streams, active from now on; None when it has no streams."""
        table = self.tables.get(channel.name)
        if table is None:
            return None
        throttle = self._throttles.get(channel.name)
        if throttle is None:
            line: LineBudget | None = getattr(channel, "line", None)
            throttle = StreamThrottle(table, line, self._flavour.services.flow_control)
            throttle.advance(time_us)
            self._throttles[channel.name] = throttle
        return throttle

    @receives(dialect.MAVLink_radio_status_message, dialect.MAVLink_radio_message)
    def _on_radio_status(
        self,
        message: dialect.MAVLink_radio_status_message | dialect.MAVLink_radio_message,
        source: Source,
        time_us: int,
    ) -> None:
        """RADIO_STATUS (109), and RADIO (166) of older radios."""
        throttle = self.throttle(source.channel, time_us)
        if throttle is not None:
            throttle.radio.on_radio_status(message.txbuf, time_us)
            throttle.fit()

    def advance(self, time_us: int) -> None:
        """Update the budgets of slow lines. Called at 50 Hz."""
        self._time_us = time_us
        for throttle in self._throttles.values():
            throttle.advance(time_us)

    def push(self, message_id: int, time_us: int) -> None:
        """Send a message on every channel at once, independent of the streams."""
        self._cache.forget()
        payload = self._cache.payload(message_id, time_us)
        if payload is not None:
            for channel in self._channels:
                channel.send_payload(message_id, payload)

    def follow(self, event: Event) -> None:
        """Send at once what has changed."""
        flavour, time_us = self._flavour, self._time_us
        match event:
            case ModeChanged() if flavour.heartbeat_on_mode_change:
                self.push(dialect.MAVLINK_MSG_ID_HEARTBEAT, time_us)
            case HomeSet():
                self._push_position(time_us)
            case Armed() if flavour.services.position_pushed_at_arm:
                self._push_position(time_us)

    def _push_position(self, time_us: int) -> None:
        self.push(dialect.MAVLINK_MSG_ID_HOME_POSITION, time_us)
        self.push(dialect.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, time_us)

    def change(self, name: str, time_us: int) -> None:
        """A parameter has changed; if it sets the rates of a channel's streams, apply it."""
        if name.startswith("SR") and name[2:3].isdigit():
            self._apply_rates(int(name[2]), time_us, changed=name)

    def _apply_rates(self, index: int, time_us: int, changed: str | None = None) -> None:
        """ArduPilot's SRn_* parameters: rates of the stream groups of channel n (one that changed)."""
        if index >= len(self._ports):
            return
        for group, ending in self._flavour.services.stream_rate_parameters.items():
            name = f"SR{index}_{ending}"
            if name not in self._parameters or changed not in (None, name):
                continue
            rate_hz = self._parameters.get(name)
            interval_us = round(MICROSECONDS / rate_hz) if rate_hz > 0 else -1
            for message_id in self._flavour.services.intervals.groups[group]:
                self._ports[index].set_default(message_id, interval_us, time_us)
