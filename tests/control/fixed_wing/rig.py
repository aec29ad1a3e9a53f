"""Closed loop for tests of the fixed-wing control laws: JSBSim aircraft, perfect navigation, controller.

The navigation filter has its own tests; here its place is taken by the truth, so that what is measured is
the control.
"""

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import FixedWingController, FixedWingParameters
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.navigation import layout as n
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

# columns of a log after the navigation state
AIRSPEED_ERROR = n.NAV_SIZE
ACTUATORS = slice(n.NAV_SIZE + 1, n.NAV_SIZE + 9)
ROLL_SP = n.NAV_SIZE + 9
PITCH_SP = n.NAV_SIZE + 10
LOG_SIZE = n.NAV_SIZE + 11


class Rig:
    """One aircraft in the air with its controller; `set` writes the setpoint, `run` flies it."""

    def __init__(
        self,
        envelope: FlightEnvelope,
        *,
        model: str | Path = "aerosonde",
        height_m: float = 150.0,
        environment: Environment | None = None,
        control: FixedWingParameters | None = None,
        seed: int = 1,
        physics_rate_hz: int = 250,
        yaw_rad: float = 0.0,
    ) -> None:
        environment = environment or Environment()
        self.envelope = envelope
        self.world = World(
            WorldParameters(seed=seed, physics_rate_hz=physics_rate_hz, environment=environment)
        )
        speed = envelope.airspeed_trim_m_s * math.sqrt(SEA_LEVEL_DENSITY_KG_M3 / envelope.density_kg_m3)
        wind = environment.wind_ned_m_s
        trim = (envelope.trim_aileron, envelope.trim_elevator, envelope.trim_throttle, envelope.trim_rudder)
        self.vehicle = self.world.add_vehicle(
            model,
            initial=InitialState(
                height_m=height_m,
                yaw_rad=yaw_rad,
                pitch_rad=envelope.trim_pitch_rad,
                vel_ned_m_s=(
                    speed * math.cos(yaw_rad) + wind[0],
                    speed * math.sin(yaw_rad) + wind[1],
                    wind[2],
                ),
                actuators=trim,
            ),
        )
        truth = self.vehicle.truth
        ground = float(truth[t.ALT_M]) - float(truth[t.HEIGHT_ABOVE_GROUND_M])
        self.frame = LocalFrame(
            GeodeticPosition(
                lat_deg=math.degrees(truth[t.LAT_RAD]), lon_deg=math.degrees(truth[t.LON_RAD]), alt_m=ground
            )
        )
        self.wind_known = True
        self.airspeed_known = True
        self.nav: Array = np.zeros(n.NAV_SIZE)
        self.controller = FixedWingController(
            control or FixedWingParameters.for_envelope(envelope),
            physics_rate_hz=physics_rate_hz,
            nav=self.nav,
        )
        self.slow_steps = physics_rate_hz // 50
        self._steps = 0
        self.log: list[Array] = []
        self.observe()
        self.set(down_m=-height_m, heading_rad=yaw_rad)

    def set(self, **values: float) -> None:
        """Write a setpoint at level FLY: fields by their names in the layout, in lower case; the rest NaN."""
        setpoint = self.controller.setpoint
        setpoint[:] = math.nan
        setpoint[sp.LEVEL] = sp.FLY
        for name, value in values.items():
            setpoint[getattr(sp, name.upper())] = value

    def observe(self) -> None:
        """Navigation state from the truth."""
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
        nav[n.HEIGHT_ABOVE_GROUND_M] = math.nan
        nav[n.WIND_NED_M_S] = self.world.parameters.environment.wind_ned_m_s if self.wind_known else math.nan
        tas = float(truth[t.AIRSPEED_TRUE_M_S]) if self.airspeed_known else math.nan
        nav[n.AIRSPEED_TRUE_M_S] = tas
        nav[n.AIRSPEED_M_S] = tas * math.sqrt(float(truth[t.DENSITY_KG_M3]) / SEA_LEVEL_DENSITY_KG_M3)

    def step(self) -> None:
        """One physics step."""
        if self._steps % self.slow_steps == 0:
            row = np.zeros(LOG_SIZE)
            row[: n.NAV_SIZE] = self.nav
            row[AIRSPEED_ERROR] = self.controller.airspeed_error_m_s
            row[ACTUATORS] = self.controller.actuators
            row[ROLL_SP] = self.controller.roll_setpoint_rad
            row[PITCH_SP] = self.controller.pitch_setpoint_rad
            self.log.append(row)
        self._steps += 1
        self.controller.step()
        self.vehicle.step(self.controller.actuators)
        self.world.advance()
        self.observe()

    def run(self, duration_s: float) -> Array:
        """Fly for a while; the log at 50 Hz of that time, (n, LOG_SIZE)."""
        start = len(self.log)
        for _ in range(round(duration_s * self.slow_steps * 50)):
            self.step()
        return np.array(self.log[start:])
