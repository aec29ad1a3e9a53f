"""Monitors the heartbeats of a vehicle: waits end when they stop, unless they come back in time, when the
messages contradict each other, and when another one takes the vehicle over.
"""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Final

from autopilot_bridge.clock import Clock, TelemetryClock
from missions.errors import LinkClosed, MissionError

LOST_AFTER_S: Final = 10.0
QUIET_AFTER_S: Final = 3.0
MakeError = Callable[[], MissionError]
"""Makes an error."""

_LOOK_EVERY_S: Final = 1.0
_JUST_BACK_S: Final = 5.0


class LinkWatch:
    """Ends waits when no heartbeat was received for 10 s plus `regain_s` of the event loop's time, and all at
    once by `end_all`.

    That is wall time for a vehicle that is not embedded, at any simulation speed, and vehicle time in the
    loop of an embedded one. A vehicle slower than real time gets 10 s of its own time. Time in which this
    process was busy (so that the check of the link was late by the same time) does not count as silence.
    Before the first heartbeat no wait is ended.

    Args:
        clock: vehicle time.
        last_received: text of what was received last, for the error.

    Attributes:
        regain_s: longest time for which a lost link may stay lost.
        quiet: no heartbeat for 3 s, while a task waits.
        lost: the link counts as lost.
        on_quiet: called when no heartbeat was received for 3 s.
        on_lost, on_regained: called when the link is lost, and when it is back.
    """

    def __init__(self, clock: Clock, last_received: Callable[[], str]) -> None:
        self.regain_s = 0.0
        self.quiet = False
        self.lost = False
        self.on_quiet: Callable[[], None] = lambda: None
        self.on_lost: Callable[[], None] = lambda: None
        self.on_regained: Callable[[], None] = lambda: None
        self._clock = clock
        self._last_received = last_received
        self._received_s: float | None = None
        self._back_s: float | None = None
        self._scopes: list[asyncio.Timeout] = []  # of waits
        self._blocks: list[asyncio.Timeout] = []  # of blocks that don't wait for the vehicle all the time
        self._errors: dict[asyncio.Timeout, MakeError] = {}  # with which waits end, other than by silence
        self._next: MakeError | None = None  # with which the next wait ends
        self._always: MakeError | None = None  # with which all end
        self._timer: asyncio.TimerHandle | None = None

    def on_heartbeat(self) -> None:
        """Note that a heartbeat of the vehicle was received."""
        self._received_s = asyncio.get_running_loop().time()
        if self.quiet:
            self.quiet = False
            self._back_s = self._received_s
        if self.lost:
            self.lost = False
            self.on_regained()

    @property
    def just_back(self) -> bool:
        """Whether a silence ended a moment ago, so that the autopilot may not have noticed it yet."""
        return self._back_s is not None and asyncio.get_running_loop().time() - self._back_s < _JUST_BACK_S

    def end_waits(self, reason: str) -> None:
        """End the present waits, or the next one, with a MissionError for this reason.

        Later waits are not ended: the vehicle is to be left safe.
        """

        def error() -> MissionError:
            return MissionError(f"{reason}; {self._last_received()}")

        self._errors = dict.fromkeys(self._scopes, error)
        self._next = None if self._scopes else error
        self._end(self._scopes)

    def end_all(self, error: MakeError) -> None:
        """End all present and later waits and blocks, each with an error that this function makes."""
        self._always = error
        self._end(self._scopes)
        self._end(self._blocks)

    @asynccontextmanager
    async def guard(self, awaited: Callable[[], str]) -> AsyncIterator[None]:
        """Context that raises LinkClosed when the heartbeats stop, and don't come back in time, while the
        block waits, and the errors of `end_waits` and `end_all`.

        Args:
            awaited: returns the description of what the block waits for, for the error.
        """
        error, self._next = self._always or self._next, None
        if error is not None:
            raise error()
        scope = asyncio.timeout(None)
        try:
            async with scope:
                self._scopes.append(scope)
                self._start()
                try:
                    yield
                finally:
                    self._scopes.remove(scope)
                    error = self._always or self._errors.pop(scope, None)
        except TimeoutError:
            if not scope.expired():
                raise
            if error is not None:
                raise error() from None
            raise LinkClosed(
                f"link lost: no heartbeat for {self._silence_s():.0f} s while waiting for {awaited()}; "
                f"{self._last_received()}"
            ) from None

    @asynccontextmanager
    async def block(self) -> AsyncIterator[None]:
        """Context that raises the error of `end_all` as soon as that is called, whatever the block does."""
        if self._always is not None:
            raise self._always()
        scope = asyncio.timeout(None)
        try:
            async with scope:
                self._blocks.append(scope)
                try:
                    yield
                finally:
                    self._blocks.remove(scope)
        except TimeoutError:
            if not scope.expired() or self._always is None:
                raise
            raise self._always() from None

    def _end(self, scopes: list[asyncio.Timeout]) -> None:
        for scope in scopes:
            if not scope.expired():
                scope.reschedule(asyncio.get_running_loop().time())

    def _silence_s(self) -> float:
        return 0.0 if self._received_s is None else asyncio.get_running_loop().time() - self._received_s

    def _slowness(self) -> float:
        """Wall seconds per vehicle second, for a vehicle slower than real time."""
        rate = self._clock.rate if isinstance(self._clock, TelemetryClock) else 1.0
        return 1.0 / min(1.0, rate)

    def _start(self) -> None:
        # continues during the many short waits of a command, and ends with the last of them
        if self._timer is None:
            loop = asyncio.get_running_loop()
            self._timer = loop.call_later(_LOOK_EVERY_S, self._look, loop.time() + _LOOK_EVERY_S)

    def _look(self, due_s: float) -> None:
        self._timer = None
        if not self._scopes:
            return
        now_s = asyncio.get_running_loop().time()
        if self._received_s is not None:
            self._received_s = min(now_s, self._received_s + max(0.0, now_s - due_s))
        silence_s, slowness = self._silence_s(), self._slowness()
        if silence_s >= QUIET_AFTER_S * slowness and not self.quiet:
            self.quiet = True
            self.on_quiet()
        if silence_s >= LOST_AFTER_S * slowness and not self.lost:
            self.lost = True
            self.on_lost()
        if silence_s >= LOST_AFTER_S * slowness + self.regain_s:
            self._end(self._scopes)
        self._start()
