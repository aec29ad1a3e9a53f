"""The geofence towards clients: FENCE_STATUS, DO_FENCE_ENABLE, and the check that a mission stays inside.

Source: ArduPilot 4.6 GCS_Fence; PX4 1.16 MissionFeasibility (checkMissionAgainstGeofence). PX4 has neither
the message nor the command.
"""

import math

from autopilot_bridge.commander import Commander
from autopilot_bridge.commander.events import Event, FenceBreached
from autopilot_bridge.commander.geofence_parameters import ALL_FENCES, FenceType
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import command, streams
from autopilot_bridge.flight.plan_reading import target_of
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.channel import Broadcast, Source, send_to_all
from autopilot_bridge.services.commands.command import Command, whole
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.plans.rules import PLACED_COMMANDS

_OFF, _ON, _FLOOR_OFF = 0, 1, 2  # of DO_FENCE_ENABLE


class ArdupilotGeofence(Microservice):
    """The messages and commands of an ArduPilot geofence.

    Args:
        commander: owns the fence.
        parameters: FENCE_ENABLE.
        broadcast: all channels.
    """

    def __init__(self, commander: Commander, parameters: ParameterStore, broadcast: Broadcast) -> None:
        self._commander = commander
        self._parameters = parameters
        self._broadcast = broadcast

    def follow(self, event: Event) -> None:
        """Send the status at once when the fence is breached."""
        if isinstance(event, FenceBreached):
            values = self._status()
            if values is not None:
                send_to_all(self._broadcast, dialect.MAVLink_fence_status_message(*values))

    @streams(dialect.MAVLink_fence_status_message)
    def _status(self) -> tuple[int, int, int, int, int] | None:
        """FENCE_STATUS (162), while the fence is on."""
        watch = self._commander.fence
        if not watch.enabled(self._commander.parameters.fence):
            return None
        kind = dialect.FENCE_BREACH_NONE
        if FenceType.HEIGHT_MIN in watch.broken:
            kind = dialect.FENCE_BREACH_MINALT
        if FenceType.HEIGHT_MAX in watch.broken:
            kind = dialect.FENCE_BREACH_MAXALT
        if watch.broken & (FenceType.CIRCLE | FenceType.SHAPES):
            kind = dialect.FENCE_BREACH_BOUNDARY
        time_ms = (watch.breach_time_us // 1000) & 0xFFFFFFFF
        return (int(bool(watch.broken)), watch.breaches, kind, time_ms, dialect.FENCE_MITIGATE_NONE)

    @command(dialect.MAV_CMD_DO_FENCE_ENABLE)
    def _enable(self, command: Command, source: Source) -> Result:
        """DO_FENCE_ENABLE: p1 0 off, 1 on, 2 the floor off; p2 FENCE_TYPE bits, 0: all."""
        action, bits = whole(command.p1), whole(command.p2, 0) or 0
        watch, parameters = self._commander.fence, self._commander.parameters.fence
        if action not in (_OFF, _ON, _FLOOR_OFF) or not watch.present(parameters):
            return Result.FAILED
        walls = FenceType(bits & int(ALL_FENCES)) if bits > 0 else ALL_FENCES
        if action == _FLOOR_OFF:
            watch.switch(FenceType.HEIGHT_MIN, on=False)
        elif walls != ALL_FENCES and (action == _OFF or parameters.enabled):
            watch.switch(walls, on=action == _ON)
        else:
            watch.forget_switches()
            if walls != ALL_FENCES:
                watch.switch(ALL_FENCES & ~walls, on=False)
            self._parameters.set("FENCE_ENABLE", action)
        return Result.ACCEPTED


class MissionFence:
    """Checks whether the items of a mission stay inside the geofence (PX4).

    Args:
        commander: owns the fence.
    """

    def __init__(self, commander: Commander) -> None:
        self._commander = commander

    @property
    def state(self) -> object:
        """A value that stays equal as long as the answers stay the same."""
        commander = self._commander
        home = commander.home.position
        return (commander.fence.geofence.version, commander.parameters.fence, home)

    def excludes(self, item: MissionItem) -> bool:
        """True when a position of the item lies outside."""
        commander = self._commander
        context = commander.context
        if item.command not in PLACED_COMMANDS or not math.isfinite(item.x + item.y):
            return False
        place = target_of(item, context)
        if place is None:
            return False
        home_north, home_east, home_down = context.home_ned_m.tolist()
        home = (home_north, home_east, home_down) if math.isfinite(home_north) else None
        north, east, down = place.tolist()
        fence = commander.parameters.fence
        watch = commander.fence.geofence
        return bool(watch.broken((north, east, down), home, context.frame, fence, fence.walls))
