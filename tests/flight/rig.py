"""Closed loop for tests of control laws and flight tasks: iris model, perfect navigation, controller, task.

The navigation filter has its own tests; here its place is taken by the truth, so that what is measured is
the control.
"""

import math

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.control.multicopter import MulticopterController, MulticopterParameters
from autopilot_bridge.flight.multicopter import FlightContext, FlightParameters, FlightTask, LandDetector
from autopilot_bridge.navigation import layout as nav_layout
from autopilot_bridge.navigation.health import NavigationHealth
from flightsim import truth as t
from flightsim.environment import Environment
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.rotations import euler_from_quaternion, rotate
from flightsim.vehicle import InitialState
from flightsim.world import World, WorldParameters

Array = NDArray[np.float64]

GRAVITY_M_S2 = 9.80665


class Rig:
    """One vehicle with its controller, flight context and land detector."""

    def __init__(
        self,
        *,
        height_m: float | None = None,
        environment: Environment | None = None,
        parameters: FlightParameters | None = None,
        control: MulticopterParameters | None = None,
        seed: int = 1,
        physics_rate_hz: int = 250,
    ) -> None:
        world = WorldParameters(
            seed=seed, physics_rate_hz=physics_rate_hz, environment=environment or Environment()
        )
        self.world = World(world)
        initial = InitialState()
        if height_m is not None:
            initial = InitialState(height_m=height_m, rotor_rad_s=485.0, yaw_rad=0.0)
        self.vehicle = self.world.add_vehicle("iris", initial=initial)
        truth = self.vehicle.truth
        home_alt = float(truth[t.ALT_M]) - float(truth[t.HEIGHT_ABOVE_GROUND_M])
        home = GeodeticPosition(
            lat_deg=math.degrees(truth[t.LAT_RAD]), lon_deg=math.degrees(truth[t.LON_RAD]), alt_m=home_alt
        )
        self.frame = LocalFrame(home)
        self.nav: Array = np.zeros(nav_layout.NAV_SIZE)
        self.controller = MulticopterController(control, physics_rate_hz=physics_rate_hz, nav=self.nav)
        self.ctx = FlightContext(nav=self.nav, setpoint=self.controller.setpoint, parameters=parameters)
        health = NavigationHealth()
        health.uninitialised = False
        health.attitude = health.velocity_horizontal = health.velocity_vertical = True
        health.position_horizontal_relative = health.position_horizontal_absolute = True
        health.position_vertical_absolute = True
        self.ctx.health = health
        self.ctx.frame = self.frame
        self.ctx.home_ned_m[:] = 0.0
        self.ctx.home_yaw_rad = 0.0
        self.ctx.armed = True
        self.detector = LandDetector(on_ground=height_m is None)
        self.ctx.landed_state = self.detector.state
        self.ctx.ground_contact = self.ctx.maybe_landed = height_m is None
        self.slow_steps = physics_rate_hz // 50
        self._steps = 0
        self.task: FlightTask | None = None
        self.log: list[Array] = []
        self.setpoint_log: list[Array] = []
        self.landed_log: list[int] = []
        self.observe()

    @property
    def time_s(self) -> float:
        """Seconds since the start."""
        return self.world.time_us * 1e-6

    def observe(self) -> None:
        """Navigation state from the truth."""
        truth, nav = self.vehicle.truth, self.nav
        q = truth[t.Q_NED_FROM_FRD]
        nav[nav_layout.Q_NED_FROM_FRD] = q
        nav[nav_layout.RATES_FRD_RAD_S] = truth[t.RATES_FRD_RAD_S]
        nav[nav_layout.VEL_NED_M_S] = truth[t.VEL_NED_M_S]
        nav[nav_layout.POS_NED_M] = self.frame.ned_from_geodetic(
            math.degrees(truth[t.LAT_RAD]), math.degrees(truth[t.LON_RAD]), float(truth[t.ALT_M])
        )
        nav[nav_layout.SPECIFIC_FORCE_FRD_M_S2] = truth[t.SPECIFIC_FORCE_FRD_M_S2]
        acc = np.zeros(3)
        rotate(q, truth[t.SPECIFIC_FORCE_FRD_M_S2], acc)
        acc[2] += GRAVITY_M_S2
        nav[nav_layout.ACC_NED_M_S2] = acc
        euler_from_quaternion(q, nav[nav_layout.EULER_RAD])
        nav[nav_layout.HEIGHT_ABOVE_GROUND_M] = math.nan
        nav[nav_layout.WIND_NED_M_S] = math.nan

    def fly(self, task: FlightTask) -> None:
        """Make a task the active one."""
        self.task = task
        task.activate(self.ctx)

    def step(self) -> None:
        """One physics step, with the slow loop when it is due."""
        if self._steps % self.slow_steps == 0:
            self.ctx.time_us = self.world.time_us
            self.ctx.hover_thrust = self.controller.hover_thrust
            self.detector.update(self.ctx, self.controller.thrust)
            if self.task is not None:
                self.task.update(self.ctx)
            self.log.append(self.nav.copy())
            self.setpoint_log.append(self.controller.setpoint.copy())
            self.landed_log.append(int(self.ctx.landed_state))
        self._steps += 1
        self.controller.step()
        self.vehicle.step(self.controller.actuators)
        self.world.advance()
        self.observe()

    def run(self, duration_s: float) -> Array:
        """Fly for a while; the navigation states at 50 Hz of that time, (n, NAV_SIZE)."""
        start = len(self.log)
        for _ in range(round(duration_s * self.slow_steps * 50)):
            self.step()
        return np.array(self.log[start:])


def positions(log: Array) -> Array:
    """NED positions of a log, (n, 3)."""
    return log[:, nav_layout.POS_NED_M]


def velocities(log: Array) -> Array:
    """NED velocities of a log, (n, 3)."""
    return log[:, nav_layout.VEL_NED_M_S]


def tilts(log: Array) -> Array:
    """Angles between the body's down axis and down, rad, (n,)."""
    return np.arccos(np.clip(np.cos(log[:, 25]) * np.cos(log[:, 26]), -1.0, 1.0))
