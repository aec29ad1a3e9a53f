"""Time common to a team: vehicles boot at different moments, and SYSTEM_TIME tells by how much."""

from typing import Final

from estimators.messages import Message

__all__ = ["TeamTime"]

_LEAST_UNIX_US: Final = 946_684_800_000_000
"""2000-01-01: an autopilot that does not know the calendar sends 0, or counts from 1970 or 1980."""
_TOGETHER_US: Final = 2_000
"""SYSTEM_TIME counts milliseconds: boots that are no further apart can't be told from one."""
_STEP_US: Final = 500_000
"""A clock that differs by more than this from what it said before was set, or its vehicle has booted anew."""


class TeamTime:
    """Takes the times of each vehicle to the time of the one whose calendar was known first.

    A vehicle's boot in Unix time is what its first SYSTEM_TIME says, and stays so: the message counts
    milliseconds, and its jitter must not get into the estimates. As long as a vehicle's boot isn't known
    (embedded SITL boots all vehicles together; a GPS receiver may not know the time yet), its time is taken
    as it is.
    """

    __slots__ = ("_boots_us", "_reference_us")

    def __init__(self) -> None:
        self._boots_us: dict[int, int] = {}
        self._reference_us: int | None = None

    def learn(self, time_us: int, message: Message) -> None:
        """Take a SYSTEM_TIME of an autopilot, at its vehicle time."""
        if message.time_unix_usec < _LEAST_UNIX_US:
            return
        boot_us = message.time_unix_usec - time_us
        known_us = self._boots_us.get(message.src_system)
        if self._reference_us is None:
            self._reference_us = boot_us
        if abs(boot_us - self._reference_us) <= _TOGETHER_US:
            boot_us = self._reference_us
        if known_us is None or abs(boot_us - known_us) > _STEP_US:
            self._boots_us[message.src_system] = boot_us

    def common_us(self, time_us: int, system_id: int) -> int:
        """The common time of a vehicle's time."""
        boot_us = self._boots_us.get(system_id)
        if boot_us is None or self._reference_us is None:
            return time_us
        return time_us + boot_us - self._reference_us
