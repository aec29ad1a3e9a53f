"""Closed loop for tests of control laws and flight tasks: JSBSim vehicle, perfect navigation, controller.

The navigation filter has its own tests; here its place is taken by the truth, so that the tests measure the
control only.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import layout as n
from autopilot_bridge.navigation.health import NavigationHealth
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.flight_envelope import FlightEnvelope
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.rotations import euler_from_quaternion, rotate
from flightsim.vehicle import InitialState
from flightsim.world import World, WorldParameters

Array = NDArray[np.float64]

GRAVITY_M_S2 = 9.80665
SEA_LEVEL_DENSITY_KG_M3 = 1.225
SLOW_RATE_HZ = 50


def healthy() -> NavigationHealth:
    """The health of a filter with every output valid."""
    health = NavigationHealth()
    health.uninitialised = False
    health.attitude = health.velocity_horizontal = health.velocity_vertical = True
    health.position_horizontal_relative = health.position_horizontal_absolute = True
    health.position_vertical_absolute = True
    return health


class ClosedLoop:
    """One vehicle with its controller. A subclass extends `slow` with what runs at 50 Hz.

    Args:
        model: the vehicle.
        controller: makes the controller from the navigation state and the physics rate.
        initial: initial state of the vehicle.
    """

    rangefinder = False

    def __init__(
        self,
        model: str | Path,
        controller: Callable[[Array, int], Any],
        *,
        initial: InitialState,
        environment: Environment | None,
        seed: int,
        physics_rate_hz: int,
    ) -> None:
        self.world = World(
            WorldParameters(
                seed=seed, physics_rate_hz=physics_rate_hz, environment=environment or Environment()
            )
        )
        self.vehicle = self.world.add_vehicle(model, initial=initial)
        truth = self.vehicle.truth
        self.frame = LocalFrame(
            GeodeticPosition(
                lat_deg=math.degrees(truth[t.LAT_RAD]),
                lon_deg=math.degrees(truth[t.LON_RAD]),
                alt_m=float(truth[t.ALT_M]) - float(truth[t.HEIGHT_ABOVE_GROUND_M]),
            )
        )
        self.nav: Array = np.zeros(n.NAV_SIZE)
        self.controller = controller(self.nav, physics_rate_hz)
        self.slow_steps = physics_rate_hz // SLOW_RATE_HZ
        self._steps = 0
        self.log: list[Array] = []
        self.setpoint_log: list[Array] = []
        self.observe()

    @property
    def time_s(self) -> float:
        """Seconds since the start."""
        return self.world.time_us * 1e-6

    def observe(self) -> None:
        """Write the navigation state from the truth."""
        truth, nav = self.vehicle.truth, self.nav
        q = truth[t.Q_NED_FROM_FRD]
        nav[n.Q_NED_FROM_FRD] = q
        nav[n.RATES_FRD_RAD_S] = truth[t.RATES_FRD_RAD_S]
        nav[n.VEL_NED_M_S] = truth[t.VEL_NED_M_S]
        nav[n.POS_NED_M] = self.frame.ned_from_geodetic(
            math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD]), float(truth[t.ALT_M])
        )
        nav[n.SPECIFIC_FORCE_FRD_M_S2] = truth[t.SPECIFIC_FORCE_FRD_M_S2]
        acc = np.zeros(3)
        rotate(q, truth[t.SPECIFIC_FORCE_FRD_M_S2], acc)
        acc[2] += GRAVITY_M_S2
        nav[n.ACC_NED_M_S2] = acc
        euler_from_quaternion(q, nav[n.EULER_RAD])
        height_m = float(truth[t.HEIGHT_ABOVE_GROUND_M])
        nav[n.HEIGHT_ABOVE_GROUND_M] = height_m if self.rangefinder else math.nan
        nav[n.WIND_NED_M_S] = math.nan

    def slow(self) -> None:
        """Called at 50 Hz before the controller's step; it writes one row of the logs."""
        self.log.append(self.nav.copy())
        self.setpoint_log.append(self.controller.setpoint.copy())

    def step(self) -> None:
        """One physics step, with the slow part when it is due."""
        if self._steps % self.slow_steps == 0:
            self.slow()
        self._steps += 1
        self.controller.step()
        self.vehicle.step(self.controller.actuators)
        self.world.advance()
        self.observe()

    def run(self, duration_s: float) -> Array:
        """Fly for a while; the rows of the log of that time, at 50 Hz."""
        start = len(self.log)
        for _ in range(round(duration_s * self.slow_steps * SLOW_RATE_HZ)):
            self.step()
        return np.array(self.log[start:])


class WingLoop(ClosedLoop):
    """A fixed-wing aircraft: the navigation state also contains airspeed and wind, unless unknown."""

    wind_known = True
    airspeed_known = True

    def observe(self) -> None:
        super().observe()
        truth, nav = self.vehicle.truth, self.nav
        if self.wind_known:
            nav[n.WIND_NED_M_S] = self.world.parameters.environment.wind_ned_m_s
        tas = float(truth[t.AIRSPEED_TRUE_M_S]) if self.airspeed_known else math.nan
        nav[n.AIRSPEED_TRUE_M_S] = tas
        nav[n.AIRSPEED_M_S] = tas * math.sqrt(float(truth[t.DENSITY_KG_M3]) / SEA_LEVEL_DENSITY_KG_M3)


def trimmed(
    envelope: FlightEnvelope, height_m: float, yaw_rad: float, environment: Environment | None
) -> InitialState:
    """An aircraft in trimmed level flight through the air of an environment."""
    speed = envelope.airspeed_trim_m_s * math.sqrt(SEA_LEVEL_DENSITY_KG_M3 / envelope.density_kg_m3)
    wind = (environment or Environment()).wind_ned_m_s
    return InitialState(
        height_m=height_m,
        yaw_rad=yaw_rad,
        pitch_rad=envelope.trim_pitch_rad,
        vel_ned_m_s=(speed * math.cos(yaw_rad) + wind[0], speed * math.sin(yaw_rad) + wind[1], wind[2]),
        actuators=(
            envelope.trim_aileron,
            envelope.trim_elevator,
            envelope.trim_throttle,
            envelope.trim_rudder,
        ),
    )
