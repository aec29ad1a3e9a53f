"""The clock interface for tasks."""

import asyncio
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from typing import Any, Protocol


class Clock(Protocol):
    """Vehicle time for asyncio tasks."""

    @property
    def time_us(self) -> int:
        """Microseconds since the vehicle booted; never runs backwards."""
        ...

    @property
    def stamp_us(self) -> int:
        """The vehicle's time stamp for a message sent now, microseconds: to be compared with time stamps.

        The same as `time_us`, except for vehicles that booted after the clock began, reboot or pause.
        """
        ...

    async def sleep_until(self, time_us: int) -> None:
        """Wait until the vehicle's time has come; a time in the past only yields to other tasks."""
        ...

    async def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of vehicle time."""
        ...

    def timeout(self, seconds: float) -> AbstractAsyncContextManager[Any]:
        """`async with clock.timeout(5.0):` raises TimeoutError when the block takes longer than that."""
        ...


class LoopClock:
    """An event loop's own time: vehicle time on a `VirtualTimeLoop`.

    It is that of the loop that runs when the time is first requested.
    """

    def __init__(self) -> None:
        self._read_us: Callable[[], int] | None = None

    @property
    def time_us(self) -> int:
        """Microseconds of the loop's time."""
        read_us = self._read_us
        if read_us is None:  # kept, because to find the running loop is a system call
            loop = asyncio.get_running_loop()
            read_us = self._read_us = getattr(loop, "time_us", lambda: round(loop.time() * 1e6))
        return read_us()

    stamp_us = time_us
    """The same: the loop's time is the vehicle's."""

    async def sleep_until(self, time_us: int) -> None:
        """Wait until the loop's time has come."""
        await asyncio.sleep(max(0, time_us - self.time_us) * 1e-6)

    async def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of the loop's time."""
        await asyncio.sleep(seconds)

    def timeout(self, seconds: float) -> AbstractAsyncContextManager[Any]:
        """Raises TimeoutError when the block takes longer."""
        return asyncio.timeout(seconds)
