"""The one timeline of a run: vehicle times of several vehicles, and of several boots, in sequence."""

from typing import Final

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators import wire
from estimators.input_guard import NEW_BOOT_US
from estimators.messages import Message, is_a
from estimators.vehicle_time import TeamTime

__all__ = ["Timeline"]

_BETWEEN_BOOTS_US: Final = 5_000_000


class Timeline:
    """Converts vehicle times to the time of the vehicle whose date was known first (`TeamTime`). A vehicle
    that reboots continues 5 s after its newest time.

    Attributes:
        newest_us: newest time of any vehicle.
    """

    def __init__(self) -> None:
        self.newest_us = 0
        self._team_time = TeamTime()
        self._newest_us: dict[int, int] = {}
        self._shift_us: dict[int, int] = {}

    def take(self, time_us: int, message: Message) -> int:
        """The time of a message at a vehicle time, which is learnt from as well."""
        system_id = message.src_system
        if message.src_component == AUTOPILOT_COMPONENT:
            newest_us = self._newest_us.get(system_id, time_us)
            if time_us < newest_us - NEW_BOOT_US:
                ended_us = newest_us + self._shift_us.get(system_id, 0)
                self._shift_us[system_id] = ended_us + _BETWEEN_BOOTS_US - time_us
                self._newest_us[system_id] = time_us
            elif time_us >= newest_us:
                self._newest_us[system_id] = time_us
            if is_a(message, wire.SYSTEM_TIME):
                self._team_time.learn(time_us + self._shift_us.get(system_id, 0), message)
            common_us = self.common_us(time_us, system_id)
            self.newest_us = max(self.newest_us, common_us)
            return common_us
        return self.common_us(time_us, system_id)

    def common_us(self, time_us: int, system_id: int) -> int:
        """The time of the run at a vehicle's time; of a system that is no vehicle, its own."""
        shifted_us = time_us + self._shift_us.get(system_id, 0)
        return self._team_time.common_us(shifted_us, system_id)
