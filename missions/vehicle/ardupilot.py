"""The interface of missions to ArduPilot's copter (4.6 behaviour)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.planning.limits import Limits, MulticopterLimits
from missions.vehicle.adapter import Mode, ModeCommand, missing_basics

if TYPE_CHECKING:
    from missions.vehicle.vehicle import Vehicle

_NAMES: Final[Mapping[int, str]] = MappingProxyType(
    {
        0: "Stabilize",
        1: "Acro",
        2: "Alt Hold",
        3: "Auto",
        4: "Guided",
        5: "Loiter",
        6: "RTL",
        7: "Circle",
        9: "Land",
        11: "Drift",
        13: "Sport",
        14: "Flip",
        15: "AutoTune",
        16: "PosHold",
        17: "Brake",
        18: "Throw",
        19: "Avoid ADSB",
        20: "Guided NoGPS",
        21: "Smart RTL",
        22: "FlowHold",
        23: "Follow",
        24: "ZigZag",
        25: "SystemID",
        26: "Autorotate",
        27: "Auto RTL",
        28: "Turtle",
    }
)
_EKF_NEEDED: Final = 0x01 | 0x02 | 0x04 | 0x10 | 0x20  # attitude, velocities, absolute positions
_EKF_CONST_POS: Final = 0x80


class ArduCopter:
    """ArduPilot copter: it sends nothing until requested, numbers home as mission item 0, and uses
    PARAM_FLOAT.
    """

    name = "ardupilot"
    kind = VehicleKind.MULTICOPTER
    # HOLD is BRAKE: it holds position without a pilot's sticks, which LOITER would follow (throttle low:
    # descend)
    modes: Mapping[Mode, int] = MappingProxyType(
        {
            Mode.HOLD: 17,
            Mode.TAKEOFF: 4,
            Mode.GUIDED: 4,
            Mode.MISSION: 3,
            Mode.RETURN: 6,
            Mode.LAND: 9,
            Mode.POSITION: 5,
        }
    )
    stream_rates_hz: Mapping[str, float] = MappingProxyType(
        {
            "GLOBAL_POSITION_INT": 10.0,
            "LOCAL_POSITION_NED": 20.0,
            "ATTITUDE": 20.0,
            "ATTITUDE_TARGET": 20.0,
            "POSITION_TARGET_LOCAL_NED": 10.0,
            "EXTENDED_SYS_STATE": 5.0,
        }
    )
    bytewise_parameters = False
    setpoints_before_guided = False
    first_mission_item_is_home = True
    goto_mode = Mode.GUIDED
    resting_mode = Mode.GUIDED
    unset = 0.0  # NaN is refused
    roll_alone = False
    limiting_parameters: Mapping[str, float] = MappingProxyType({"WPNAV_SPEED": 1000.0, "WPNAV_ACCEL": 250.0})

    def mode_name(self, custom_mode: int) -> str:
        return _NAMES.get(custom_mode, f"mode {custom_mode}")

    def mode_command(self, mode: Mode) -> ModeCommand:
        return ModeCommand(main=self.modes[mode])

    def readiness(self, vehicle: "Vehicle") -> list[str]:
        missing = missing_basics(vehicle)
        ekf = vehicle.message("EKF_STATUS_REPORT")
        if ekf is None or ekf.flags & _EKF_NEEDED != _EKF_NEEDED or ekf.flags & _EKF_CONST_POS:
            missing.append("navigation filter on GPS")
        return missing

    async def prepare_arming(self, vehicle: "Vehicle") -> None:
        if vehicle.custom_mode != self.modes[Mode.GUIDED]:
            await vehicle.set_mode(Mode.GUIDED)

    async def take_off(self, vehicle: "Vehicle", altitude_m: float) -> None:
        if vehicle.custom_mode != self.modes[Mode.GUIDED]:
            await vehicle.set_mode(Mode.GUIDED)
        await vehicle.command(dialect.MAV_CMD_NAV_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, altitude_m)

    async def start_streams(self, vehicle: "Vehicle") -> None:
        vehicle.send(
            dialect.MAVLink_request_data_stream_message(
                vehicle.system_id, 1, dialect.MAV_DATA_STREAM_ALL, 4, 1
            )
        )
        for name, rate_hz in self.stream_rates_hz.items():
            await vehicle.set_message_rate(name, rate_hz)

    async def start_mission(self, vehicle: "Vehicle") -> None:
        if not vehicle.armed:
            await vehicle.arm()  # AUTO is not a mode for arming: arm in GUIDED
        await vehicle.set_mode(Mode.MISSION)
        await vehicle.command(dialect.MAV_CMD_MISSION_START, 0.0, 0.0)

    def limits(self, parameters: Mapping[str, float]) -> Limits:
        values = {**self.limiting_parameters, **parameters}
        return MulticopterLimits(
            speed_m_s=0.01 * values["WPNAV_SPEED"], acceleration_m_s2=0.01 * values["WPNAV_ACCEL"]
        )

    async def acceptance_m(self, vehicle: "Vehicle", asked_m: float) -> float:
        return 0.01 * await vehicle.parameter_or("WPNAV_RADIUS", 100.0 * asked_m)  # param2 is not used

    async def own_acceptance_m(self, vehicle: "Vehicle") -> float:
        return 0.01 * await vehicle.parameter_or("WPNAV_RADIUS", 200.0)

    async def loiter(
        self, vehicle: "Vehicle", place: GeodeticPosition, radius_m: float | None, clockwise: bool
    ) -> None:
        raise PlanError("a multicopter does not circle a place by itself: use goto, or an orbit of your own")

    async def change_altitude(self, vehicle: "Vehicle", altitude_m: float) -> None:
        position = await vehicle.position()
        await vehicle.command_int(
            dialect.MAV_CMD_DO_REPOSITION,
            dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT,
            (-1.0, 1.0, 0.0, 0.0),
            round(position.lat_deg * 1e7),
            round(position.lon_deg * 1e7),
            altitude_m,
        )

    async def change_airspeed(self, vehicle: "Vehicle", airspeed_m_s: float) -> None:
        raise PlanError("a multicopter has no airspeed to hold: use set_speed")

    def takeoff_item(self, home: GeodeticPosition, altitude_m: float) -> MissionItem:
        return MissionItem(command=dialect.MAV_CMD_NAV_TAKEOFF, x=home.lat_deg, y=home.lon_deg, z=altitude_m)
