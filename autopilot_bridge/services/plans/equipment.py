"""Mission items that are not flown: commands for camera and gimbal, or for the autopilot itself.

Items for a camera (component 100) or a gimbal (154) are sent to the device as a command, as PX4 passes its
vehicle commands on; all other items are executed like a COMMAND_LONG. Sources: PX4 1.16
navigator/mission_block (issue_command), ArduPilot 4.6 AP_Mission_Commands, gimbal protocol v2.
"""

import math
from typing import Final

from autopilot_bridge.commander.events import Event, ItemCommanded, ModeChanged
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.flight.plan_reading import is_waypoint
from autopilot_bridge.flight.region_of_interest import ROI_COMMANDS
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, CAMERA_COMPONENT, GIMBAL_COMPONENT
from autopilot_bridge.mavlink.wire_units import e7
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.mission_wire import TERRAIN_FRAMES, UNSET_INT, is_geodetic
from autopilot_bridge.services.channel import send_to_all
from autopilot_bridge.services.commands.command import Command
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

CAMERA_COMMANDS: Final = frozenset(
    (
        dialect.MAV_CMD_DO_TRIGGER_CONTROL,
        dialect.MAV_CMD_DO_DIGICAM_CONFIGURE,
        dialect.MAV_CMD_DO_DIGICAM_CONTROL,
        dialect.MAV_CMD_DO_CONTROL_VIDEO,
        dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
        dialect.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL,
        dialect.MAV_CMD_SET_CAMERA_MODE,
        dialect.MAV_CMD_SET_CAMERA_ZOOM,
        dialect.MAV_CMD_SET_CAMERA_FOCUS,
        dialect.MAV_CMD_SET_CAMERA_SOURCE,
        dialect.MAV_CMD_IMAGE_START_CAPTURE,
        dialect.MAV_CMD_IMAGE_STOP_CAPTURE,
        dialect.MAV_CMD_VIDEO_START_CAPTURE,
        dialect.MAV_CMD_VIDEO_STOP_CAPTURE,
    )
)
MOUNT_COMMANDS: Final = frozenset((dialect.MAV_CMD_DO_MOUNT_CONTROL, dialect.MAV_CMD_DO_MOUNT_CONFIGURE))
GIMBAL_COMMANDS: Final = frozenset(
    (*MOUNT_COMMANDS, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE)
)
_CONFIGURE: Final = dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
_POINT: Final = dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
_KEEP, _GIVE_UP = -1.0, -3.0  # of DO_GIMBAL_MANAGER_CONFIGURE
_MODE_FLAGS: Final = {
    dialect.MAV_MOUNT_MODE_RETRACT: dialect.GIMBAL_MANAGER_FLAGS_RETRACT,
    dialect.MAV_MOUNT_MODE_NEUTRAL: dialect.GIMBAL_MANAGER_FLAGS_NEUTRAL,
}
_LEVEL: Final = dialect.GIMBAL_MANAGER_FLAGS_ROLL_LOCK | dialect.GIMBAL_MANAGER_FLAGS_PITCH_LOCK


class MissionEquipment(Microservice):
    """Sends mission items to the devices that execute them.

    Args:
        parts: of the autopilot.
    """

    def __init__(self, parts: AutopilotParts) -> None:
        self._parts = parts
        self._missions = parts.stores[MissionType.MISSION]
        self._in_control = False

    def follow(self, event: Event) -> None:
        """An item is due, or the mission mode was left."""
        match event:
            case ItemCommanded(index=index) if 0 <= index < len(self._missions.items):
                self._carry_out(index, self._missions.items[index])
            case ModeChanged(previous=FlightMode.MISSION) if self._in_control:
                self._in_control = False
                self._command_gimbal(_CONFIGURE, _GIVE_UP, _GIVE_UP, _KEEP, _KEEP)

    def _carry_out(self, index: int, item: MissionItem) -> None:
        if item.command in CAMERA_COMMANDS:
            self._command(CAMERA_COMPONENT, item.command, *_parameters(item))
        elif item.command in GIMBAL_COMMANDS:
            self._take_control()
            if item.command in MOUNT_COMMANDS:
                self._point_mount(item)
            else:
                self._command_gimbal(item.command, *_parameters(item))
        elif item.command in ROI_COMMANDS:
            self._take_control()
            self._look(index, item)
        elif self._parts.execute is not None:
            self._parts.execute(_command(item))

    # gimbal

    def _take_control(self) -> None:
        """The mission takes control of the gimbal from any client (PX4's acquire_gimbal_control)."""
        if not self._in_control:
            self._in_control = True
            self._command_gimbal(
                _CONFIGURE, float(self._parts.system_id), float(AUTOPILOT_COMPONENT), _KEEP, _KEEP
            )

    def _point_mount(self, item: MissionItem) -> None:
        """Convert DO_MOUNT_CONTROL, DO_MOUNT_CONFIGURE of gimbal protocol v1 to v2."""
        configures = item.command == dialect.MAV_CMD_DO_MOUNT_CONFIGURE
        value = item.param1 if configures else item.z
        mode = round(value) if math.isfinite(value) else -1
        flags = _MODE_FLAGS.get(mode)
        if flags is not None:
            self._command_gimbal(_POINT, math.nan, math.nan, math.nan, math.nan, float(flags), 0.0, 0.0)
        elif mode == dialect.MAV_MOUNT_MODE_MAVLINK_TARGETING and not configures:
            pitch, yaw = item.param1, item.param3
            self._command_gimbal(_POINT, pitch, yaw, math.nan, math.nan, float(_LEVEL), 0.0, 0.0)

    def _look(self, index: int, item: MissionItem) -> None:
        """Set a region of interest (a position on Earth), or end it."""
        place = self._place_of(index, item)
        if place is None:
            self._command_gimbal(dialect.MAV_CMD_DO_SET_ROI_NONE)
            return
        frame = place.frame
        if frame in TERRAIN_FRAMES:  # the ground is assumed level with home
            frame = dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
        message = dialect.MAVLink_command_int_message(
            self._parts.system_id,
            GIMBAL_COMPONENT,
            frame,
            dialect.MAV_CMD_DO_SET_ROI_LOCATION,
            0,
            0,
            0.0,
            0.0,
            0.0,
            0.0,
            _degrees_e7(place.x),
            _degrees_e7(place.y),
            place.z,
        )
        send_to_all(self._parts.broadcast, message)

    def _place_of(self, index: int, item: MissionItem) -> MissionItem | None:
        """The item with the position of the region of interest; None: no region of interest."""
        items = self._missions.items
        by_kind = item.command in (dialect.MAV_CMD_DO_SET_ROI, dialect.MAV_CMD_NAV_ROI)
        kind = round(item.param1) if by_kind and math.isfinite(item.param1) else 0
        if item.command == dialect.MAV_CMD_DO_SET_ROI_NONE:
            return None
        if item.command == dialect.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET or kind == dialect.MAV_ROI_WPNEXT:
            return next((later for later in items[index + 1 :] if is_waypoint(later)), None)
        if kind == dialect.MAV_ROI_WPINDEX:
            number = round(item.param2) if math.isfinite(item.param2) else -1
            return items[number] if 0 <= number < len(items) and is_waypoint(items[number]) else None
        placed = is_geodetic(item) and not (item.x == 0.0 and item.y == 0.0)
        return item if placed else None

    # sending

    def _command_gimbal(self, command: int, *parameters: float) -> None:
        self._command(GIMBAL_COMPONENT, command, *parameters)

    def _command(self, component: int, command: int, *parameters: float) -> None:
        values = (*parameters, *(0.0,) * (7 - len(parameters)))
        message: MAVLinkMessage = dialect.MAVLink_command_long_message(
            self._parts.system_id, component, command, 0, *values
        )
        send_to_all(self._parts.broadcast, message)


def _parameters(item: MissionItem) -> tuple[float, ...]:
    return (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)


def _command(item: MissionItem) -> Command:
    frame = item.frame if is_geodetic(item) else None
    p1, p2, p3, p4, x, y, z = _parameters(item)
    return Command(item.command, p1, p2, p3, p4, x, y, z, frame)


def _degrees_e7(degrees: float) -> int:
    return e7(degrees) if math.isfinite(degrees) else UNSET_INT
