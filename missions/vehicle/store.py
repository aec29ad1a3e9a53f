"""The data that a vehicle stores for a mission: plans and parameters."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionType
from missions.errors import MissionError, VehicleTimeout
from missions.vehicle import mission_transfer, parameter_client
from missions.vehicle.adapter import Mode
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.connection import AUTOPILOT_COMPONENT
from missions.vehicle.item_tracker import (
    FlownOrder,
    ItemTracker,
    MissionModeWatch,
    MissionStep,
    mission_steps,
)

_REWINDS: Final = 4
_REWIND_S: Final = 1.5
_ACCEPTANCE_M: Final = 2.0
"""Distance at which a position shows that a waypoint was passed, if the waypoint specifies none."""


class VehicleStore(VehicleCommands):
    """The part of a vehicle for stored data: plans are uploaded and followed, parameters read and set."""

    _tracker: ItemTracker | None = None  # tracker of the mission that was uploaded last

    # missions

    async def upload_mission(self, items: Sequence[MissionItem]) -> int:
        """Upload a plan; returns the sequence number of its first item on the link (1 for ArduPilot, whose
        item 0 is home).

        The flight starts at its first item. Jumps name items by their index in `items`.
        """
        first = 1 if self.adapter.first_mission_item_is_home else 0
        home = self.home
        marker = MissionItem(
            command=dialect.MAV_CMD_NAV_WAYPOINT, frame=0, x=home.lat_deg, y=home.lon_deg, z=home.alt_m
        )
        own = mission_transfer.renumbered(items, first)
        await mission_transfer.upload(self, [marker, *own] if first else own, before=first)
        await self.rewind_mission()
        order = FlownOrder.of(items)
        steps = mission_steps(items, order, home, _ACCEPTANCE_M)
        self._tracker = ItemTracker(steps, order.again_from, first=first)
        return first

    async def rewind_mission(self) -> None:
        """Set the stored mission to its first item, because it may be at the end of its last flight.

        If the vehicle does not confirm it (MISSION_CURRENT), the notes get a warning.
        """
        first = 1 if self.adapter.first_mission_item_is_home else 0
        with self.messages("MISSION_CURRENT") as stream:
            for _ in range(_REWINDS):
                self.send(dialect.MAVLink_mission_set_current_message(self.system_id, AUTOPILOT_COMPONENT, 0))
                try:
                    async with self.deadline(_REWIND_S, "the mission's first item"):
                        while (await anext(stream)).seq > first:
                            pass
                        return
                except TimeoutError:
                    continue
        self.notes.warn("the vehicle did not confirm (MISSION_CURRENT) that its mission begins anew")

    async def upload_plan(self, mission_type: MissionType, items: Sequence[MissionItem]) -> None:
        """Upload a geofence or rally points, which replace those on the vehicle."""
        await mission_transfer.upload(self, items, mission_type)

    async def download_plan(self, mission_type: MissionType) -> list[MissionItem]:
        """Download the geofence or the rally points from the vehicle."""
        return await mission_transfer.download(self, mission_type)

    async def download_mission(self) -> list[MissionItem]:
        """Download the plan from the vehicle (without ArduPilot's home item)."""
        items = await mission_transfer.download(self)
        if not self.adapter.first_mission_item_is_home:
            return items
        return mission_transfer.renumbered(items[1:], -1)

    async def clear_mission(self) -> None:
        """Delete the plan on the vehicle."""
        await mission_transfer.clear(self)

    async def wait_item_reached(
        self, sequence: int, timeout_s: float, progress: Callable[[int], None] | None = None
    ) -> None:
        """Wait until the mission has reached item `sequence` (sequence number on the link) or a later one.

        The evidence is MISSION_ITEM_REACHED, MISSION_CURRENT and positions; see `ItemTracker`.

        Args:
            progress: called with the number of each reached item.

        Raises:
            MissionError: the vehicle left the mission before that.
        """
        tracker = self._tracker or ItemTracker([MissionStep(index=k) for k in range(sequence + 1)])
        mode = MissionModeWatch(self.adapter.modes[Mode.MISSION])
        wanted = tracker.place_of(sequence - tracker.first)
        told = 0

        def there() -> bool:
            nonlocal told
            for index, _ in tracker.reached[told:]:
                if progress is not None:
                    progress(tracker.first + index)
            told = len(tracker.reached)
            return tracker.behind > wanted

        names = ("MISSION_ITEM_REACHED", "MISSION_CURRENT", "GLOBAL_POSITION_INT", "HEARTBEAT")
        with self.messages(*names) as stream:
            try:
                async with self.deadline(timeout_s, f"mission item {sequence}"):
                    while not there():
                        message = await anext(stream)
                        if message.get_type() == "HEARTBEAT":
                            if mode.left(message.custom_mode) and not tracker.at_the_last_place:
                                name = self.adapter.mode_name(message.custom_mode)
                                raise MissionError(
                                    f"the vehicle left the mission for mode {name} "
                                    f"before item {sequence}; {self.heard()}"
                                )
                        else:
                            tracker.on_message(message, self.clock.stamp_us)
            except TimeoutError:
                raise VehicleTimeout(
                    f"mission item {sequence} was not reached within {timeout_s:g} s; {self.heard()}"
                ) from None

    # parameters

    async def parameter(self, name: str) -> float:
        """Read a parameter."""
        value, _ = await parameter_client.read(self, name)
        return value

    async def parameter_or(self, name: str, default: float) -> float:
        """Read a parameter; returns `default` when the vehicle doesn't answer."""
        try:
            return await self.parameter(name)
        except VehicleTimeout:
            return default

    async def set_parameter(self, name: str, value: float) -> None:
        """Set a parameter and wait for the confirmation."""
        await parameter_client.write(self, name, value)

    async def set_parameters(self, values: Mapping[str, float]) -> None:
        """Set several parameters in order."""
        for name, value in values.items():
            await self.set_parameter(name, value)
