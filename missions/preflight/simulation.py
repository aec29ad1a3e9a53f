"""Whether a vehicle proves to be a simulation, so that it may fly without checks and without a question.

The address of a link proves nothing: MAVProxy and mavlink-router forward real aircraft to this machine. Nor
does a missing answer: only what the vehicle itself reports counts.
"""

import asyncio
import math
from contextlib import suppress
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.simulation_marks import is_sitl_version
from missions.errors import VehicleTimeout
from missions.vehicle.vehicle import Vehicle

_ATTEMPTS: Final = 2
SPEEDUP: Final = "SIM_SPEEDUP"
"""Parameter that only ArduPilot's simulation has."""
OUTPUTS: Final = "SIM_OH_MASK"
"""The outputs that ArduPilot's simulation on a real autopilot drives: motors may run unless it is 0."""


async def simulation_proof(vehicle: Vehicle) -> str:
    """What proves that a received vehicle is a simulation, as text; "": nothing does.

    Any of these is a proof, within some seconds:

    * MAV_MODE_FLAG_HIL_ENABLED of its heartbeat: "all motors / actuators are blocked" (MAVLink); PX4 sets it
      with SYS_HITL 1 (hardware in the loop) and 2 (SIH on an autopilot).
    * AUTOPILOT_VERSION of PX4's SITL (jMAVSim, Gazebo, SIH) or of our own.
    * ArduPilot's SIM_SPEEDUP together with SIM_OH_MASK 0: only its simulations have them.
    """
    heartbeat = vehicle.link.message(dialect.MAVLink_heartbeat_message)
    if heartbeat is not None and heartbeat.base_mode & dialect.MAV_MODE_FLAG_HIL_ENABLED:
        return "its heartbeat reports hardware in the loop"
    for _ in range(_ATTEMPTS):
        with suppress(VehicleTimeout):
            version = await vehicle.commands.request(dialect.MAVLink_autopilot_version_message)
            if is_sitl_version(version):
                return "it identifies itself as a SITL"
            break
    if vehicle.autopilot != "ardupilot":
        return ""
    speedup, outputs = await asyncio.gather(
        *(vehicle.parameters.read_or(name, math.nan) for name in (SPEEDUP, OUTPUTS))
    )
    if math.isfinite(speedup) and outputs == 0.0:
        return f"it has the parameters {SPEEDUP} and {OUTPUTS} 0"
    return ""
