"""The stream of setpoints for offboard (PX4) and guided (ArduPilot) flight, and its age."""

import math
from typing import Any

from autopilot_bridge.commander.vehicle_tasks import VehicleTasks


class SetpointStream:
    """Newest streamed setpoint: the tasks that fly it, its time of arrival, its requirements.

    The stream is accepted in every mode, since PX4 enters OFFBOARD only while a stream is running.

    Args:
        vehicle: makes the vehicle's tasks.

    Attributes:
        needs_position: the newest setpoint can't be flown without a position.
    """

    def __init__(self, vehicle: VehicleTasks) -> None:
        self._vehicle = vehicle
        self.needs_position = False
        self._time_us = -1

    @property
    def offboard(self) -> Any:
        """The task that flies setpoints directly (PX4); its class depends on the vehicle."""
        return self._vehicle.offboard

    @property
    def guided(self) -> Any:
        """The task that flies smoothly to targets (ArduPilot); its class depends on the vehicle."""
        return self._vehicle.guided

    def note(self, time_us: int, *, needs_position: bool) -> None:
        """A setpoint was accepted."""
        self._time_us = time_us
        self.needs_position = needs_position

    def age_s(self, time_us: int) -> float:
        """Age of the newest setpoint; infinite when there is none."""
        return (time_us - self._time_us) * 1e-6 if self._time_us >= 0 else math.inf

    @property
    def attitude_setpoints(self) -> bool:
        """The offboard stream commands positions, velocities or attitudes (PX4 shows it in base_mode)."""
        return self._vehicle.asks_attitude

    @property
    def thrust_setpoints(self) -> bool:
        """Guided flight follows attitude setpoints (ArduPilot shows it in base_mode)."""
        return self._vehicle.follows_thrust
