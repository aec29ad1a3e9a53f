"""Commands and modes: the MAVLink command protocol with its confirmations."""

from collections.abc import Callable
from typing import Any, Final

from autopilot_bridge.mavlink import MAVLinkMessage, command_name, definition, dialect
from missions.errors import CommandRejected, VehicleTimeout
from missions.vehicle.adapter import Mode
from missions.vehicle.connection import AUTOPILOT_COMPONENT, Connection
from missions.vehicle.link_view import VehicleView, describe_ack

_ACK_S: Final = 1.0
_SENDINGS: Final = 5
_MODE_AGAIN_S: Final = 1.5
HEARTBEAT_AGE_US: Final = 500_000
_ACCEPTED: Final = 0
_IN_PROGRESS: Final = 5


class VehicleCommands(VehicleView):
    """The commanding half of a vehicle."""

    def __init__(self, connection: Connection, system_id: int | None = None) -> None:
        super().__init__(connection, system_id)
        self._rates_hz: dict[str, float] = {}  # rates requested by this mission

    _arming_us: int | None = None  # time at which arming was requested or accepted

    # sending

    def send(self, message: MAVLinkMessage) -> None:
        """Send any message."""
        self.connection.send(message)

    def send_command(self, command: int, *params: float) -> None:
        """Send a COMMAND_LONG once, without waiting for an answer."""
        values = (*params, *(0.0,) * (7 - len(params)))
        self.send(
            dialect.MAVLink_command_long_message(self.system_id, AUTOPILOT_COMPONENT, command, 0, *values)
        )

    def _request_message(self, name: str) -> None:
        self.send_command(dialect.MAV_CMD_REQUEST_MESSAGE, float(definition(name).message_id))

    async def request(self, name: str, timeout_s: float = 2.0) -> MAVLinkMessage:
        """Request one message (REQUEST_MESSAGE) and wait for it."""
        with self.messages(name) as stream:
            self._request_message(name)
            try:
                async with self.deadline(timeout_s, name):
                    return await anext(stream)
            except TimeoutError:
                raise VehicleTimeout(f"no {name} within {timeout_s:g} s of asking; {self.heard()}") from None

    async def set_message_rate(self, name: str, rate_hz: float) -> None:
        """Request a message at a rate; a vehicle that refuses keeps its present rate."""
        self._rates_hz[name] = rate_hz
        interval_us = 1e6 / rate_hz
        await self.try_command(
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL, float(definition(name).message_id), interval_us
        )

    async def command(self, command: int, *params: float, timeout_s: float = _ACK_S) -> None:
        """Send a COMMAND_LONG repeatedly until it is answered.

        Raises:
            CommandRejected: the answer was not ACCEPTED.
            VehicleTimeout: none of the attempts was answered.
        """
        result = await self.try_command(command, *params, timeout_s=timeout_s)
        self.require(command, result)

    async def try_command(self, command: int, *params: float, timeout_s: float = _ACK_S) -> int:
        """As `command`, but returns the MAV_RESULT."""
        values = (*params, *(0.0,) * (7 - len(params)))

        def message(attempt: int) -> MAVLinkMessage:
            return dialect.MAVLink_command_long_message(
                self.system_id, AUTOPILOT_COMPONENT, command, attempt, *values
            )

        if command != dialect.MAV_CMD_COMPONENT_ARM_DISARM or not values[0]:
            return await self._send_command(command, message, timeout_s)
        before_us, self._arming_us = self._arming_us, self.clock.time_us
        result = await self._send_command(command, message, timeout_s)
        self._arming_us = self.clock.time_us if result == _ACCEPTED else before_us
        return result

    @property
    def may_be_armed(self) -> bool:
        """Whether a heartbeat reports armed, or no later heartbeat has come since arming was requested.

        A heartbeat received within half a second of the request may have been sent before it.
        """
        if self.armed:
            return True
        if self._arming_us is None or self._heard_us is None:
            return False
        return self._heard_us < self._arming_us + HEARTBEAT_AGE_US

    async def command_int(
        self,
        command: int,
        frame: int,
        params: tuple[float, float, float, float],
        x: int,
        y: int,
        z: float,
    ) -> None:
        """Send a COMMAND_INT repeatedly until it is answered; raises as `command`."""
        message = dialect.MAVLink_command_int_message(
            self.system_id, AUTOPILOT_COMPONENT, frame, command, 0, 0, *params, x, y, z
        )
        self.require(command, await self._send_command(command, lambda _attempt: message, _ACK_S))

    async def _send_command(
        self, command: int, message: Callable[[int], MAVLinkMessage], timeout_s: float
    ) -> int:
        with self.messages("COMMAND_ACK") as acks:
            for attempt in range(_SENDINGS):
                self.send(message(attempt))
                wait_s = timeout_s
                try:
                    while True:
                        ack = await self._next_ack(acks, command, wait_s)
                        if ack.result != _IN_PROGRESS:
                            return int(ack.result)
                        wait_s = 10.0
                except TimeoutError:
                    continue
        raise VehicleTimeout(
            f"no answer to {command_name(command)} after {_SENDINGS} attempts; {self.heard()}"
        )

    async def _next_ack(self, acks: Any, command: int, timeout_s: float) -> Any:
        async with self.deadline(timeout_s, f"the answer to {command_name(command)}"):
            while True:
                ack = await anext(acks)
                if ack.command == command and self.addressed_here(ack):
                    return ack

    def require(self, command: int, result: int) -> None:
        """Raise CommandRejected unless a command's result is ACCEPTED."""
        if result != _ACCEPTED:
            ack = dialect.MAVLink_command_ack_message(command, result)
            raise CommandRejected(f"the vehicle refused {describe_ack(ack)}; {self.heard()}", result)

    # modes and arming

    async def set_mode(self, mode: Mode, timeout_s: float = 8.0) -> None:
        """Switch the flight mode and wait for it in a heartbeat, because PX4 acknowledges a mode before it
        has switched.

        After a refusal it tries again until the deadline, because some causes are temporary (a mission that
        was just uploaded, an estimator that settles).
        """
        target = self.adapter.modes[mode]
        asked = self.adapter.mode_command(mode)
        self._modes_asked.add(target)
        refused: Any = None
        with self.messages("COMMAND_ACK", "HEARTBEAT") as replies:
            try:
                async with self.deadline(timeout_s, f"mode {mode}"):
                    while True:
                        self._send_mode(asked.main, asked.sub)
                        sent_us = self.clock.time_us
                        refused = None
                        while True:
                            left_s = _MODE_AGAIN_S - (self.clock.time_us - sent_us) * 1e-6
                            reply = await self._next_within(replies, left_s)
                            if reply is None:
                                break
                            if reply.get_type() == "HEARTBEAT":
                                if reply.custom_mode == target:
                                    return
                            elif reply.command == dialect.MAV_CMD_DO_SET_MODE:
                                refused = reply if reply.result != _ACCEPTED else refused
            except TimeoutError:
                pass
        if refused is not None:
            raise CommandRejected(
                f"the vehicle refused mode {mode}: {describe_ack(refused)}; {self.heard()}",
                int(refused.result),
            )
        raise VehicleTimeout(f"mode {mode} was not entered within {timeout_s:g} s; {self.heard()}")

    async def _next_within(self, replies: Any, seconds: float) -> Any:
        if seconds <= 0.0:
            return None
        try:
            async with self.clock.timeout(seconds):
                return await anext(replies)
        except TimeoutError:
            return None

    def _send_mode(self, main: float, sub: float) -> None:
        base = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (
            dialect.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
        )
        self.send(
            dialect.MAVLink_command_long_message(
                self.system_id,
                AUTOPILOT_COMPONENT,
                dialect.MAV_CMD_DO_SET_MODE,
                0,
                float(base),
                main,
                sub,
                0.0,
                0.0,
                0.0,
                0.0,
            )
        )

    async def wait_disarmed(self, timeout_s: float = 300.0) -> None:
        """Wait until the vehicle is disarmed."""
        await self.wait_until(
            lambda: not self.armed, what="disarmed heartbeat", on=("HEARTBEAT",), timeout_s=timeout_s
        )
