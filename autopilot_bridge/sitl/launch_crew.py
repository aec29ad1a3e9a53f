"""The launch of an aircraft by catapult or hand."""

from typing import Final

from autopilot_bridge.sitl.backend import AutopilotBackend, ReportsLiftOff
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
        backend: its autopilot. One that does not report when it lifts off is launched when it is armed.
        step_us: length of a physics step.
    """

    def __init__(self, vehicle: Vehicle, backend: AutopilotBackend, *, step_us: int) -> None:
        self._vehicle = vehicle
        self._backend = backend
        self._lift_off = backend if isinstance(backend, ReportsLiftOff) else None
        self._look_us = _SLOW_STEPS * step_us
        self._next_us = 0
        self._ready_since_us: int | None = None

    def watch(self, time_us: int) -> bool:
        """Check the aircraft; True when it has been launched, and no further call is needed."""
        if time_us < self._next_us:
            return False
        self._next_us = time_us + self._look_us
        lift_off = self._lift_off
        if not (self._backend.armed and (lift_off is None or lift_off.lifting_off)):
            self._ready_since_us = None
            return False
        if self._ready_since_us is None:
            self._ready_since_us = time_us
        if time_us - self._ready_since_us < LAUNCH_DELAY_S * 1e6:
            return False
        self._vehicle.launch()
        return True
