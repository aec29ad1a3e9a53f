"""Closed loop for tests of the flight tasks: JSBSim Aerosonde, perfect navigation, control laws, task.

The navigation filter has its own tests; here its place is taken by the truth.
"""

import math

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.fixed_wing import FixedWingController, FixedWingParameters
from autopilot_bridge.flight.context import FlightContext, ManualInput
from autopilot_bridge.flight.fixed_wing import FixedWingFlightParameters, LandDetector
from autopilot_bridge.flight.task import FlightTask
from autopilot_bridge.navigation import layout as n
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.rotations import euler_from_quaternion, rotate
from flightsim.vehicle import InitialState
from flightsim.world import World, WorldParameters
from tests.control.fixed_wing.aerosonde import AEROSONDE
from tests.flight.fixed_wing.kinematic import healthy

Array = NDArray[np.float64]

GRAVITY_M_S2 = 9.80665
SEA_LEVEL_DENSITY_KG_M3 = 1.225


class Aircraft:
    """One aircraft with its controller, flight context and land detector; the home is where it starts."""

    def __init__(
        self,
        *,
        height_m: float | None = None,
        environment: Environment | None = None,
        parameters: FixedWingFlightParameters | None = None,
        launch: str | None = None,
        seed: int = 1,
        yaw_rad: float = 0.0,
        physics_rate_hz: int = 250,
        model: str = "aerosonde",
    ) -> None:
        environment = environment or Environment()
        e = AEROSONDE
        self.world = World(
            WorldParameters(seed=seed, physics_rate_hz=physics_rate_hz, environment=environment)
        )
        initial = InitialState(yaw_rad=yaw_rad, launch=launch)
        wind = environment.wind_ned_m_s
        if height_m is not None:
            speed = e.airspeed_trim_m_s * math.sqrt(SEA_LEVEL_DENSITY_KG_M3 / e.density_kg_m3)
            initial = InitialState(
                height_m=height_m,
                yaw_rad=yaw_rad,
                pitch_rad=e.trim_pitch_rad,
                vel_ned_m_s=(
                    speed * math.cos(yaw_rad) + wind[0],
                    speed * math.sin(yaw_rad) + wind[1],
                    wind[2],
                ),
                actuators=(e.trim_aileron, e.trim_elevator, e.trim_throttle, e.trim_rudder),
            )
        self.vehicle = self.world.add_vehicle(model, initial=initial)
        truth = self.vehicle.truth
        ground = float(truth[t.ALT_M]) - float(truth[t.HEIGHT_ABOVE_GROUND_M])
        self.frame = LocalFrame(
            GeodeticPosition(
                lat_deg=math.degrees(truth[t.LAT_RAD]), lon_deg=math.degrees(truth[t.LON_RAD]), alt_m=ground
            )
        )
        self.nav: Array = np.zeros(n.NAV_SIZE)
        self.controller = FixedWingController(
            FixedWingParameters.for_envelope(e), physics_rate_hz=physics_rate_hz, nav=self.nav
        )
        self.parameters = parameters or FixedWingFlightParameters.for_envelope(e)
        self.ctx = ctx = FlightContext(
            nav=self.nav, setpoint=self.controller.setpoint, parameters=self.parameters
        )
        ctx.health = healthy()
        ctx.frame = self.frame
        ctx.armed = True
        self.detector = LandDetector(on_ground=height_m is None)
        ctx.landed_state = self.detector.state
        ctx.ground_contact = ctx.maybe_landed = height_m is None
        self.slow_steps = physics_rate_hz // 50
        self._steps = 0
        self.task: FlightTask | None = None
        self.rangefinder = False
        self.log: list[Array] = []
        self.setpoint_log: list[Array] = []
        self.touch_sink_m_s = math.nan  # at the first contact after the take-off
        self.touch_ned_m = (math.nan, math.nan)
        self._flown = height_m is not None
        self.observe()
        ctx.home_ned_m[:] = (0.0, 0.0, 0.0)
        if height_m is None:
            ctx.home_ned_m[2] = self.nav[n.POS_NED_M][2]
        ctx.home_yaw_rad = yaw_rad

    @property
    def time_s(self) -> float:
        """Seconds since the start."""
        return self.world.time_us * 1e-6

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
        height = float(truth[t.HEIGHT_ABOVE_GROUND_M])
        nav[n.HEIGHT_ABOVE_GROUND_M] = height if getattr(self, "rangefinder", False) else math.nan
        nav[n.WIND_NED_M_S] = self.world.parameters.environment.wind_ned_m_s
        tas = float(truth[t.AIRSPEED_TRUE_M_S])
        nav[n.AIRSPEED_TRUE_M_S] = tas
        nav[n.AIRSPEED_M_S] = tas * math.sqrt(float(truth[t.DENSITY_KG_M3]) / SEA_LEVEL_DENSITY_KG_M3)

    def fly(self, task: FlightTask) -> None:
        """Make a task the active one."""
        self.task = task
        task.activate(self.ctx)

    def sticks(self, **values: float) -> None:
        """A pilot holds the sticks like this."""
        self.ctx.sticks = ManualInput(valid=True, **values)

    def step(self) -> None:
        """One physics step, with the slow loop when it is due."""
        if self._steps % self.slow_steps == 0:
            self.ctx.time_us = self.world.time_us
            self.detector.update(self.ctx, self.controller.thrust)
            if self.task is not None:
                self.task.update(self.ctx)
            self.controller.set_ground_contact(self.ctx.ground_contact)
            self.log.append(self.nav.copy())
            self.setpoint_log.append(self.controller.setpoint.copy())
        self._steps += 1
        self.controller.step()
        sink = float(self.vehicle.truth[t.VEL_NED_M_S][2])
        self.vehicle.step(self.controller.actuators)
        self.world.advance()
        self.observe()
        contact = self.vehicle.truth[t.ON_GROUND] != 0.0
        if self._flown and contact and math.isnan(self.touch_sink_m_s):
            self.touch_sink_m_s = sink
            self.touch_ned_m = (float(self.nav[n.POS_NED_M][0]), float(self.nav[n.POS_NED_M][1]))
        self._flown = self._flown or -float(self.nav[n.POS_NED_M][2]) > 10.0

    def run(self, duration_s: float) -> Array:
        """Fly for a while; the navigation states at 50 Hz of that time, (n, NAV_SIZE)."""
        start = len(self.log)
        for _ in range(round(duration_s * self.slow_steps * 50)):
            self.step()
        return np.array(self.log[start:])

    def run_until(self, condition: object, limit_s: float) -> float:
        """Fly until `condition()` holds; the time it took. Fails at the limit."""
        assert callable(condition)
        start = self.time_s
        while not condition():
            assert self.time_s - start < limit_s, f"not within {limit_s} s"
            for _ in range(self.slow_steps):
                self.step()
        return self.time_s - start
