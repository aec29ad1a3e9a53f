"""The time of a remote vehicle, from the timestamps in its messages."""

import asyncio
import math
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from typing import Any, Final

from autopilot_bridge.clock.pacing import wall_time_s

_WINDOW_S: Final = 4.0  # wall seconds over which the rate is measured
_MIN_WINDOW_S: Final = 0.25  # a shorter base is too short to measure the rate
_MIN_SPACING_S: Final = 0.02  # observations kept for the rate are no closer than this
_MAX_STEP_BACK_US: Final = 1_000_000  # messages overtake each other by less; more is a new time base
_MAX_STEP_AHEAD_US: Final = 2_000_000  # a longer step, unexplained by ten times the rate, is a new time base
_QUICKER: Final = 10.0
_WRAP_US: Final = (1 << 32) * 1000  # time_boot_ms has 32 bits
_BACKLOG_S: Final = 0.25  # wall seconds in which messages that waited in the queue are read
_RATE_LIMITS: Final = (0.05, 1000.0)
_SLOW_S: Final = 2.0  # wall seconds for which a slower vehicle is waited for, before its time is left behind
_STOOD_STILL_S: Final = 1.0  # vehicle seconds; for a shorter time any vehicle repeats a time stamp
_PACED_US: Final = (
    2_000_000.0  # vehicle time assumed between two messages; autopilots send theirs every second
)
_SILENT_RATE: Final = 1.0  # greatest rate while nothing is received
_MAX_TIMER_S: Final = 1.0  # wall seconds after which deadlines are checked again: rates change


class TelemetryClock:
    """Vehicle time, extrapolated between messages at the rate (speed factor) measured recently.

    `time_us` follows the vehicle's own time since boot. The first observation sets it, and waits begun before
    keep their remaining time. From then on it never runs backwards: when the vehicle reboots, or continues
    after a pause during which deadlines advanced, time continues from its value, and differs from the time
    stamps of messages (`stamp_us`). Messages that waited while this process was busy are no pause: time
    stands still until they have been read. While nothing is received, time advances at the last rate for two
    seconds of the vehicle's time, then at most at real time: deadlines expire on a dead link too, and a
    simulator that is stopped for a moment delays them by that moment only, however fast it was.

    A vehicle can't delay a deadline by its time stamps: a stamp that repeats the last one counts as nothing
    received, a step ahead that its rate does not explain is a new time base, and time advances by at least
    0.05 s per wall second while messages are received.

    Args:
        monotonic: wall clock in seconds.

    Attributes:
        reboots: number of backward jumps of the vehicle's own time.
        jumps: number of steps ahead that the vehicle's rate did not explain.
        wraps: how often the time stamps began again at 0, every 49.7 days.
        first_step_us: step of `time_us` at the first observation, by which times before it are too small.
    """

    def __init__(self, monotonic: Callable[[], float] = wall_time_s) -> None:
        self._monotonic = monotonic
        self._wall_s = monotonic()  # of the newest observation
        self._base_us = 0.0  # clock time at that moment
        self._offset_us = 0.0  # clock time minus vehicle time
        self._vehicle_us: int | None = None
        self._rate = 1.0
        self._behind: tuple[float, float] | None = None  # wall s and offset when the vehicle fell behind
        self._history: deque[tuple[float, int]] = deque()
        self._reported_us = 0
        self._deadlines: list[_Deadline] = []
        self._timer: asyncio.TimerHandle | None = None
        self._pace = (self._wall_s, 0.0)  # wall s and clock time when the vehicle was last at the lowest rate
        self._repeated_s = 0.0  # wall seconds for which the newest time stamp has been repeated
        self.reboots = 0
        self.jumps = 0
        self.wraps = 0
        self.first_step_us = 0
        self._stood_still_s = 0.0

    @property
    def rate(self) -> float:
        """Vehicle seconds per wall second."""
        return self._rate

    @property
    def vehicle_time_us(self) -> int | None:
        """Newest time in a message of the vehicle; None before the first."""
        return self._vehicle_us

    @property
    def silence_s(self) -> float:
        """Wall seconds since the newest observation (or since the clock was made)."""
        return self._monotonic() - self._wall_s

    @property
    def time_us(self) -> int:
        """Vehicle time now; never runs backwards."""
        self._reported_us = max(self._reported_us, math.floor(self._base_us + self._since_us))
        return self._reported_us

    @property
    def stamp_us(self) -> int:
        """The vehicle's own time now; runs backwards when it reboots, or continues after a pause."""
        return math.floor(self._base_us - self._offset_us + self._since_us)

    @property
    def _since_us(self) -> float:
        """Vehicle time since the newest observation, as it is assumed."""
        paced_us = (self._monotonic() - self._wall_s) * 1e6 * self._rate
        return min(paced_us, _PACED_US) + max(0.0, paced_us - _PACED_US) * self._slower_in_silence

    @property
    def _slower_in_silence(self) -> float:
        """The rate while nothing is received, as a fraction of the vehicle's rate."""
        return min(1.0, _SILENT_RATE / self._rate)

    def wall_s_until(self, time_us: int) -> float:
        """Wall seconds until a time, if nothing is received before; 0 when it has passed."""
        due_us = time_us - self._base_us
        paced_us = min(due_us, _PACED_US) + max(0.0, due_us - _PACED_US) / self._slower_in_silence
        return max(0.0, paced_us * 1e-6 / self._rate - self.silence_s)

    @property
    def stood_still_s(self) -> float:
        """Wall seconds in which stamped messages were received whose time did not advance."""
        usual_s = _STOOD_STILL_S / min(1.0, self._rate)
        return self._stood_still_s + (self._repeated_s if self._repeated_s > usual_s else 0.0)

    def observe(self, vehicle_time_us: int) -> None:
        """Process the timestamp of a message that has just arrived."""
        now_us = self.time_us
        wall_s = self._monotonic()
        if self._vehicle_us is None:
            self._set_first(vehicle_time_us, now_us)
            self._pace = (wall_s, vehicle_time_us)
        else:
            step_us = self._step_us(vehicle_time_us)
            if step_us == 0:
                self._repeated_s = wall_s - self._wall_s
            if -_MAX_STEP_BACK_US <= step_us <= 0:
                return  # no news, or overtaken by a later message
            self._stood_still_s, self._repeated_s = self.stood_still_s, 0.0
            self._follow(step_us, vehicle_time_us, now_us, wall_s)
        self._vehicle_us = vehicle_time_us
        self._wall_s = wall_s
        self._base_us = vehicle_time_us + self._offset_us
        self._update_rate(wall_s, vehicle_time_us)
        self._fire_due()

    def _step_us(self, vehicle_time_us: int) -> int:
        """Time since the newest stamp; the stamps wrap after 49.7 days."""
        assert self._vehicle_us is not None
        return (vehicle_time_us - self._vehicle_us + _WRAP_US // 2) % _WRAP_US - _WRAP_US // 2

    def _follow(self, step_us: int, vehicle_time_us: int, now_us: int, wall_s: float) -> None:
        """Set the offset for a new stamp."""
        assert self._vehicle_us is not None
        quickest_us = (wall_s - self._wall_s) * 1e6 * max(1.0, self._rate) * _QUICKER
        if step_us < 0 or step_us > _MAX_STEP_AHEAD_US + quickest_us:
            self.reboots += step_us < 0
            self.jumps += step_us > 0
            self._history.clear()
            self._behind = None
            self._offset_us = now_us - vehicle_time_us
            self._pace = (wall_s, now_us)
            return
        if vehicle_time_us < self._vehicle_us:
            self.wraps += 1
            self._offset_us += _WRAP_US
        due_us = vehicle_time_us + self._offset_us
        if now_us - due_us <= _MAX_STEP_BACK_US:
            self._behind = None
            self._keep_pace(due_us, vehicle_time_us, wall_s)
            return
        if self._behind is None:
            self._behind = (wall_s, now_us - vehicle_time_us)
        if wall_s - self._behind[0] >= _BACKLOG_S:
            # The vehicle was paused (paused simulator, suspended machine) while deadlines advanced.
            self._history.clear()
            self._offset_us = self._behind[1]
            self._behind = None
            self._pace = (wall_s, vehicle_time_us + self._offset_us)
        # Otherwise this process may have been busy, and these messages have waited in the queue.

    def _keep_pace(self, due_us: float, vehicle_time_us: int, wall_s: float) -> None:
        """Leave the time of a vehicle behind that is slower than the lowest rate, so that it delays no
        deadline for ever.
        """
        since_s, since_us = self._pace
        least_us = since_us + (wall_s - since_s) * 1e6 * _RATE_LIMITS[0]
        if due_us < least_us and wall_s - since_s < _SLOW_S:
            return  # messages that waited in the queue come in a burst
        self._offset_us = max(due_us, least_us) - vehicle_time_us
        self._pace = (wall_s, max(due_us, least_us))

    async def sleep_until(self, time_us: int) -> None:
        """Wait until the vehicle's time has come."""
        if self.time_us >= time_us:
            await asyncio.sleep(0)
            return
        done: asyncio.Future[None] = asyncio.get_running_loop().create_future()

        def wake() -> None:
            if not done.done():
                done.set_result(None)

        deadline = self._add_deadline(time_us, wake)
        try:
            await done
        finally:
            self._remove_deadline(deadline)

    async def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of vehicle time."""
        await self.sleep_until(self.time_us + round(seconds * 1e6))

    def timeout(self, seconds: float) -> AbstractAsyncContextManager[Any]:
        """Raises TimeoutError when the block takes longer than `seconds` of vehicle time."""
        return self._timeout(seconds)

    @asynccontextmanager
    async def _timeout(self, seconds: float) -> AsyncIterator[asyncio.Timeout]:
        loop = asyncio.get_running_loop()
        async with asyncio.timeout(None) as scope:
            deadline = self._add_deadline(
                self.time_us + round(seconds * 1e6), lambda: scope.reschedule(loop.time())
            )
            try:
                yield scope
            finally:
                self._remove_deadline(deadline)

    def _set_first(self, vehicle_time_us: int, now_us: int) -> None:
        self.first_step_us = vehicle_time_us - now_us
        for deadline in self._deadlines:
            deadline.time_us += self.first_step_us
        self._reported_us = vehicle_time_us

    def _update_rate(self, wall_s: float, vehicle_us: int) -> None:
        history = self._history
        if not history or wall_s - history[-1][0] >= _MIN_SPACING_S:
            history.append((wall_s, vehicle_us))
        while len(history) > 2 and wall_s - history[1][0] >= _WINDOW_S:
            history.popleft()
        first_s, first_us = history[0]
        if wall_s - first_s >= _MIN_WINDOW_S:
            rate = (vehicle_us - first_us) * 1e-6 / (wall_s - first_s)
            self._rate = min(max(rate, _RATE_LIMITS[0]), _RATE_LIMITS[1])

    def _add_deadline(self, time_us: int, callback: Callable[[], object]) -> "_Deadline":
        deadline = _Deadline(time_us, callback)
        self._deadlines.append(deadline)
        self._arm()
        return deadline

    def _remove_deadline(self, deadline: "_Deadline") -> None:
        if deadline in self._deadlines:
            self._deadlines.remove(deadline)
        if not self._deadlines and self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _fire_due(self) -> None:
        now_us = self.time_us
        for deadline in [item for item in self._deadlines if item.time_us <= now_us]:
            self._deadlines.remove(deadline)
            deadline.callback()

    def _arm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._deadlines:
            first_us = min(deadline.time_us for deadline in self._deadlines)
            wait_s = min(self.wall_s_until(first_us), _MAX_TIMER_S)
            self._timer = asyncio.get_running_loop().call_later(wait_s, self._on_timer)

    def _on_timer(self) -> None:
        self._timer = None
        self._fire_due()
        self._arm()


class _Deadline:
    """A time of the vehicle, and the action at that time."""

    def __init__(self, time_us: int, callback: Callable[[], object]) -> None:
        self.time_us = time_us
        self.callback = callback
