"""Commands for camera and gimbal that clients send to the autopilot, which forwards them.

ArduPilot forwards the commands that its camera and mount libraries support, and acknowledges at once (4.6
AP_Camera, AP_Mount). PX4's gimbal manager and camera trigger do the same for their commands. Clients address
a camera with its own component id directly (PX4 1.16 gimbal, camera_trigger; Commander.cpp leaves these
commands to them, and nothing answers when they do not run). A device counts as present once its heartbeat has
been received.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import command, receives
from autopilot_bridge.flight.parameters import FlightParameters
from autopilot_bridge.flight.region_of_interest import roi_of
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import CAMERA_COMPONENT, GIMBAL_COMPONENT
from autopilot_bridge.mavlink.wire_units import e7
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.services.channel import Source, send_to_all
from autopilot_bridge.services.commands.command import Command, Handler
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts
from autopilot_bridge.services.plans.equipment import GIMBAL_COMMANDS

_CONFIGURE: Final = dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
_NONE: Final = dialect.MAV_CMD_DO_SET_ROI_NONE
_NEXT_WAYPOINT: Final = dialect.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET
_PRESENT_US: Final = 5_000_000
_NO_CLIENT: Final = (0, 0)
_TAKE, _GIVE_UP = -2.0, -3.0

_ROI: Final = frozenset(
    (dialect.MAV_CMD_DO_SET_ROI, dialect.MAV_CMD_DO_SET_ROI_LOCATION, dialect.MAV_CMD_DO_SET_ROI_SYSID, _NONE)
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PayloadPolicy:
    """How a firmware handles commands for its payload.

    Attributes:
        camera: commands that it forwards to a camera.
        absent: its answer while the device is not present; None: no answer.
        nose_modes: modes in which a commanded region of interest turns a multicopter's nose, and whether the
            nose follows during every manoeuvre of the mode (else as the mission defines).
        kinds_of_roi: param1 of DO_SET_ROI is the kind of target, and the next waypoint is a possible target;
            else the target is always a position.
        bad_place: the answer to a region of interest at an invalid position.
    """

    camera: frozenset[int]
    absent: Result | None
    nose_modes: Mapping[FlightMode, bool]
    kinds_of_roi: bool
    bad_place: Result


class PayloadCommands(Microservice):
    """Forwards commands to camera and gimbal.

    Args:
        parts: of the autopilot.
        policy: the firmware's.
    """

    def __init__(self, parts: AutopilotParts, policy: PayloadPolicy) -> None:
        self._parts = parts
        self._policy = policy
        self._received_us: dict[int, int] = {}
        self._in_control: frozenset[tuple[int, int]] = frozenset()

    @property
    def commands(self) -> Mapping[int, Handler]:
        """The forwarded commands. Regions of interest are accepted without a gimbal too."""
        return {
            **super().commands,
            **dict.fromkeys(self._policy.camera, self._to_camera),
            **({_NEXT_WAYPOINT: self._look} if self._policy.kinds_of_roi else {}),
        }

    def _is_own(self, source: Source) -> bool:
        return source.system_id == self._parts.system_id and source.component_id in (
            CAMERA_COMPONENT,
            GIMBAL_COMPONENT,
        )

    @receives(dialect.MAVLink_heartbeat_message)
    def _on_heartbeat(self, message: dialect.MAVLink_heartbeat_message, source: Source, time_us: int) -> None:
        if self._is_own(source):
            self._received_us[source.component_id] = time_us

    @receives(dialect.MAVLink_gimbal_manager_status_message)
    def _on_manager_status(
        self, message: dialect.MAVLink_gimbal_manager_status_message, source: Source, time_us: int
    ) -> None:
        if self._is_own(source):
            primary = (message.primary_control_sysid, message.primary_control_compid)
            secondary = (message.secondary_control_sysid, message.secondary_control_compid)
            self._in_control = frozenset() if primary == _NO_CLIENT else frozenset((primary, secondary))

    def _is_there(self, component: int) -> bool:
        received_us = self._received_us.get(component)
        return received_us is not None and self._parts.commander.time_us - received_us < _PRESENT_US

    def _may_point(self, source: Source) -> bool:
        return not self._in_control or (source.system_id, source.component_id) in self._in_control

    def _to_camera(self, command: Command, source: Source) -> Result | None:
        if not self._is_there(CAMERA_COMPONENT):
            return self._policy.absent
        self._pass_on(CAMERA_COMPONENT, command)
        return Result.ACCEPTED

    @command(*GIMBAL_COMMANDS)
    def _to_gimbal(self, command: Command, source: Source) -> Result | None:
        if not self._is_there(GIMBAL_COMPONENT):
            return self._policy.absent
        if command.id == _CONFIGURE:
            command = self._configured(command, source)
        elif not self._may_point(source):
            return Result.DENIED
        self._pass_on(GIMBAL_COMPONENT, command)
        return Result.ACCEPTED

    @command(*_ROI)
    def _look(self, command: Command, source: Source) -> Result | None:
        item = _roi_item(command, kinds=self._policy.kinds_of_roi)
        if item is not None and not (abs(item.x) <= 90.0 and abs(item.y) <= 180.0):
            return self._policy.bad_place
        if self._is_there(GIMBAL_COMPONENT) and command.id != _NEXT_WAYPOINT:
            if not self._may_point(source):
                return Result.DENIED
            self._pass_on(GIMBAL_COMPONENT, command)
        elif item is not None:
            self._turn_nose(item)
        return Result.ACCEPTED

    def _turn_nose(self, item: MissionItem) -> None:
        commander = self._parts.commander
        context, mode = commander.context, commander.mode
        if not commander.armed or mode not in self._policy.nose_modes:
            return
        if isinstance(context.parameters, FlightParameters) and context.multicopter.nose_follows_roi:
            context.look_at(roi_of(item, context), nose=self._policy.nose_modes[mode])

    def _configured(self, command: Command, source: Source) -> Command:
        """Values -2 and -3 refer to the client itself, not to the autopilot that forwards its command."""
        sender = (source.system_id, source.component_id)
        pairs = [(command.p1, command.p2), (command.p3, command.p4)]
        for index, pair in enumerate(pairs):
            if _TAKE in pair:
                pairs[index] = (float(sender[0]), float(sender[1]))
            elif _GIVE_UP in pair:
                pairs[index] = (0.0, 0.0) if sender in self._in_control else (-1.0, -1.0)
        (p1, p2), (p3, p4) = pairs
        return command._replace(p1=p1, p2=p2, p3=p3, p4=p4)

    def _pass_on(self, component: int, command: Command) -> None:
        send_to_all(self._parts.broadcast, forwarded(command, self._parts.system_id, component))


def _roi_item(command: Command, *, kinds: bool) -> MissionItem | None:
    """A region of interest as a mission item; None: it is not a position (another vehicle).

    0/0 ends it, as in ArduPilot.
    """
    if command.id == dialect.MAV_CMD_DO_SET_ROI_SYSID:
        return None
    by_kind = command.id == dialect.MAV_CMD_DO_SET_ROI and kinds
    kind = command.p1 if by_kind else 0.0
    nowhere = command.x == 0.0 and command.y == 0.0
    placeless = nowhere and command.id == dialect.MAV_CMD_DO_SET_ROI_LOCATION
    number = _NONE if placeless else command.id
    without_place = number in (_NONE, _NEXT_WAYPOINT) or (by_kind and kind != dialect.MAV_ROI_LOCATION)
    return MissionItem(
        command=number,
        frame=dialect.MAV_FRAME_GLOBAL if command.frame is None else command.frame,
        param1=kind,
        param2=command.p2,
        x=0.0 if without_place else command.x,
        y=0.0 if without_place else command.y,
        z=command.z if math.isfinite(command.z) else 0.0,
    )


def forwarded(command: Command, system_id: int, component: int) -> MAVLinkMessage:
    """The message that forwards a command, in the form (LONG or INT) in which it came."""
    first = (command.p1, command.p2, command.p3, command.p4)
    if command.frame is None:
        return dialect.MAVLink_command_long_message(
            system_id, component, command.id, 0, *first, command.x, command.y, command.z
        )
    return dialect.MAVLink_command_int_message(
        system_id,
        component,
        command.frame,
        command.id,
        0,
        0,
        *first,
        _e7(command.x),
        _e7(command.y),
        command.z,
    )


def _e7(degrees: float) -> int:
    scaled = e7(degrees) if math.isfinite(degrees) else 0
    return max(-(2**31), min(2**31 - 1, scaled))
