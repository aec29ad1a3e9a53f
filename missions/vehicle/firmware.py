"""The conventions of an autopilot's firmware for one class of vehicle, as far as they are plain data."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import FrameAt, GeodeticPosition
from missions.kind import VehicleKind
from missions.vehicle.limits import Limits


class Mode(StrEnum):
    """Flight modes that a mission commands, named by the vehicle's behaviour."""

    HOLD = "hold"
    TAKEOFF = "takeoff"
    GUIDED = "guided"
    MISSION = "mission"
    RETURN = "return"
    LAND = "land"
    POSITION = "position"


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeCommand:
    """Parameters of MAV_CMD_DO_SET_MODE after the base mode."""

    main: float
    sub: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Firmware:
    """The conventions of one firmware for one class of vehicle; see `missions.vehicle.firmware_records`.

    Attributes:
        name: "px4" or "ardupilot".
        kind: class of vehicle.
        modes: HEARTBEAT.custom_mode of each mode.
        mode_names: the firmware's own name of each custom mode.
        sub_modes: whether a custom mode has a main mode in bits 16 to 23 and a sub mode in bits 24 to 31
            (PX4).
        stream_rates_hz: rates of the telemetry that a mission needs.
        bytewise_parameters: whether integers are sent as bit patterns in PARAM_VALUE (PX4), not as numbers.
        setpoints_before_guided: whether setpoints must be streamed before the guided mode can be entered.
        first_mission_item_is_home: whether item 0 of a mission is always home, regardless of the uploaded
            item.
        goto_mode: the mode after DO_REPOSITION.
        left_before_arming: custom modes in which a vehicle can't be armed, or flies off when it is.
        modes_of_command: custom modes that the vehicle enters for a command, by MAV_CMD; without DO_SET_MODE.
        modes_instead: custom modes that the autopilot may enter in place of a commanded one, by that mode.
        modes_following: custom modes that the autopilot enters by itself when a custom mode has done its
            task, by that mode.
        failsafe_status_acts: whether MAV_STATE_CRITICAL says that a failsafe flies the vehicle (PX4), not
            only that one was triggered (ArduPilot).
        resting_mode: a mode in which the vehicle may stand on the ground and be armed.
        altitude_radius: name and default of the parameter with the distance at which the altitude of a
            take-off is reached, and another mode follows; None: none follows (ArduPilot).
        placeless_in_mission_frame: whether items without a place are accepted in MAV_FRAME_MISSION only
            (PX4).
        unwrapped_fences: whether longitudes of fence polygons are compared without wrap, so that none may lie
            across 180 degrees (PX4).
        frame_at: the kind of the autopilot's local frame.
        unset: value of a command or item parameter that is not set.
        system_id_parameter: name of the parameter that sets the vehicle's system id.
        roll_alone: whether a roll command in the guided mode may leave pitch and throttle to the autopilot.
        takeoff_pitch_deg: lowest pitch of a takeoff item.
        limiting_parameters: the parameters that limit a planner, with the firmware's defaults.
        limits_from: the limits from the values of all limiting parameters.
    """

    name: str
    kind: VehicleKind
    modes: Mapping[Mode, int]
    mode_names: Mapping[int, str]
    sub_modes: bool
    modes_of_command: Mapping[int, tuple[int, ...]]
    modes_instead: Mapping[int, tuple[int, ...]]
    modes_following: Mapping[int, tuple[int, ...]]
    failsafe_status_acts: bool
    stream_rates_hz: Mapping[str, float]
    bytewise_parameters: bool
    setpoints_before_guided: bool
    first_mission_item_is_home: bool
    goto_mode: Mode
    left_before_arming: frozenset[int]
    resting_mode: Mode
    altitude_radius: tuple[str, float] | None = None
    placeless_in_mission_frame: bool
    unwrapped_fences: bool
    frame_at: FrameAt
    unset: float
    system_id_parameter: str
    roll_alone: bool = False
    takeoff_pitch_deg: float = 0.0
    limiting_parameters: Mapping[str, float]
    limits_from: Callable[[Mapping[str, float]], Limits]

    def mode_name(self, custom_mode: int) -> str:
        """The firmware's own name of a mode."""
        main, sub = custom_mode >> 16 & 0xFF, custom_mode >> 24
        if not self.sub_modes:
            return self.mode_names.get(custom_mode, f"mode {custom_mode}")
        return self.mode_names.get(main << 16 | sub << 24, f"mode {main}.{sub}")

    def mode_command(self, mode: Mode) -> ModeCommand:
        """The parameters of DO_SET_MODE for a mode."""
        custom_mode = self.modes[mode]
        if not self.sub_modes:
            return ModeCommand(main=custom_mode)
        return ModeCommand(main=custom_mode >> 16 & 0xFF, sub=custom_mode >> 24)

    def mode_commanded(self, command: ModeCommand) -> int:
        """The custom mode that DO_SET_MODE commands: the inverse of `mode_command`."""
        if not self.sub_modes:
            return int(command.main)
        return int(command.main) << 16 | int(command.sub) << 24

    def limits(self, parameters: Mapping[str, float]) -> Limits:
        """The limits for a planner.

        Args:
            parameters: those named in `limiting_parameters`; a missing one has the firmware's default.
        """
        return self.limits_from({**self.limiting_parameters, **parameters})

    def takeoff_item(self, home: GeodeticPosition, altitude_m: float) -> MissionItem:
        """The first item of a mission that begins on the ground."""
        return MissionItem(
            command=dialect.MAV_CMD_NAV_TAKEOFF,
            param1=self.takeoff_pitch_deg,
            param4=self.unset,
            x=home.lat_deg,
            y=home.lon_deg,
            z=altitude_m,
        )
