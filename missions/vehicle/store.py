"""What a vehicle keeps for a mission: plans and parameters."""

from collections.abc import Callable, Mapping, Sequence

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem, MissionType
from missions.errors import MissionError, VehicleTimeout
from missions.vehicle import mission_transfer, parameter_client
from missions.vehicle.adapter import Mode
from missions.vehicle.commands import VehicleCommands


class VehicleStore(VehicleCommands):
    """The storing half of a vehicle: plans are uploaded, followed and fetched, parameters read and set."""

    # missions

    async def upload_mission(self, items: Sequence[MissionItem]) -> int:
        """Upload a plan; gives the wire number of its first item (1 for ArduPilot, whose item 0 is home).

        Jumps name items by their index in `items`.
        """
        first = 1 if self.adapter.first_mission_item_is_home else 0
        home = self.home
        marker = MissionItem(
            command=dialect.MAV_CMD_NAV_WAYPOINT, frame=0, x=home.lat_deg, y=home.lon_deg, z=home.alt_m
        )
        own = mission_transfer.renumbered(items, first)
        await mission_transfer.upload(self, [marker, *own] if first else own, before=first)
        return first

    async def upload_plan(self, mission_type: MissionType, items: Sequence[MissionItem]) -> None:
        """Upload a geofence or rally points in place of those the vehicle has."""
        await mission_transfer.upload(self, items, mission_type)

    async def download_plan(self, mission_type: MissionType) -> list[MissionItem]:
        """The geofence or the rally points the vehicle holds."""
        return await mission_transfer.download(self, mission_type)

    async def download_mission(self) -> list[MissionItem]:
        """The plan the vehicle holds (without ArduPilot's home item)."""
        items = await mission_transfer.download(self)
        if not self.adapter.first_mission_item_is_home:
            return items
        return mission_transfer.renumbered(items[1:], -1)

    async def clear_mission(self) -> None:
        """Delete the plan the vehicle holds."""
        await mission_transfer.clear(self)

    async def wait_item_reached(
        self, sequence: int, timeout_s: float, progress: Callable[[int], None] | None = None
    ) -> None:
        """Wait until the mission has reached item `sequence` (wire number) or gone beyond.

        Args:
            progress: called with the number of each item reached.

        Raises:
            MissionError: the vehicle left the mission before.
        """
        mission_mode = self.adapter.modes[Mode.MISSION]
        with self.messages("MISSION_ITEM_REACHED", "MISSION_CURRENT", "HEARTBEAT") as stream:
            try:
                async with self.deadline(timeout_s, f"mission item {sequence}"):
                    async for m in stream:
                        kind = m.get_type()
                        if kind == "HEARTBEAT":
                            if m.custom_mode != mission_mode:
                                name = self.adapter.mode_name(m.custom_mode)
                                raise MissionError(
                                    f"the vehicle left the mission for mode {name} "
                                    f"before item {sequence}; {self.heard()}"
                                )
                            continue
                        done = m.seq if kind == "MISSION_ITEM_REACHED" else m.seq - 1
                        if progress is not None:
                            progress(done)
                        if done >= sequence:
                            return
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
        """Read a parameter, or `default` when the vehicle doesn't answer for it."""
        try:
            return await self.parameter(name)
        except VehicleTimeout:
            return default

    async def set_parameter(self, name: str, value: float) -> None:
        """Set a parameter and see it confirmed."""
        await parameter_client.write(self, name, value)

    async def set_parameters(self, values: Mapping[str, float]) -> None:
        """Set several parameters in order."""
        for name, value in values.items():
            await self.set_parameter(name, value)
