"""One session of a vehicle as a mission: commands on the ground and in the air, steps, and the way home.

`benchmarks.firmware_fidelity` flies it under a real firmware and under its emulation.
"""

import contextlib
from typing import Final

from autopilot_bridge.mavlink import dialect
from flightstack import FlightOptions, Vehicle
from missions.errors import VehicleTimeout

HEIGHT_M: Final = 10.0
STEP_M: Final = 15.0
_REQUESTED: Final = (
    "ATTITUDE",
    "AUTOPILOT_VERSION",
    "AVAILABLE_MODES",
    "COMPONENT_METADATA",
    "EKF_STATUS_REPORT",
    "EXTENDED_SYS_STATE",
    "FLIGHT_INFORMATION",
    "GPS_RAW_INT",
    "HOME_POSITION",
    "LINK_NODE_STATUS",
    "PROTOCOL_VERSION",
    "RC_CHANNELS",
    "STORAGE_INFORMATION",
    "TIME_ESTIMATE_TO_TARGET",
)
_ON_THE_GROUND: Final = (
    (dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION, 1.0),
    (dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1.0),
    (dialect.MAV_CMD_GET_HOME_POSITION,),
    (dialect.MAV_CMD_GET_MESSAGE_INTERVAL, float(dialect.MAVLINK_MSG_ID_ATTITUDE)),
    (dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 12345.0, 1e5),
    (dialect.MAV_CMD_DO_SET_SERVO, 12.0, 1500.0),
    (dialect.MAV_CMD_DO_SET_ROI_NONE,),
    (dialect.MAV_CMD_DO_JUMP,),
    (dialect.MAV_CMD_DO_LAND_START,),
    (dialect.MAV_CMD_NAV_WAYPOINT,),
    (dialect.MAV_CMD_RUN_PREARM_CHECKS,),
)
_IN_THE_AIR: Final = (
    (dialect.MAV_CMD_DO_CHANGE_SPEED, 1.0, 4.0, -1.0),
    (dialect.MAV_CMD_DO_SET_ROI_NONE,),
    (dialect.MAV_CMD_DO_PARACHUTE, 0.0),
    (dialect.MAV_CMD_DO_FENCE_ENABLE, 0.0),
    (dialect.MAV_CMD_REQUEST_PROTOCOL_VERSION, 1.0),
)


async def fly(vehicle: Vehicle, options: FlightOptions) -> None:
    """Fly the session; the vehicle is ready to arm."""
    await vehicle.clock.sleep(5.0)
    for name in _REQUESTED:
        number = getattr(dialect, f"MAVLink_{name.lower()}_message").id
        await _answer(vehicle, dialect.MAV_CMD_REQUEST_MESSAGE, float(number))
    for command, *parameters in _ON_THE_GROUND:
        await _answer(vehicle, command, *parameters)
    await vehicle.arm()
    await vehicle.takeoff(HEIGHT_M)
    await vehicle.clock.sleep(5.0)
    for command, *parameters in _IN_THE_AIR:
        await _answer(vehicle, command, *parameters)
    await vehicle.goto_ned(STEP_M, 0.0, -HEIGHT_M)
    await vehicle.clock.sleep(8.0)
    await vehicle.return_to_launch()


async def _answer(vehicle: Vehicle, command: int, *parameters: float) -> None:
    """Send a command; a vehicle may leave it without an answer."""
    with contextlib.suppress(VehicleTimeout):
        await vehicle.try_command(command, *parameters)
