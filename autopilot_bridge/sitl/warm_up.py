"""Compilation of the flight code before the start of a flight.

The kernels of simulation, navigation and control are compiled at their first call. In a SITL that keeps pace
with the wall clock this would stop the vehicle for seconds, even in the air, so a temporary vehicle
flies each kind of manoeuvre first. With a filled compile cache this takes a fraction of a second.
"""

import math
from collections.abc import Iterable
from functools import cache
from typing import Final

import numpy as np

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.navigation import external as external
from autopilot_bridge.packet_records import packet_records
from autopilot_bridge.sitl.sitl import Sitl
from flightsim.airframe import AirframeKind, load_airframe
from flightsim.environment import Environment
from flightsim.world_spec import VehicleSpec, WorldSpec

_BOOT_S: Final = 5.0
_PHASE_S: Final = 2.5
_MODELS: Final = {AirframeKind.MULTICOPTER: "iris", AirframeKind.FIXED_WING: "aerosonde"}


def compile_flight_code(vehicles: Iterable[VehicleSpec] = (VehicleSpec(),)) -> None:
    """Fly a temporary vehicle of each kind through take-off, an approach, a circle, a descent and streams.

    Each kind is flown only once in a process.

    Args:
        vehicles: the vehicles of the flight; only their kinds matter.

    Raises:
        AirframeError: a model can't be used.
    """
    for kind in sorted({load_airframe(vehicle.model).kind for vehicle in vehicles}):
        _compile(kind)


@cache
def _compile(kind: AirframeKind) -> None:
    specification = VehicleSpec(model=_MODELS[kind])
    # turbulence and external position estimates may come at any time of a flight
    air = Environment.from_wind(speed_m_s=2.0, from_deg=0.0, turbulence="light")
    sitl = Sitl(WorldSpec(vehicles=(specification,), air=air))
    link = sitl.connect(0)
    fly = _fly_aircraft if kind is AirframeKind.FIXED_WING else _fly_multicopter
    fly(sitl)
    encoder = FrameEncoder(1, 191)
    for k in range(5):
        time_us = sitl.time_us
        frame = encoder.encode(dialect.MAVLink_vision_position_estimate_message(time_us, *(0.0,) * 6))
        link.send(frame)
        packet_records([time_us], [frame])
        _advance(sitl, 0.1 * (k + 1))
    link.receive()
    sitl.close()


def _fly_multicopter(sitl: Sitl) -> None:
    commander = sitl.vehicles[0].autopilot.commander
    guidance = commander.guidance
    _advance(sitl, _BOOT_S)
    commander.arm()
    guidance.takeoff(down_m=-5.0, yaw_rad=math.nan)
    _advance(sitl, 3.0 * _PHASE_S)
    guidance.reposition(north_m=5.0, east_m=5.0, down_m=-5.0)
    _advance(sitl, _PHASE_S)
    _send_odometry(sitl)
    _advance(sitl, _PHASE_S)
    for mode in (FlightMode.ORBIT, FlightMode.RETURN, FlightMode.LAND):
        commander.set_mode(mode)
        _advance(sitl, _PHASE_S)


def _send_odometry(sitl: Sitl) -> None:
    """Send a velocity as visual odometry does."""
    autopilot = sitl.vehicles[0].autopilot
    autopilot.parameters.set("EKF2_EV_CTRL", 4)
    values = np.full(external.SAMPLE_SIZE, math.nan)
    values[external.VELOCITY_M_S] = 0.0
    unknown = (math.nan, math.nan, math.nan)
    autopilot.navigation.take_external(
        external.ExternalSample(
            time_us=sitl.time_us,
            values=values,
            frame=external.ExternalFrame.NED,
            velocity_frame=external.ExternalFrame.NED,
            position_variance_m2=unknown,
            velocity_variance_m2_s2=unknown,
            yaw_variance_rad2=math.nan,
        )
    )


def _fly_aircraft(sitl: Sitl) -> None:
    commander = sitl.vehicles[0].autopilot.commander
    _advance(sitl, _BOOT_S)
    commander.set_mode(FlightMode.TAKEOFF)
    commander.arm()
    _advance(sitl, 8.0 * _PHASE_S)
    commander.guidance.reposition(north_m=200.0, east_m=0.0, down_m=-50.0)
    _advance(sitl, _PHASE_S)
    for mode in (FlightMode.HOLD, FlightMode.RETURN, FlightMode.LAND):
        commander.set_mode(mode)
        _advance(sitl, _PHASE_S)


def _advance(sitl: Sitl, seconds: float) -> None:
    for _ in range(round(seconds * 1e6) // sitl.step_us):
        sitl.advance()
