"""The signals that end a command: from Ctrl-C, `kill`, a service manager, or a closed terminal.

`kill`, `timeout` and service managers send SIGTERM; a closed terminal sends SIGHUP; on Windows Ctrl-Break and
a closed console send SIGBREAK. By default they end a process immediately, with its vehicles in the air. Here
they act like Ctrl-C: a process that receives one leaves its vehicles safe before it ends.
"""

import asyncio
import contextvars
import signal
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from types import FrameType, TracebackType
from typing import Any, ClassVar, Final, Self, TypeVar

from autopilot_bridge.clock import run
from autopilot_bridge.clock.pacing import wall_time_s
from flightsim.foundation.operating_system import END_SIGNALS

T = TypeVar("T")

_SAME_S: Final = 1.0
"""A closed terminal and its shell both send SIGHUP, and `timeout` sends SIGTERM twice: within this time they
count as one.
"""


def end_signals(*always: signal.Signals) -> tuple[signal.Signals, ...]:
    """The `END_SIGNALS` that this process should handle now.

    Signals that are ignored (`nohup`, a background job) or that already have another handler are left out,
    except those in `always`. Outside the main thread all are left out, because only the main thread can
    handle signals.
    """
    if threading.current_thread() is not threading.main_thread():
        return ()
    theirs = (signal.SIG_DFL, signal.default_int_handler)
    return tuple(n for n in END_SIGNALS if n in always or signal.getsignal(n) in theirs)


class EndSignalHandler(ABC):
    """A context in which it handles these signals.

    Attributes:
        always: signals that are handled even if they were ignored or had a handler, see `end_signals`.
    """

    always: ClassVar[tuple[signal.Signals, ...]] = ()

    def __init__(self) -> None:
        self._before: dict[int, Any] = {}

    def __enter__(self) -> Self:
        for number in end_signals(*self.always):
            self._before[number] = signal.signal(number, self._on_signal)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @abstractmethod
    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        """Handle one of the signals."""


class EndedBySignal(KeyboardInterrupt):
    """A KeyboardInterrupt that carries the signal that caused it.

    Attributes:
        number: the signal's number.
    """

    def __init__(self, number: int) -> None:
        super().__init__(f"ended by {signal.Signals(number).name}")
        self.number = number


def signal_of(interrupt: KeyboardInterrupt) -> int:
    """The signal that caused the interrupt."""
    return interrupt.number if isinstance(interrupt, EndedBySignal) else signal.SIGINT


class _Interrupting(EndSignalHandler):
    """A context in which each of the signals raises EndedBySignal."""

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        raise EndedBySignal(number)


def wait_for_interrupt() -> None:
    """Wait until Ctrl-C, SIGTERM or SIGHUP, which end the wait without an error."""
    with suppress(KeyboardInterrupt), _Interrupting():
        threading.Event().wait()


class EndingSignals(EndSignalHandler):
    """A context in which Ctrl-C, SIGTERM and SIGHUP interrupt in the same way.

    During `run`, the first signal cancels the coroutine, and a later one stops it immediately; outside `run`,
    the first one stops immediately. See `end_signals` for the signals that are not handled. Work that another
    thread does (`in_thread`) is interrupted in the same way, except that it ends by itself outside `run`.
    """

    def __init__(self) -> None:
        super().__init__()
        self._task: asyncio.Task[Any] | None = None
        self._number: int | None = None
        self._first_wall_s = 0.0
        self._elsewhere = False
        self._late = False  # what was to be interrupted had ended

    def run(self, main: Coroutine[Any, Any, None], loop: asyncio.AbstractEventLoop) -> None:
        """Run a coroutine on a loop as `autopilot_bridge.clock.run` does.

        Raises:
            EndedBySignal: it was interrupted, and has ended.
        """
        try:
            run(self._interruptible(main), loop)
        except asyncio.CancelledError:
            if self._number is None:
                raise
            raise EndedBySignal(self._number) from None

    def in_thread(self, work: Callable[[], T]) -> T:
        """Do work, which may `run`, in a thread of its own, and wait for it: for a thread that has a running
        event loop, such as a notebook's.

        Raises:
            EndedBySignal: it was interrupted.
        """
        self._elsewhere = True
        with ThreadPoolExecutor(1, thread_name_prefix="flight") as pool:
            done = pool.submit(contextvars.copy_context().run, work).result()
        if self._late and self._number is not None:
            raise EndedBySignal(self._number)
        return done

    async def beside(self, work: Callable[[], T]) -> T:
        """The same for a coroutine, whose event loop goes on. Its cancellation interrupts the work.

        Raises:
            CancelledError: it was interrupted, and has ended.
        """
        self._elsewhere = True
        pool = ThreadPoolExecutor(1, thread_name_prefix="flight")
        done = asyncio.get_running_loop().run_in_executor(pool, contextvars.copy_context().run, work)
        pool.shutdown(wait=False)
        cancelled: asyncio.CancelledError | None = None
        while not done.done():
            try:
                await asyncio.wait([done])
            except asyncio.CancelledError as error:
                cancelled = error
                self.interrupt(signal.SIGINT)
        if cancelled is not None:
            done.exception()  # it is the answer to the interruption
            raise cancelled
        return done.result()

    async def _interruptible(self, main: Coroutine[Any, Any, None]) -> None:
        self._task = asyncio.current_task()
        if self._number is not None:  # by another thread, before this one came here
            main.close()
            raise asyncio.CancelledError
        await main

    def interrupt(self, number: int) -> None:
        """Interrupt as a signal does. Work in another thread is interrupted there.

        Args:
            number: the signal's number.

        Raises:
            EndedBySignal: there is nothing to cancel; only where this thread does the work.
        """
        now_s = wall_time_s()
        task, again = self._task, self._number is not None
        if again and number != signal.SIGINT and now_s - self._first_wall_s < _SAME_S:
            return
        self._number, self._first_wall_s = self._number or number, now_s
        running = task is not None and not task.done()
        self._late = task is not None and not running
        if not self._elsewhere and (again or not running):
            raise EndedBySignal(self._number)
        if task is not None and running:
            stop = partial(_raise, EndedBySignal(self._number)) if again else task.cancel
            with suppress(RuntimeError):  # the loop was closed meanwhile
                # from any thread; it also wakes the loop, which may be waiting for a long time
                task.get_loop().call_soon_threadsafe(stop)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        self.interrupt(number)


def _raise(error: BaseException) -> None:
    raise error


class StopOnSignals(EndSignalHandler):
    """A context in which such a signal makes a loop call a function, which ends its work normally.

    Unlike `loop.add_signal_handler`, it works on Windows too.

    Args:
        loop: is woken by a signal.
        stop: called by the loop.
    """

    always = (signal.SIGINT, signal.SIGTERM)

    def __init__(self, loop: asyncio.AbstractEventLoop, stop: Callable[[], None]) -> None:
        super().__init__()
        self._loop, self._stop = loop, stop

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._stop)


class EndRequests(EndSignalHandler):
    """A context in which such a signal ends the command with an orderly shutdown.

    At first a signal raises KeyboardInterrupt, so that it stops the start at any point; after `remember` it
    only sets `requested`. SIGHUP stays ignored if it is ignored on entry (`nohup`). For the main thread only.

    Attributes:
        requested: whether such a signal was received.
    """

    always = (signal.SIGINT, signal.SIGTERM)

    def __init__(self) -> None:
        super().__init__()
        self.requested = False
        self._raises = True

    def remember(self) -> None:
        """Stop raising KeyboardInterrupt; requests are only remembered from now on.

        Raises:
            KeyboardInterrupt: a request came earlier in a place where no exception can be raised (for example
                a finaliser).
        """
        self._raises = False
        if self.requested:
            raise KeyboardInterrupt

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        again, self.requested = self.requested, True
        if self._raises and not again:  # at the second signal the command is already ending
            raise KeyboardInterrupt
