"""Compiling the flight code before anybody watches.

The kernels of simulation, navigation and control are compiled when they are first called. In a SITL that
keeps pace with the wall clock that would stop the vehicle for seconds, in the air too, so a throwaway vehicle
flies a little of everything first. With a warm compile cache it costs a fraction of a second.
"""

import math
from typing import Final

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.sitl.configuration import SitlConfiguration
from autopilot_bridge.sitl.sitl import Sitl

_BOOT_S: Final = 5.0
_PHASE_S: Final = 2.5


def compile_flight_code() -> None:
    """Fly a throwaway vehicle through take-off, an approach, a circle, a descent and all default streams."""
    sitl = Sitl(SitlConfiguration())
    vehicle = sitl.vehicles[0]
    link = sitl.connect(0)
    commander = vehicle.autopilot.commander
    guidance = commander.guidance
    _fly(sitl, _BOOT_S)
    commander.arm()
    guidance.takeoff(down_m=-5.0, yaw_rad=math.nan)
    _fly(sitl, 3.0 * _PHASE_S)
    guidance.reposition(north_m=5.0, east_m=5.0, down_m=-5.0)
    _fly(sitl, _PHASE_S)
    for mode in (FlightMode.ORBIT, FlightMode.RETURN, FlightMode.LAND):
        commander.set_mode(mode)
        _fly(sitl, _PHASE_S)
    link.receive()
    sitl.close()


def _fly(sitl: Sitl, seconds: float) -> None:
    for _ in range(round(seconds * 1e6) // sitl.step_us):
        sitl.advance()
