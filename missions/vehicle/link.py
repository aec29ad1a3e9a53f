"""The link to a vehicle: what is received, and waits with deadlines.

It sends only the messages that it is given, and none after another one has taken the vehicle.
"""

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Final, TypeVar

from autopilot_bridge.mavlink import Frame, MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from missions.errors import MissionError, TakenOver, VehicleTimeout
from missions.vehicle.connection import Connection, MessageStream
from missions.vehicle.link_watch import LOST_AFTER_S
from missions.vehicle.received_messages import ReceivedMessages
from missions.vehicle.telemetry import Position

T = TypeVar("T")
MessageT = TypeVar("MessageT", bound=MAVLinkMessage)

_SILENT_AFTER_US: Final = 3_000_000
_SILENT_CHECK_S: Final = 0.5
_SHOWN_AFTER_US: Final = 3_000_000  # most waits are shorter: they need not be shown


class VehicleLink(ReceivedMessages):
    """The messages of one vehicle, to it and from it, and waits on vehicle time.

    Args:
        connection: a started connection.
        system_id: system id of the vehicle; None: the first autopilot received.
    """

    def __init__(self, connection: Connection, system_id: int | None = None) -> None:
        super().__init__(connection, system_id)
        self._waits: list[tuple[int, Callable[[], str]]] = []  # since when, and for what

    def send(self, message: MAVLinkMessage) -> None:
        """Send any message, unless another one has the vehicle: then nothing is sent, and `deadline`, `guard`
        and all that waits raise TakenOver.
        """
        authority = self._authority
        if authority is not None:
            was_ours = authority.take_over is None
            if not authority.may_send(message):
                if was_ours:
                    self._end_if_taken(authority)
                return
            self.tasks.on_sent(message)
        self.connection.send(message)

    # newest values

    async def position(self, timeout_s: float = 5.0) -> Position:
        """Newest global position; waits for one when there is none yet."""
        return await self.wait_until(
            lambda: self.latest(Position), what="position", on=("GLOBAL_POSITION_INT",), timeout_s=timeout_s
        )

    def taken_over(self) -> TakenOver | None:
        """The error of a vehicle that another one has; None: this program commands it."""
        take_over = None if self._authority is None else self._authority.take_over
        return None if take_over is None else TakenOver(take_over)

    def until_taken_over(self) -> AbstractAsyncContextManager[None]:
        """`async with`: raises TakenOver as soon as another one has the vehicle, whatever the block does."""
        return self._watch.block()

    def guard(self, awaited: str | Callable[[], str]) -> AbstractAsyncContextManager[None]:
        """`async with`: raises LinkClosed when the heartbeats stop while the block waits for `awaited`, and
        TakenOver when another one has the vehicle.
        """
        return self._watch.guard(awaited if callable(awaited) else lambda: awaited)

    @asynccontextmanager
    async def deadline(self, seconds: float, awaited: str | Callable[[], str]) -> AsyncIterator[None]:
        """`async with`: TimeoutError after `seconds` of vehicle time, LinkClosed when the link is lost.

        When a lost link may come back, a silence at the end of that time, and as much time after it, does not
        count: in all, as long as one link may be lost.
        """
        wait = (self.clock.time_us, awaited if callable(awaited) else lambda: awaited)
        self._waits.append(wait)
        try:
            if not self.regain_s:
                async with self.guard(awaited), self.clock.timeout(seconds):
                    yield
                return
            async with self.guard(awaited), asyncio.timeout(None) as scope:
                running_out = asyncio.ensure_future(self._run_out(scope, seconds))
                try:
                    yield
                finally:
                    running_out.cancel()
        finally:
            self._waits.remove(wait)

    async def _run_out(self, scope: asyncio.Timeout, seconds: float) -> None:
        """Let a deadline pass, and the silence at its end, but no more silence than one link may be lost: a
        vehicle that is received now and then can't delay it for ever.
        """
        clock = self.clock
        allowed_us = round((LOST_AFTER_S + self.regain_s) * 1e6)
        await clock.sleep(seconds)
        while self._silent and allowed_us > 0:
            assert self.heartbeat_us is not None
            since_us = self.heartbeat_us
            while self._silent and clock.time_us - since_us < allowed_us:
                await clock.sleep(_SILENT_CHECK_S)
            silent_us = clock.time_us - since_us
            allowed_us -= silent_us
            await clock.sleep(min(seconds, silent_us * 1e-6))
        scope.reschedule(asyncio.get_running_loop().time())

    @property
    def awaited(self) -> str:
        """What a task has been waiting for, for three seconds or more; "": no task has."""
        now_us = self.clock.time_us
        shown = next((what for since_us, what in self._waits if now_us - since_us >= _SHOWN_AFTER_US), None)
        return "" if shown is None else shown()

    @property
    def _silent(self) -> bool:
        """Whether no heartbeat was received for three seconds of vehicle time."""
        return self.heartbeat_us is not None and self.clock.time_us - self.heartbeat_us > _SILENT_AFTER_US

    async def follow(self, handle: Callable[[Frame], bool], *, on: Sequence[str]) -> None:
        """Pass each frame of the autopilot with a message named in `on` to `handle`, until it returns true.

        Each frame is handled when it is received, and the task that waits continues only at the end: for
        waits that look at many messages.

        Args:
            handle: must not send or wait; an error that it raises ends the wait.
            on: names of messages.
        """
        over: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        system_id = self._system_id

        def on_frame(frame: Frame) -> None:
            if frame.system_id != system_id or frame.component_id != AUTOPILOT_COMPONENT or over.done():
                return
            try:
                if handle(frame):
                    over.set_result(None)
            except MissionError as error:
                over.set_exception(error)

        stops = [self.connection.listen(name, on_frame, in_order=False) for name in on]
        try:
            await over
        finally:
            for stop in stops:
                stop()

    async def wait_until(
        self,
        predicate: Callable[[], T | None],
        *,
        what: str | Callable[[], str],
        on: Sequence[str],
        timeout_s: float,
    ) -> T:
        """Wait until `predicate` returns a true value, and return it. It is called now and after each message
        named in `on`.

        Args:
            predicate: checks the newest values; it may raise an error to end the wait.
            what: description of what is awaited, for the error.
            on: names of messages.
            timeout_s: vehicle seconds.

        Raises:
            VehicleTimeout: the message names what was awaited and what was received last.
            LinkClosed: the heartbeats stopped.
        """
        value = predicate()
        if value:
            await asyncio.sleep(0)  # also lets the clock advance for a caller that polls in a loop
            return value
        changed = asyncio.Event()
        stops = [self.connection.listen(name, lambda _: changed.set(), in_order=False) for name in on]
        try:
            async with self.deadline(timeout_s, what):
                while True:
                    await changed.wait()
                    changed.clear()
                    value = predicate()
                    if value:
                        return value
        except TimeoutError:
            awaited = what if isinstance(what, str) else what()
            raise VehicleTimeout(f"no {awaited} within {timeout_s:g} s; {self.last_received()}") from None
        finally:
            for stop in stops:
                stop()

    async def next_frame(self, stream: MessageStream[MessageT], *, what: str, timeout_s: float) -> Frame:
        """The next frame of a stream.

        Raises:
            VehicleTimeout: none was received in time.
            LinkClosed: the heartbeats stopped.
        """
        try:
            async with self.deadline(timeout_s, what):
                return await stream.frame()
        except TimeoutError:
            raise VehicleTimeout(f"no {what} within {timeout_s:g} s; {self.last_received()}") from None

    async def wait_disarmed(self, timeout_s: float = 300.0) -> None:
        """Wait until the vehicle is disarmed."""
        await self.wait_until(
            lambda: not self.armed, what="disarmed heartbeat", on=("HEARTBEAT",), timeout_s=timeout_s
        )

    async def wait_landed(self, timeout_s: float = 300.0) -> None:
        """Wait until the vehicle reports that it is landed."""
        await self.wait_until(
            lambda: self.landed_state == dialect.MAV_LANDED_STATE_ON_GROUND,
            what="landing",
            on=("EXTENDED_SYS_STATE",),
            timeout_s=timeout_s,
        )
