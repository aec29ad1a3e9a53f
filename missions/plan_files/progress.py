"""Progress of a vehicle in an uploaded mission file, and detection of the mission's end."""

from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from missions.errors import MissionError, VehicleTimeout
from missions.plan_files.document import MissionDocument
from missions.plan_files.route import Stop, has_curves, placed
from missions.vehicle.firmware import Mode
from missions.vehicle.item_tracker import FlownOrder, ItemTracker, MissionModeWatch, mission_steps
from missions.vehicle.notes import PATTERN
from missions.vehicle.vehicle import Vehicle

CURVED: Final = "mission"
"""Name of the phase of a mission whose path is not only straight lines. Such a phase is not scored."""

_MESSAGES: Final = (
    dialect.MAVLink_mission_item_reached_message,
    dialect.MAVLink_mission_current_message,
    dialect.MAVLink_heartbeat_message,
    dialect.MAVLink_global_position_int_message,
)


class MissionWatch:
    """Follows a mission from its start to its end, and notes the reached items and the phases.

    Args:
        vehicle: the vehicle that flies it.
        document: the flown mission file.
        scored: places with which the track is compared.
        first: sequence number of the mission's first item on the link.
        acceptance_m: radius within which a waypoint counts as reached.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        document: MissionDocument,
        scored: tuple[Stop, ...],
        first: int,
        acceptance_m: float,
    ) -> None:
        self._vehicle, self._document = vehicle, document
        order = FlownOrder.of(document.items)
        items = placed(document.items, vehicle.home, 0.0)
        self._tracker = ItemTracker(
            mission_steps(items, order, vehicle.home, acceptance_m), order.again_from, first=first
        )
        self._endless = order.endless
        self._scored_from = scored[0].index if scored else -1
        self._phase = CURVED if has_curves(scored) else PATTERN
        self._mode = MissionModeWatch(vehicle.firmware.modes[Mode.MISSION])

    @property
    def lands(self) -> bool:
        """Whether the mission ends on the ground."""
        return self._tracker.lands

    async def until_the_end(self, limit_s: float) -> None:
        """Wait for the end of the mission: the last place or, if the mission lands, the ground.

        Raises:
            MissionError: the vehicle left the mission.
            VehicleTimeout: the mission took too long.
        """
        vehicle = self._vehicle
        with vehicle.link.messages(*_MESSAGES) as stream:
            try:
                async with vehicle.link.deadline(limit_s, self._awaited):
                    while not self._take(await anext(stream)):
                        pass
            except TimeoutError:
                raise VehicleTimeout(
                    f"no {self._awaited()} within {limit_s:.0f} s; {vehicle.link.last_received()}"
                ) from None

    def _awaited(self) -> str:
        return f"end of the mission ({self._here()} of {len(self._document.items)})"

    def _here(self) -> str:
        return self._document.item_name(self._tracker.current)

    @property
    def _flown(self) -> bool:
        if self._endless:
            return False
        return self._tracker.coming_down if self.lands else self._tracker.over

    def _take(self, message: MAVLinkMessage) -> bool:
        """Process one message; returns True at the end of the mission."""
        if isinstance(message, dialect.MAVLink_heartbeat_message):
            return self._heartbeat(message)
        self._tracker.on_message(message, self._vehicle.clock.stamp_us)
        self._note()
        return self._flown and not self.lands

    def _note(self) -> None:
        """Note the items that were reached since the last call."""
        notes = self._vehicle.notes
        for index, time_us in self._tracker.reached[len(notes.reached) :]:
            notes.reached.append((index, time_us))
            notes.progress = max(notes.progress, min(1.0, (index + 1) / len(self._document.items)))
            if index == self._scored_from and notes.current == "takeoff":
                notes.begin(self._phase, time_us)
        if self._flown and notes.current == self._phase:
            notes.begin("return", self._vehicle.clock.stamp_us)

    def _heartbeat(self, message: dialect.MAVLink_heartbeat_message) -> bool:
        vehicle, tracker = self._vehicle, self._tracker
        modes = vehicle.firmware.modes
        if not vehicle.armed and not vehicle.commands.may_be_armed:
            if self._flown and self.lands:
                return True
            raise MissionError(f"the vehicle disarmed at {self._here()}; {vehicle.link.last_received()}")
        if message.custom_mode == modes[Mode.RETURN] and self._flown and self.lands:
            return True  # the mission's own return
        if self._flown and self.lands and vehicle.link.landed_state == dialect.MAV_LANDED_STATE_ON_GROUND:
            return False  # PX4 holds after the touch-down, and disarms later
        if not self._mode.left(message.custom_mode):
            return False
        # After the last item PX4 holds and ArduPilot's plane returns; a return may be the last item.
        ended = (modes[Mode.RETURN],) if self.lands else (modes[Mode.HOLD], modes[Mode.RETURN])
        if message.custom_mode in ended and tracker.at_the_last_place:
            return True
        mode = vehicle.firmware.mode_name(message.custom_mode)
        raise MissionError(
            f"the vehicle left the mission for mode {mode} at {self._here()}; {vehicle.link.last_received()}"
        )
