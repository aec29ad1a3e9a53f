"""Leaves a vehicle safe when a mission fails or is interrupted, and says how it was left."""

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from typing import Any, Final

from autopilot_bridge.mavlink import dialect
from missions.errors import CommandRejected, MissionError, ModeNotEntered, TakenOver, VehicleTimeout
from missions.how_left import Answer, HowLeft, SafetyCommand
from missions.vehicle.command_authority import HEARTBEATS_UNEXPLAINED, Command
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.concurrency import run_to_end
from missions.vehicle.firmware import Mode
from missions.vehicle.link import VehicleLink
from missions.vehicle.link_watch import QUIET_AFTER_S
from missions.vehicle.telemetry import Position

_FRESH_S: Final = 1.5  # heartbeats come once a second


class SafeExit:
    """Leaves one vehicle safe.

    Args:
        link: its messages.
        commands: its commands and modes.
    """

    def __init__(self, link: VehicleLink, commands: VehicleCommands) -> None:
        self._link = link
        self._commands = commands
        self._left_safe_at = -1  # the number of commands when it was last left safe

    @asynccontextmanager
    async def guard(self, action: Mode) -> AsyncIterator[None]:
        """`Vehicle.safe_on_exit` for what the block does."""
        before, self._commands.until_safe = self._commands.until_safe, []
        try:
            async with self._link.until_taken_over():
                yield
        except BaseException as error:
            await run_to_end(self._make_safe(action))
            taken = self._link.taken_over()
            # the mode explains an error that preceded its heartbeat, but not one that was acted on before
            acted = isinstance(error, TakenOver) or self._link.notes.safety_commands
            if taken is not None and isinstance(error, MissionError) and not acted:
                raise taken from error
            raise
        finally:
            for end in self._commands.until_safe:
                await end()
            self._commands.until_safe = before

    async def _make_safe(self, action: Mode) -> None:
        """Command the action, unless another one has the vehicle or it is disarmed."""
        link = self._link
        # Heartbeats come once a second: after arming, the newest heartbeat may still report disarmed.
        if not link.identified or not self._commands.may_be_armed or self._left_safe:
            return
        # What failed may be the effect of a mode that was not reported yet, or that is not explained.
        await self._next_heartbeat(_FRESH_S)
        for _ in range(HEARTBEATS_UNEXPLAINED):
            if link.authority.state is Command.UNEXPLAINED:
                await self._next_heartbeat(_FRESH_S)
        withheld = self._withheld()
        if not withheld:
            with suppress(TakenOver):
                await self._command_safe(action)
            withheld = self._withheld()
        if link.taken_over() is not None:
            await self._next_heartbeat(_FRESH_S)  # for the autopilot's texts about it
            withheld = self._withheld()
        self._link.notes.withheld = withheld
        self._left_safe_at = link.authority.commands

    @property
    def _left_safe(self) -> bool:
        """Whether a block inside this one has left the vehicle safe, and nothing was commanded since."""
        commands = self._link.notes.safety_commands
        refused = bool(commands) and commands[-1].answer is Answer.REFUSED
        return self._left_safe_at == self._link.authority.commands and not refused

    def _withheld(self) -> str:
        """Why nothing is commanded; "": there is no reason against it."""
        authority = self._link.authority
        if authority.take_over is not None:
            return f"{authority.take_over.holder} has it"
        if authority.failsafe_acts:
            return "a failsafe has it"
        if not authority.engaged:
            return "this program had not armed or commanded it"
        if authority.state is not Command.OURS:
            return f"this program had not commanded mode {self._link.mode}"
        return ""

    async def _next_heartbeat(self, timeout_s: float) -> None:
        """Wait for a heartbeat, but not for that of a lost link."""
        if self._link.quiet:
            return
        before_us = self._link.heartbeat_us
        received = asyncio.Event()
        stop = self._link.connection.listen("HEARTBEAT", lambda _: received.set())
        try:
            async with self._link.clock.timeout(timeout_s):
                while self._link.heartbeat_us == before_us:
                    await received.wait()
                    received.clear()
        except TimeoutError:
            return
        finally:
            stop()

    async def _command_safe(self, action: Mode) -> None:
        if self._link.landed_state == dialect.MAV_LANDED_STATE_ON_GROUND:
            await self._answer("disarm", self._disarm_once())  # refused if it has just left the ground
        # also for a disarmed vehicle: in the mission's mode it would fly off when it is armed again
        for mode in (action, *(m for m in (Mode.RETURN, Mode.LAND, Mode.HOLD) if m is not action)):
            if self._link.authority.state is not Command.OURS:
                return  # nothing would be sent
            answer = await self._answer(mode, self._commands.set_mode(mode, 5.0))
            # A vehicle that is not received may still receive: it keeps the first action commanded.
            if answer is Answer.DONE or self._link.quiet:
                return

    async def _disarm_once(self) -> None:
        """Disarm and wait for it in a heartbeat; a refusal is no reason to wait for its cause."""
        command = dialect.MAV_CMD_COMPONENT_ARM_DISARM
        self._commands.require(command, await self._commands.try_command(command, 0.0, timeout_s=0.5))
        try:
            await self._link.wait_disarmed(_FRESH_S)
        except VehicleTimeout as error:
            raise ModeNotEntered(str(error), acknowledged=True) from error

    async def _answer(self, action: str, commanding: Coroutine[Any, Any, None]) -> Answer:
        """Await the answer to a command that leaves the vehicle safe, and note both.

        Raises:
            TakenOver: another one has the vehicle.
        """
        commands = self._link.notes.safety_commands
        commands.append(SafetyCommand(action=str(action), answer=Answer.NONE))
        answer = Answer.DONE
        try:
            await commanding
        except TakenOver:
            raise
        except CommandRejected:
            answer = Answer.REFUSED
        except ModeNotEntered as error:
            answer = Answer.ACCEPTED if error.acknowledged else Answer.NONE
        except MissionError:
            answer = Answer.NONE
        commands[-1] = replace(commands[-1], answer=answer)
        return answer

    def how_left(self) -> HowLeft:
        """How the vehicle is left now: what was commanded to leave it safe, the answers, and its state."""
        link, notes = self._link, self._link.notes
        if not link.identified or link.heartbeat_us is None:
            return HowLeft(system_id=notes.system_id)
        position, landed = self._link.latest(Position), link.landed_state
        silent_s = (link.clock.time_us - link.heartbeat_us) * 1e-6
        return HowLeft(
            system_id=link.system_id,
            commands=tuple(notes.safety_commands),
            withheld=notes.withheld,
            mode=link.mode,
            armed=link.armed,
            on_ground=landed == dialect.MAV_LANDED_STATE_ON_GROUND if landed else None,
            height_m=None if position is None else position.height_m,
            height_older_s=0.0 if position is None else link.older_s(position.time_us),
            silent_s=silent_s if silent_s > QUIET_AFTER_S else 0.0,
        )
