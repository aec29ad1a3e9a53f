"""The common part of all MAVLink components of the payload: heartbeat, streams, requests, acknowledgements.

Source: MAVLink heartbeat protocol, command protocol, and "requesting messages" (mavlink.io/en/services).
"""

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Final, Generic, TypeVar

from autopilot_bridge.dispatch import BUILDERS, COMMANDS, ON_DEMAND, RECEIVERS, command, streams, table_of
from autopilot_bridge.mavlink import Frame, FrameEncoder, MAVLinkMessage, decode, dialect
from flightsim.payload import Device

DeviceT = TypeVar("DeviceT", bound=Device[Any])

Sender = tuple[int, int]
"""System and component."""

CommandMessage = dialect.MAVLink_command_long_message | dialect.MAVLink_command_int_message

Builder = Callable[[int], MAVLinkMessage]
"""Makes a message of the present state (`@streams`); takes vehicle time, microseconds."""

CommandHandler = Callable[[CommandMessage, Sender], int | None]
"""Executes a command (`@command`): (COMMAND_LONG or COMMAND_INT, sender) -> MAV_RESULT; None: no answer."""

Answer = Callable[[float], int]
"""Answers REQUEST_MESSAGE for a message with a parameter of its own (`@on_request`): param2 -> MAV_RESULT."""

Receiver = Callable[[Any, Sender, int], object]
"""Handles a message that is no command (`@receives`); takes message, sender, vehicle time."""

MAX_RATE_HZ: Final = 50.0
_NEVER_US: Final = 1 << 62
_SECOND_US: Final = 1_000_000


class Component(Generic[DeviceT]):
    """One component of a vehicle's MAVLink system, which represents one device.

    What it executes, handles and sends is declared at its methods, by the decorators of
    `autopilot_bridge.dispatch`.

    Args:
        device: the device.
        system_id: of the vehicle.
        send: sends packed frames.

    Attributes:
        component_id: of the component.
        mav_type: MAV_TYPE, for the heartbeat.
        rates_hz: messages that are streamed from the start, by message id.
        next_us: time of the next stream that is due.
    """

    component_id: ClassVar[int]
    mav_type: ClassVar[int] = dialect.MAV_TYPE_ONBOARD_CONTROLLER
    rates_hz: ClassVar[Mapping[int, float]] = MappingProxyType({})

    def __init__(self, device: DeviceT, *, system_id: int, send: Callable[[bytes], None]) -> None:
        self.device = device
        self.system_id = system_id
        self._send = send
        self._encoder = FrameEncoder(system_id, self.component_id)
        self._builders: dict[int, Builder] = {}
        self._answers: dict[int, Answer] = {}
        self._commands: dict[int, CommandHandler] = {}
        self._receivers: dict[int, Receiver] = {}
        self._add_part(self)
        self._default_rates_hz = {dialect.MAVLINK_MSG_ID_HEARTBEAT: 1.0, **self.rates_hz}
        self._intervals_us = {m: round(1e6 / rate_hz) for m, rate_hz in self._default_rates_hz.items()}
        self._due_us = dict.fromkeys(self._intervals_us, _SECOND_US)
        self.next_us = _SECOND_US
        self._time_us = 0

    def _add_part(self, part: object) -> None:
        """Execute, handle and send also what the methods of another object declare."""
        self._commands |= table_of(part, COMMANDS)
        self._receivers |= table_of(part, RECEIVERS)
        self._builders |= table_of(part, BUILDERS)
        self._answers |= table_of(part, ON_DEMAND)

    # sending

    def update(self, reading: Any) -> None:
        """Send what the device delivered on this step."""

    def step(self, time_us: int) -> None:
        """Send the streams that are due."""
        self._time_us = time_us
        if time_us < self.next_us:
            return
        # the receiver of a message may at once request others, or stop streams: iterate over a copy
        for message_id, due_us in [item for item in self._due_us.items() if item[1] <= time_us]:
            interval_us = self._intervals_us.get(message_id)
            if interval_us is not None:
                self._due_us[message_id] = max(due_us + interval_us, time_us + 1)
                self.send(self._builders[message_id](time_us))
        self.next_us = min(self._due_us.values(), default=_NEVER_US)

    def send(self, message: MAVLinkMessage) -> None:
        """Frame a message and send it."""
        self._send(self._encoder.encode(message))

    def send_payload(self, message_id: int, payload: bytes) -> None:
        """Frame an already packed payload and send it."""
        self._send(self._encoder.encode_payload(message_id, payload))

    @property
    def time_ms(self) -> int:
        """Vehicle time in the unit of most messages."""
        return (self._time_us // 1000) & 0xFFFFFFFF

    # receiving

    def receive(self, frame: Frame, time_us: int) -> None:
        """Handle one frame of another system or component. Contents are untrusted and never raise.

        Args:
            frame: the frame.
            time_us: vehicle time of the newest step.
        """
        self._time_us = time_us
        if frame.target_system not in (0, self.system_id):
            return
        if frame.target_component not in (0, self.component_id):
            return
        sender = (frame.system_id, frame.component_id)
        if frame.message_id in (dialect.MAVLINK_MSG_ID_COMMAND_LONG, dialect.MAVLINK_MSG_ID_COMMAND_INT):
            message = decode(frame)
            if isinstance(message, CommandMessage):
                self._on_command(message, sender)
        elif (receiver := self._receivers.get(frame.message_id)) is not None:
            receiver(decode(frame), sender, time_us)

    def _on_command(self, message: CommandMessage, sender: Sender) -> None:
        handler = self._commands.get(message.command)
        addressed = message.target_component == self.component_id
        if handler is None:
            # an unknown command to all components is not answered
            result = dialect.MAV_RESULT_UNSUPPORTED if addressed else None
        else:
            result = handler(message, sender)
            if result not in (dialect.MAV_RESULT_ACCEPTED, None) and not addressed:
                result = None
        if result is not None:
            self.send(
                dialect.MAVLink_command_ack_message(
                    command=message.command,
                    result=result,
                    progress=0,
                    result_param2=0,
                    target_system=sender[0],
                    target_component=sender[1],
                )
            )

    @command(dialect.MAV_CMD_REQUEST_MESSAGE)
    def _on_request_message(self, message: CommandMessage, sender: Sender) -> int | None:
        message_id = whole(message.param1, -1)
        answer = self._answers.get(message_id)
        return self.request(message_id) if answer is None else answer(message.param2)

    def request(self, message_id: int) -> int:
        """Send a message now; returns the MAV_RESULT for the request."""
        builder = self._builders.get(message_id)
        if builder is None:
            return int(dialect.MAV_RESULT_UNSUPPORTED)
        self.send(builder(self._time_us))
        return int(dialect.MAV_RESULT_ACCEPTED)

    @command(dialect.MAV_CMD_SET_MESSAGE_INTERVAL)
    def _on_set_interval(self, message: CommandMessage, sender: Sender) -> int | None:
        message_id = whole(message.param1, -1)
        interval_us = message.param2
        if message_id not in self._builders:
            return int(dialect.MAV_RESULT_UNSUPPORTED)
        if not math.isfinite(interval_us) or interval_us < -1.0:
            return int(dialect.MAV_RESULT_DENIED)
        if message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:  # clients detect the device by its heartbeat
            return int(dialect.MAV_RESULT_DENIED)
        if interval_us == -1.0:
            self._intervals_us.pop(message_id, None)
            self._due_us.pop(message_id, None)
        else:
            if interval_us == 0.0:
                rate_hz = self._default_rates_hz.get(message_id)
                if rate_hz is None:
                    return int(dialect.MAV_RESULT_DENIED)
                interval_us = 1e6 / rate_hz
            self._intervals_us[message_id] = max(round(interval_us), round(1e6 / MAX_RATE_HZ))
            self._due_us[message_id] = self._time_us
        self.next_us = min(self._due_us.values(), default=_NEVER_US)
        return int(dialect.MAV_RESULT_ACCEPTED)

    @command(dialect.MAV_CMD_GET_MESSAGE_INTERVAL)
    def _on_get_interval(self, message: CommandMessage, sender: Sender) -> int | None:
        message_id = whole(message.param1, -1)
        if message_id not in self._builders:
            return int(dialect.MAV_RESULT_UNSUPPORTED)
        interval_us = min(self._intervals_us.get(message_id, -1), 0x7FFFFFFF)
        self.send(dialect.MAVLink_message_interval_message(message_id=message_id, interval_us=interval_us))
        return int(dialect.MAV_RESULT_ACCEPTED)

    @streams(dialect.MAVLink_heartbeat_message)
    def _heartbeat(self, time_us: int) -> MAVLinkMessage:
        return dialect.MAVLink_heartbeat_message(
            type=self.mav_type,
            autopilot=dialect.MAV_AUTOPILOT_INVALID,
            base_mode=0,
            custom_mode=0,
            system_status=dialect.MAV_STATE_ACTIVE,
            mavlink_version=3,
        )


def parameters(message: CommandMessage) -> tuple[float, ...]:
    """The seven parameters of a command, as in a COMMAND_LONG."""
    if isinstance(message, dialect.MAVLink_command_long_message):
        last = (message.param5, message.param6, message.param7)
    else:
        last = (float(message.x), float(message.y), message.z)
    return (message.param1, message.param2, message.param3, message.param4, *last)


def whole(value: float, default: int) -> int:
    """A parameter as a whole number; `default` if it is not finite or beyond 31 bits."""
    return round(value) if math.isfinite(value) and abs(value) < 2**31 else default


def fixed_text(text: str, length: int) -> bytes:
    """Text as a fixed field of bytes."""
    return text.encode("ascii", "replace")[:length].ljust(length, b"\0")
