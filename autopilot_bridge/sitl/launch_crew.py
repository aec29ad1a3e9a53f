"""The launch of an aircraft by catapult or hand."""

from typing import Final

from autopilot_bridge.commander import Commander
from flightsim.vehicle import Vehicle

LAUNCH_DELAY_S: Final = 3.0
"""Time from the moment when the aircraft is ready until its launch."""
_SLOW_STEPS: Final = 5


class LaunchCrew:
    """Launches an aircraft some seconds after it is armed and its task starts to take off.

    An aircraft is launched only when its autopilot requests it: an aircraft that is armed in a mode that
    stays on the ground is not launched.

    Args:
        vehicle: the aircraft on its launcher.
        commander: of its autopilot.
        step_us: length of a physics step.
    """

    __slots__ = ("_commander", "_look_us", "_next_us", "_ready_since_us", "_vehicle")

    def __init__(self, vehicle: Vehicle, commander: Commander, *, step_us: int) -> None:
        self._vehicle = vehicle
        self._commander = commander
        self._look_us = _SLOW_STEPS * step_us
        self._next_us = 0
        self._ready_since_us: int | None = None

    def watch(self, time_us: int) -> bool:
        """Check the aircraft; True when it has been launched, and no further call is needed."""
        if time_us < self._next_us:
            return False
        self._next_us = time_us + self._look_us
        commander = self._commander
        if not (commander.armed and commander.tasks.lifting_off):
            self._ready_since_us = None
            return False
        if self._ready_since_us is None:
            self._ready_since_us = time_us
        if time_us - self._ready_since_us < LAUNCH_DELAY_S * 1e6:
            return False
        self._vehicle.launch()
        return True
