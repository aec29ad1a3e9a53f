"""The plans that a vehicle stores (mission, geofence, rally points), and the progress of its mission."""

from collections.abc import Callable, Sequence
from typing import Final

from autopilot_bridge.mavlink import Frame, decode, definition, dialect, field_reader
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import place
from autopilot_bridge.mission_plan import MissionItem, MissionType
from missions.errors import MissionError, VehicleTimeout
from missions.vehicle.firmware import Mode
from missions.vehicle.heights import HeightRule, refuse_low_items
from missions.vehicle.item_tracker import (
    FlownOrder,
    ItemTracker,
    MissionModeWatch,
    MissionStep,
    mission_steps,
)
from missions.vehicle.link import VehicleLink
from missions.vehicle.mission_rules import refuse_infeasible
from missions.vehicle.mission_transfer import clear, download, in_mission_frame, renumbered, upload
from missions.vehicle.mode_tasks import LANDING_PARTS, StoredPlan
from missions.vehicle.parameters import VehicleParameters

_REWINDS: Final = 4
_REWIND_S: Final = 1.5
_ACCEPTANCE_M: Final = 2.0
"""Distance at which a position shows that a waypoint was passed, if the waypoint specifies none."""
_POSITION: Final = definition("GLOBAL_POSITION_INT").message_id
_read_position: Final = field_reader("GLOBAL_POSITION_INT", "lat", "lon", "alt")


class VehiclePlans:
    """The plans of one vehicle: they are uploaded, downloaded and followed.

    Args:
        link: messages of the vehicle.
        parameters: its parameters.
        heights: whether items below home may be uploaded.
    """

    def __init__(self, link: VehicleLink, parameters: VehicleParameters, heights: HeightRule) -> None:
        self._link = link
        self._parameters = parameters
        self._heights = heights
        self._tracker: ItemTracker | None = None  # tracker of the mission that was uploaded last

    async def upload_mission(
        self,
        items: Sequence[MissionItem],
        *,
        fence: Sequence[MissionItem] = (),
        rally: Sequence[MissionItem] = (),
    ) -> int:
        """Upload a plan; returns the sequence number of its first item on the link (1 for ArduPilot, whose
        item 0 is home).

        The flight starts at its first item. Jumps name items by their index in `items`.

        Args:
            items: the mission.
            fence, rally: geofence and rally points that replace those on the vehicle; empty: it keeps its
                own.

        Raises:
            PlanError: an item is below home, which is not allowed (`Vehicle.allow_below_home`), or below the
                ground, or the vehicle would not fly the mission (`mission_rules`); nothing was sent.
            CommandRejected, VehicleTimeout: see `upload`.
        """
        first = 1 if self._link.firmware.first_mission_item_is_home else 0
        home = self._link.home
        refuse_low_items(items, home.alt_m, below_home_allowed=self._heights.below_home_allowed)
        await self.refuse_infeasible(items, fence)
        if fence:
            await upload(self._link, fence, MissionType.FENCE)
        if rally:
            await upload(self._link, rally, MissionType.RALLY)
        marker = MissionItem(
            command=dialect.MAV_CMD_NAV_WAYPOINT, frame=0, x=home.lat_deg, y=home.lon_deg, z=home.alt_m
        )
        own = renumbered(items, first)
        if self._link.firmware.placeless_in_mission_frame:
            own = in_mission_frame(own)
        await upload(self._link, [marker, *own] if first else own, before=first)
        await self.rewind_mission()
        self._tracker = self.note_stored(items, first).tracker()
        return first

    async def refuse_infeasible(
        self, items: Sequence[MissionItem], fence: Sequence[MissionItem] = ()
    ) -> None:
        """Raise PlanError for a mission that the vehicle would store and then not fly (`mission_rules`)."""
        await refuse_infeasible(self._link, self._parameters, items, fence)

    def note_stored(self, items: Sequence[MissionItem], first: int) -> StoredPlan:
        """Note the uploaded plan, so that a mode at its end is distinguished from a pilot's.

        Args:
            items: items of the plan.
            first: sequence number of the first of them on the link.
        """
        order = FlownOrder.of(items)
        steps = mission_steps(items, order, self._link.home, _ACCEPTANCE_M)
        plan = StoredPlan(
            steps=steps,
            again_from=order.again_from,
            first=first,
            landing=next((first + k for k, i in enumerate(items) if i.command in LANDING_PARTS), None),
        )
        self._link.tasks.plan = plan
        return plan

    async def rewind_mission(self) -> None:
        """Set the stored mission to its first item, because it may be at the end of its last flight.

        If the vehicle does not confirm it (MISSION_CURRENT), the notes get a warning.
        """
        first = 1 if self._link.firmware.first_mission_item_is_home else 0
        with self._link.messages(dialect.MAVLink_mission_current_message) as stream:
            for _ in range(_REWINDS):
                self._link.send(
                    dialect.MAVLink_mission_set_current_message(self._link.system_id, AUTOPILOT_COMPONENT, 0)
                )
                try:
                    async with self._link.deadline(_REWIND_S, "the mission's first item"):
                        while (await anext(stream)).seq > first:
                            pass
                        return
                except TimeoutError:
                    continue
        self._link.notes.warn("the vehicle did not confirm (MISSION_CURRENT) that its mission begins anew")

    async def upload_plan(self, mission_type: MissionType, items: Sequence[MissionItem]) -> None:
        """Upload a geofence or rally points, which replace those on the vehicle."""
        await upload(self._link, items, mission_type)

    async def download_plan(self, mission_type: MissionType) -> list[MissionItem]:
        """Download the geofence or the rally points from the vehicle."""
        return await download(self._link, mission_type)

    async def download_mission(self) -> list[MissionItem]:
        """Download the plan from the vehicle (without ArduPilot's home item)."""
        items = await download(self._link)
        if not self._link.firmware.first_mission_item_is_home:
            return items
        return renumbered(items[1:], -1)

    async def clear_mission(self) -> None:
        """Delete the plan on the vehicle."""
        await clear(self._link)

    async def wait_item_reached(
        self, sequence: int, timeout_s: float, progress: Callable[[int], None] | None = None
    ) -> None:
        """Wait until the mission has reached item `sequence` (sequence number on the link) or a later one.

        The evidence is MISSION_ITEM_REACHED, MISSION_CURRENT and positions; see `ItemTracker`.

        Args:
            progress: called with the number of each reached item.

        Raises:
            MissionError: the vehicle left the mission before that, or disarmed.
        """
        tracker = self._tracker or ItemTracker([MissionStep(index=k) for k in range(sequence + 1)])
        mode = MissionModeWatch(self._link.firmware.modes[Mode.MISSION])
        wanted = tracker.place_of(sequence - tracker.first)
        flying = self._link.armed
        reported = 0

        def there() -> bool:
            nonlocal reported
            while reported < len(tracker.reached):
                index, _ = tracker.reached[reported]
                reported += 1
                if progress is not None:
                    progress(tracker.first + index)
            return tracker.behind > wanted

        def handle(frame: Frame) -> bool:
            nonlocal flying
            if frame.message_id == _POSITION:
                at = place(*_read_position(frame))
                if at is not None:
                    tracker.on_position(at.lat_deg, at.lon_deg, at.alt_m, self._link.clock.stamp_us)
                return there()
            message = decode(frame)
            if not isinstance(message, dialect.MAVLink_heartbeat_message):
                tracker.on_message(message, self._link.clock.stamp_us)
                return there()
            if flying:
                self._link.require_armed(f"before item {sequence}")
            flying = self._link.armed
            if mode.left(message.custom_mode) and not tracker.at_the_last_place:
                name = self._link.firmware.mode_name(message.custom_mode)
                raise MissionError(
                    f"the vehicle left the mission for mode {name} before item {sequence}; "
                    f"{self._link.last_received()}"
                )
            return there()

        if there():
            return
        names = ("MISSION_ITEM_REACHED", "MISSION_CURRENT", "GLOBAL_POSITION_INT", "HEARTBEAT")
        try:
            async with self._link.deadline(timeout_s, f"mission item {sequence}"):
                await self._link.follow(handle, on=names)
        except TimeoutError:
            raise VehicleTimeout(
                f"mission item {sequence} was not reached within {timeout_s:g} s; "
                f"{self._link.last_received()}"
            ) from None
