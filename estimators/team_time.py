"""The common time of a team: vehicles boot at different moments, and SYSTEM_TIME reports the difference."""

from typing import Final

from estimators.messages import Message

__all__ = ["TeamTime"]

_LEAST_UNIX_US: Final = 946_684_800_000_000
"""2000-01-01. An autopilot that does not know the date sends 0, or counts from 1970 or 1980."""
_TOGETHER_US: Final = 2_000
"""SYSTEM_TIME counts milliseconds: boots that are closer together are treated as simultaneous."""
_STEP_US: Final = 500_000
"""If a clock differs from its earlier value by more than this, it was set or its vehicle has rebooted."""


class TeamTime:
    """Converts the times of each vehicle to the time of the vehicle whose date was known first.

    The Unix time of a vehicle's boot is taken from its first SYSTEM_TIME and then kept, because the message
    has a resolution of milliseconds and its jitter must not affect the estimates. As long as a vehicle's boot
    isn't known (embedded SITL boots all vehicles together; a GPS receiver may not know the time yet), its
    time is not converted.
    """

    def __init__(self) -> None:
        self._boots_us: dict[int, int] = {}
        self._reference_us: int | None = None

    def learn(self, time_us: int, message: Message) -> None:
        """Process a SYSTEM_TIME of an autopilot, at its vehicle time."""
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
        """The common time for a vehicle's time."""
        boot_us = self._boots_us.get(system_id)
        if boot_us is None or self._reference_us is None:
            return time_us
        return time_us + boot_us - self._reference_us
