"""Commands and modes: the MAVLink command protocol with its confirmations."""

from collections.abc import Awaitable, Callable
from typing import Final, TypeVar

from autopilot_bridge.mavlink import MAVLinkMessage, command_name, definition, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from missions.errors import CommandRejected, MissionError, ModeNotEntered, VehicleTimeout
from missions.vehicle.connection import MessageStream
from missions.vehicle.firmware import Mode, ModeCommand
from missions.vehicle.heights import HeightRule
from missions.vehicle.link import VehicleLink
from missions.vehicle.received_messages import describe_ack

MessageT = TypeVar("MessageT", bound=MAVLinkMessage)

ACK_S: Final = 1.0
REASON_S: Final = 0.5
"""Time within which the texts about a refusal follow it: 0.1 s, longer on a slow line."""
_SENDINGS: Final = 5
_NEXT_PROGRESS_S: Final = 10.0
_IN_PROGRESS_LIMIT_S: Final = 60.0
"""Longest time for which a command may be in progress, where its timeout is not longer."""
_MODE_AGAIN_S: Final = 1.5
HEARTBEAT_AGE_US: Final = 500_000
_ACCEPTED: Final = 0
_IN_PROGRESS: Final = 5
_ALL_DONE: Final = 100  # percent; more means that the progress is not known
_MAY_PASS: Final = (1, 4)  # TEMPORARILY_REJECTED (PX4), FAILED (ArduPilot)


class _ModeAnswers:
    """The answers to one sending of DO_SET_MODE; PX4 may accept it and refuse it later.

    Attributes:
        refused: the COMMAND_ACK with which it was refused; None: it was not.
        accepted: whether it was accepted.
        await_heartbeat: it was accepted, and no heartbeat has shown the mode since. Then the mode of a pilot
            may have followed unseen, and the command is not repeated yet.
    """

    def __init__(self) -> None:
        self.refused: dialect.MAVLink_command_ack_message | None = None
        self.accepted = False
        self.await_heartbeat = False

    def add(self, ack: dialect.MAVLink_command_ack_message) -> None:
        """Note an answer."""
        if ack.result == _ACCEPTED:
            self.accepted = self.await_heartbeat = True
        else:
            self.refused, self.await_heartbeat = ack, False


class VehicleCommands:
    """The command protocol of one vehicle, its modes and its arming.

    Args:
        link: messages of the vehicle.

    Attributes:
        link: as passed to the constructor.
        heights: whether heights below home may be commanded.
        until_safe: what is ended after the vehicle was left safe; None: nothing will leave it safe.
    """

    def __init__(self, link: VehicleLink) -> None:
        self.link = link
        self.heights = HeightRule()
        self.until_safe: list[Callable[[], Awaitable[None]]] | None = None
        self._rates_hz: dict[str, float] = {}  # rates requested by this mission
        self._arming_us: int | None = None  # time at which arming was requested or accepted

    # sending

    def send_command(self, command: int, *params: float) -> None:
        """Send a COMMAND_LONG once, without waiting for an answer."""
        values = (*params, *(0.0,) * (7 - len(params)))
        self.link.send(
            dialect.MAVLink_command_long_message(
                self.link.system_id, AUTOPILOT_COMPONENT, command, 0, *values
            )
        )

    def request_once(self, name: str) -> None:
        """Request one message (REQUEST_MESSAGE) without waiting for it."""
        self.send_command(dialect.MAV_CMD_REQUEST_MESSAGE, float(definition(name).message_id))

    async def request(self, kind: type[MessageT], timeout_s: float = 2.0) -> MessageT:
        """Request one message (REQUEST_MESSAGE) of this class and wait for it."""
        name = kind.msgname
        with self.link.messages(kind) as stream:
            self.request_once(name)
            try:
                async with self.link.deadline(timeout_s, name):
                    return await anext(stream)
            except TimeoutError:
                raise VehicleTimeout(
                    f"no {name} within {timeout_s:g} s of the request; {self.link.last_received()}"
                ) from None

    async def set_message_rate(self, name: str, rate_hz: float) -> None:
        """Request a message at a rate; a vehicle that refuses keeps its present rate."""
        self._rates_hz[name] = rate_hz
        interval_us = 1e6 / rate_hz
        await self.try_command(
            dialect.MAV_CMD_SET_MESSAGE_INTERVAL, float(definition(name).message_id), interval_us
        )

    async def request_rates_again(self) -> None:
        """Repeat the requests of message rates."""
        for name, rate_hz in tuple(self._rates_hz.items()):
            await self.set_message_rate(name, rate_hz)

    async def command(self, command: int, *params: float, timeout_s: float = ACK_S) -> None:
        """Send a COMMAND_LONG repeatedly until it is answered.

        Args:
            timeout_s: time limit for the answer to each attempt. A command in progress (IN_PROGRESS) is
                waited for until it is finished, for this time or a minute, whichever is longer.

        Raises:
            CommandRejected: the answer was not ACCEPTED.
            VehicleTimeout: none of the attempts was answered, or the command was not finished.
        """
        result = await self.try_command(command, *params, timeout_s=timeout_s)
        await self._require_with_reason(command, result)

    async def try_command(self, command: int, *params: float, timeout_s: float = ACK_S) -> int:
        """As `command`, but returns the MAV_RESULT."""
        values = (*params, *(0.0,) * (7 - len(params)))

        def message(attempt: int) -> MAVLinkMessage:
            return dialect.MAVLink_command_long_message(
                self.link.system_id, AUTOPILOT_COMPONENT, command, attempt, *values
            )

        if command != dialect.MAV_CMD_COMPONENT_ARM_DISARM or not values[0]:
            return await self._send_command(command, message, timeout_s)
        before_us, self._arming_us = self._arming_us, self.link.clock.time_us
        result = await self._send_command(command, message, timeout_s)
        self._arming_us = self.link.clock.time_us if result == _ACCEPTED else before_us
        return result

    @property
    def may_be_armed(self) -> bool:
        """Whether a heartbeat reports armed, or no later heartbeat has come since arming was requested, or
        the vehicle reports that it is in the air, though heartbeats report disarmed.

        A heartbeat received within half a second of the request may have been sent before it.
        """
        if self.link.armed or self.link.disarmed_in_the_air:
            return True
        if self._arming_us is None or self.link.heartbeat_us is None:
            return False
        return self.link.heartbeat_us < self._arming_us + HEARTBEAT_AGE_US

    async def command_int(
        self, command: int, frame: int, params: tuple[float, float, float, float], x: int, y: int, z: float
    ) -> None:
        """Send a COMMAND_INT repeatedly until it is answered; raises as `command`."""
        message = dialect.MAVLink_command_int_message(
            self.link.system_id, AUTOPILOT_COMPONENT, frame, command, 0, 0, *params, x, y, z
        )
        result = await self._send_command(command, lambda _attempt: message, ACK_S)
        await self._require_with_reason(command, result)

    async def _send_command(
        self, command: int, message: Callable[[int], MAVLinkMessage], timeout_s: float
    ) -> int:
        clock, begun_us, progress = self.link.clock, None, ""
        limit_us = round(max(_IN_PROGRESS_LIMIT_S, timeout_s) * 1e6)
        with self.link.messages(dialect.MAVLink_command_ack_message) as acks:
            for attempt in range(_SENDINGS):
                self.link.send(message(attempt))
                wait_s = timeout_s
                try:
                    while True:
                        ack = await self._next_ack(acks, command, wait_s)
                        if ack.result != _IN_PROGRESS:
                            return int(ack.result)
                        begun_us = clock.time_us if begun_us is None else begun_us
                        progress = f" ({ack.progress} %)" if ack.progress <= _ALL_DONE else ""
                        if clock.time_us - begun_us >= limit_us:
                            raise VehicleTimeout(
                                f"{command_name(command)} was still in progress{progress} after "
                                f"{(clock.time_us - begun_us) * 1e-6:.0f} s; {self.link.last_received()}"
                            )
                        wait_s = _NEXT_PROGRESS_S
                except TimeoutError:
                    continue
        begun = "" if begun_us is None else f" after it was in progress{progress}"
        raise VehicleTimeout(
            f"no answer to {command_name(command)} after {_SENDINGS} attempts{begun}; "
            f"{self.link.last_received()}"
        )

    async def _next_ack(
        self, acks: MessageStream[dialect.MAVLink_command_ack_message], command: int, timeout_s: float
    ) -> dialect.MAVLink_command_ack_message:
        async with self.link.deadline(timeout_s, f"the answer to {command_name(command)}"):
            while True:
                ack = await anext(acks)
                if ack.command == command and self.link.addressed_here(ack):
                    return ack

    async def _require_with_reason(self, command: int, result: int) -> None:
        """As `require`; waits for the texts about a refusal, which may follow the answer."""
        if result != _ACCEPTED:
            await self.link.clock.sleep(REASON_S)
        self.require(command, result)

    def require(self, command: int, result: int) -> None:
        """Raise CommandRejected unless a command's result is ACCEPTED."""
        if result != _ACCEPTED:
            ack = dialect.MAVLink_command_ack_message(command, result)
            raise CommandRejected(
                f"the vehicle refused {describe_ack(ack)}; {self.link.last_received()}", result
            )

    # modes and arming

    async def set_mode(self, mode: Mode, timeout_s: float = 8.0) -> None:
        """Switch the flight mode and wait for it in a heartbeat, because PX4 acknowledges a mode before it
        has switched.

        After a refusal it tries again until the deadline, because some causes are temporary (a mission that
        was just uploaded, an estimator that settles). An accepted command is repeated only after a heartbeat
        with another mode, and that mode may be a pilot's: then it is a take-over, and nothing is repeated.

        Raises:
            CommandRejected: the vehicle refused it until the deadline.
            ModeNotEntered: no heartbeat with the mode was received.
        """
        firmware = self.link.firmware
        target = firmware.modes[mode]
        targets = (target, *firmware.modes_instead.get(target, ()))
        command = firmware.mode_command(mode)
        answers = _ModeAnswers()
        with self.link.messages(
            dialect.MAVLink_command_ack_message, dialect.MAVLink_heartbeat_message
        ) as replies:
            try:
                async with self.link.deadline(timeout_s, f"mode {mode}"):
                    while True:
                        self._send_mode(command)
                        answers = _ModeAnswers()
                        if await self._entered(targets, replies, answers):
                            return
            except TimeoutError:
                pass
        refused = answers.refused
        if refused is not None:
            raise CommandRejected(
                f"the vehicle refused mode {mode}: {describe_ack(refused)}; {self.link.last_received()}",
                int(refused.result),
            )
        raise ModeNotEntered(
            f"mode {mode} was not entered within {timeout_s:g} s; {self.link.last_received()}",
            acknowledged=answers.accepted,
        )

    async def _entered(
        self, targets: tuple[int, ...], replies: MessageStream[MAVLinkMessage], answers: "_ModeAnswers"
    ) -> bool:
        """Wait for a heartbeat with one of the modes; returns False when the command is to be sent again."""
        clock = self.link.clock
        end_us = clock.time_us + round(_MODE_AGAIN_S * 1e6)
        while True:
            reply = await self._next_within(replies, (end_us - clock.time_us) * 1e-6)
            if reply is None:
                if not answers.await_heartbeat:
                    return False
                answers.await_heartbeat = False
                end_us += round(_MODE_AGAIN_S * 1e6)
            elif isinstance(reply, dialect.MAVLink_heartbeat_message):
                if reply.custom_mode in targets:
                    return True
                answers.await_heartbeat = False
            elif (
                isinstance(reply, dialect.MAVLink_command_ack_message)
                and reply.command == dialect.MAV_CMD_DO_SET_MODE
            ):
                answers.add(reply)

    async def _next_within(
        self, replies: MessageStream[MAVLinkMessage], seconds: float
    ) -> MAVLinkMessage | None:
        if seconds <= 0.0:
            return None
        try:
            async with self.link.clock.timeout(seconds):
                return await anext(replies)
        except TimeoutError:
            return None

    def _send_mode(self, command: ModeCommand) -> None:
        base = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (
            dialect.MAV_MODE_FLAG_SAFETY_ARMED if self.link.armed else 0
        )
        self.link.send(
            dialect.MAVLink_command_long_message(
                self.link.system_id,
                AUTOPILOT_COMPONENT,
                dialect.MAV_CMD_DO_SET_MODE,
                0,
                float(base),
                command.main,
                command.sub,
                0.0,
                0.0,
                0.0,
                0.0,
            )
        )

    async def arm(self, timeout_s: float = 15.0) -> None:
        """Arm in the present mode and wait for it in a heartbeat; after a temporary refusal it tries again
        until the deadline.

        Raises:
            MissionError: the mode was changed before the vehicle was armed.
            CommandRejected: it was refused until the deadline.
        """
        link = self.link
        mode = link.custom_mode
        end_us = link.clock.time_us + round(timeout_s * 1e6)
        while not link.armed:
            result = await self.try_command(dialect.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
            if result == _ACCEPTED:
                break
            if result not in _MAY_PASS or link.clock.time_us >= end_us:
                self.send_command(dialect.MAV_CMD_RUN_PREARM_CHECKS)  # the autopilot then sends all reasons
                await self._require_with_reason(dialect.MAV_CMD_COMPONENT_ARM_DISARM, result)
            await link.clock.sleep(1.0)
            self._require_mode(mode)
        await link.wait_until(lambda: link.armed, what="armed heartbeat", on=("HEARTBEAT",), timeout_s=5.0)

    def _require_mode(self, custom_mode: int) -> None:
        """Raise MissionError when another one has changed the mode in which the vehicle is to be armed."""
        link = self.link
        if link.custom_mode != custom_mode:
            raise MissionError(
                f"the mode was changed from {link.firmware.mode_name(custom_mode)} to {link.mode} while the "
                f"vehicle was to be armed, and this program did not command it; {link.last_received()}"
            )
