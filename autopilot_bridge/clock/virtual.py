"""An asyncio event loop on the time of a simulated world.

`asyncio.sleep(1)` in a mission means one second of vehicle time. Whenever no task can run, the loop makes the
world advance by physics steps until a timer is due or a step has woken a task (as trio's autojump clock, with
a world that must be stepped through instead of jumped over). Without real file descriptors the order of
events depends on the world alone: not on the machine, the speed factor, or how often the process was stopped.
"""

import asyncio
import math
import selectors
from collections.abc import Callable, Coroutine
from contextvars import Context
from typing import Any, Final, TypeVar

from autopilot_bridge.clock.pacing import Pacer, wall_time_s
from autopilot_bridge.errors import ClockError

T = TypeVar("T")

_NEVER_US: Final = 1 << 62
_STEPS_PER_POLL: Final = 64  # file descriptors and signal wake-ups are checked this often
_MAX_ROUNDS_WITHOUT_STEP: Final = 1000  # tasks that only yield to each other must not stop the world
_MIN_SLEEP_S: Final = 1e-3  # resolution of epoll; a smaller lead is left to the next step
_LIMIT_GRACE_US: Final = 10_000_000  # time for tasks to clean up after the time limit


class VirtualTimeLoop(asyncio.SelectorEventLoop):
    """Event loop on the time of a simulated world.

    Args:
        advance: makes one physics step. It may wake tasks (set results of futures, put into queues).
        time_us: the world's time, microseconds since boot.
        speedup: greatest number of simulated seconds per wall second; None: as fast as possible. Pacing only
            sleeps.
        max_time_us: the run fails with a ClockError when the world reaches this time; None: no limit.
        monotonic: wall clock in seconds, for pacing.

    Attributes:
        time_us: the loop's time.

    An exception in `advance` ends the run with that exception. Then the world stands still; tasks that are
    cancelled clean up on a time that jumps to each of their timers.
    """

    def __init__(
        self,
        advance: Callable[[], object],
        time_us: Callable[[], int],
        *,
        speedup: float | None = None,
        max_time_us: int | None = None,
        monotonic: Callable[[], float] = wall_time_s,
    ) -> None:
        self.time_us = time_us
        self._world_selector = _WorldSelector(advance, time_us, max_time_us, self._go_on_without_world)
        if speedup is not None:
            self._world_selector.pacer = Pacer(speedup, monotonic)
        super().__init__(self._world_selector)
        self._world_selector.ready = self._ready  # type: ignore[attr-defined]
        self._clock_resolution = 1e-7  # below a microsecond, above rounding of seconds in a float

    def time(self) -> float:
        """The world's time in seconds."""
        return self.time_us() * 1e-6

    def call_at(  # type: ignore[override]
        self, when: float, callback: Callable[..., object], *args: Any, context: Context | None = None
    ) -> asyncio.TimerHandle:
        """As the base class; a timer set during a physics step may be the next one due."""
        selector = self._world_selector
        due_us = _due_us(when)
        if due_us < selector.due_us:
            selector.due_us = due_us
        return super().call_at(when, callback, *args, context=context)

    def _go_on_without_world(self, passed_us: int) -> None:
        now_us = self.time_us() + passed_us
        self.time_us = lambda: now_us

    @property
    def slipped_s(self) -> float:
        """Wall seconds lost because the world could not keep pace; 0 when not paced."""
        pacer = self._world_selector.pacer
        return 0.0 if pacer is None else pacer.slipped_s


class _WorldSelector(selectors.DefaultSelector):
    """Steps the world where the loop would wait for file descriptors."""

    def __init__(
        self,
        advance: Callable[[], object],
        time_us: Callable[[], int],
        max_time_us: int | None,
        pass_time: Callable[[int], None],
    ) -> None:
        super().__init__()
        self.ready: Any = ()
        self.due_us = _NEVER_US
        self.pacer: Pacer | None = None
        self._advance = advance
        self._time_us = time_us
        self._pass_time = pass_time
        self._limit_us = _NEVER_US if max_time_us is None else max_time_us
        self._max_time_us = max_time_us
        self._until_poll = 0
        self._rounds = 0
        self._broken: BaseException | None = None
        self._grace_us = _LIMIT_GRACE_US

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        """Step the world until a task can run or a timer is due; `timeout` counts in the world's time."""
        if self._broken is not None:
            return self._select_without_world(self._broken, timeout)
        if timeout is not None and timeout <= 0.0:
            self._rounds += 1
            if self._rounds < _MAX_ROUNDS_WITHOUT_STEP:
                self._until_poll -= 1
                return self._poll() if self._until_poll <= 0 else []
            self.due_us = 0  # one step, then the tasks again
        elif timeout is None:
            self.due_us = _NEVER_US
        else:
            self.due_us = self._time_us() + math.ceil(timeout * 1e6 - 1e-2)
        yielding = self._rounds >= _MAX_ROUNDS_WITHOUT_STEP
        self._rounds = 0
        advance, time_us, ready, pacer = self._advance, self._time_us, self.ready, self.pacer
        now_us = time_us()
        while True:
            if now_us >= self._limit_us:
                self._stop_at_limit()
            self._until_poll -= 1
            if self._until_poll <= 0 and (events := self._poll()):
                return events
            if pacer is not None:
                ahead_s = pacer.ahead_s(now_us)
                if ahead_s > _MIN_SLEEP_S and (events := super().select(ahead_s)):
                    return events
            try:
                advance()
            except BaseException as error:
                self._broken = error
                raise
            now_us = time_us()
            if ready or yielding or now_us >= self.due_us:
                return []

    def _select_without_world(
        self, broken: BaseException, timeout: float | None
    ) -> list[tuple[selectors.SelectorKey, int]]:
        passed_us = _NEVER_US if timeout is None else math.ceil(timeout * 1e6)
        self._grace_us -= passed_us + 1  # tasks that only yield to each other end, too
        if self._grace_us < 0:
            raise broken
        self._pass_time(passed_us)
        return super().select(0)

    def _poll(self) -> list[tuple[selectors.SelectorKey, int]]:
        self._until_poll = _STEPS_PER_POLL
        events: list[tuple[selectors.SelectorKey, int]] = super().select(0)
        return events

    def _stop_at_limit(self) -> None:
        self._limit_us += _LIMIT_GRACE_US
        assert self._max_time_us is not None
        raise ClockError(
            f"the run did not end within {self._max_time_us * 1e-6:g} s of vehicle time; "
            f"raise the limit, or look for a wait without a deadline"
        )


def _due_us(when_s: float) -> int:
    return math.ceil(when_s * 1e6 - 1e-2) if when_s < 1e12 else _NEVER_US


def run(main: Coroutine[Any, Any, T], loop: asyncio.AbstractEventLoop) -> T:
    """Run a coroutine on a loop as `asyncio.run` does, and close the loop.

    Remaining tasks are cancelled and get time to clean up. The first Ctrl-C cancels `main`, so
    that it can leave the vehicle safe; KeyboardInterrupt is raised when it has finished. A second one stops
    at once.
    """
    with asyncio.Runner(loop_factory=lambda: loop) as runner:
        return runner.run(main)
