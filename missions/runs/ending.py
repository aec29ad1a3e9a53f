"""SIGTERM and SIGHUP act like Ctrl-C: a process that receives one leaves its vehicles safe before it ends.

`kill`, `timeout` and service managers send SIGTERM; a closed terminal sends SIGHUP. By default both end a
process immediately, with its vehicles in the air.
"""

import asyncio
import signal
from collections.abc import Coroutine
from types import FrameType
from typing import Any, Final

from autopilot_bridge.clock import run
from autopilot_bridge.clock.pacing import wall_time_s
from missions.runs.end_signals import EndSignalHandler

_SAME_S: Final = 1.0
"""A closed terminal and its shell both send SIGHUP, and `timeout` sends SIGTERM twice: within this time they
count as one.
"""


class AskedToEnd(KeyboardInterrupt):
    """A KeyboardInterrupt that carries the signal that caused it.

    Attributes:
        number: the signal's number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(f"ended by {signal.Signals(number).name}")
        self.number = number


def signal_of(interrupt: KeyboardInterrupt) -> int:
    """The signal that caused the interrupt."""
    return interrupt.number if isinstance(interrupt, AskedToEnd) else signal.SIGINT


class EndingSignals(EndSignalHandler):
    """A context in which Ctrl-C, SIGTERM and SIGHUP interrupt in the same way.

    During `run`, the first signal cancels the coroutine, and a later one stops it immediately; outside `run`,
    the first one stops immediately. See `end_signals` for the signals that are not handled.
    """

    def __init__(self) -> None:
        super().__init__()
        self._task: asyncio.Task[Any] | None = None
        self._number: int | None = None
        self._asked_wall_s = 0.0

    def run(self, main: Coroutine[Any, Any, None], loop: asyncio.AbstractEventLoop) -> None:
        """Run a coroutine on a loop as `autopilot_bridge.clock.run` does.

        Raises:
            AskedToEnd: it was interrupted, and has ended.
        """
        try:
            run(self._interruptible(main), loop)
        except asyncio.CancelledError:
            if self._number is None:
                raise
            raise AskedToEnd(self._number) from None

    async def _interruptible(self, main: Coroutine[Any, Any, None]) -> None:
        self._task = asyncio.current_task()
        await main

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        now_s = wall_time_s()
        task, again = self._task, self._number is not None
        if again and number != signal.SIGINT and now_s - self._asked_wall_s < _SAME_S:
            return
        self._number, self._asked_wall_s = self._number or number, now_s
        if again or task is None or task.done():
            raise AskedToEnd(self._number)
        task.cancel()
        # wakes the loop, which may be waiting for a long time
        task.get_loop().call_soon_threadsafe(lambda: None)
